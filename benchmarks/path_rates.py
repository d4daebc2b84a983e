"""Rate of change of a correction at epochs without a jump of the recorded path.

    python benchmarks/path_rates.py [FILE of real POS errors (.err)] [--seeds 5] [--worst 10]

Corrected - recorded position may change abruptly only where the recorded path does. Each drive is
estimated at the rate of its recording. Prints for each kind of POS the largest rate of corrected -
recorded, beyond that of the true error over two seconds between jumps, outside the steps of the
recorded path and the gaps between passes; the epochs at which it is beyond 0.2 m/s; and the largest
difference between a jump that is applied and the step of the path there, in m and in sigmas of the
step per axis; then the worst drives. Twelve kinds of five seeds are 60 drives: demo, car, boat and
canyon; MEMS and tactical units, filtered and smoothed, with outages; the demo smoothed, and without
sigma(t); a POS whose GNSS loses its fixed solution, and one that drifts unstated.
"""

import argparse
import warnings
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from feature_surveys import feature_survey, scenarios
from pos_study import UNSTATED, bumped, drives, left, unfixed
from real_windows import cases

from mlscorr.estimate import estimate_correction
from mlscorr.pos import drift_history
from mlscorr.simulate import DEMO

LIMIT = 0.2  # m/s: 2 mm from one epoch to the next at 100 Hz, less than a scanner's noise


class Rates(NamedTuple):
    """Rate (m/s), its time, epochs beyond LIMIT, excess at steps, error, share in 1.96 sigma."""

    largest: float
    at: float
    beyond: int
    excess: float
    sigmas: float
    left: float
    within: float


def surveys(series, seeds):
    """Rows of kind, name, recorded trajectory, matched control, true - recorded, beliefs."""
    if series is not None:
        for name, trajectory, matched, error in cases(series):
            yield "real", name, trajectory, matched, error, None
            hidden = replace(trajectory, position_sigma=None)
            yield "real no sigma", name, hidden, matched, error, UNSTATED
    made = {"demo": DEMO, **drives()}
    smoothed = DEMO.pos.model_copy(update={"processing": "smoothed"})
    made["demo smoothed"] = DEMO.model_copy(update={"pos": smoothed})
    made["canyon"] = scenarios()["canyon"]
    for kind, scenario in made.items():
        for seed in range(seeds):
            survey = feature_survey(scenario, seed, rate=None)
            error = survey.true.position - survey.recorded.position
            yield kind, f"seed {seed}", survey.recorded, survey.matched, error, None
            if kind == "demo":
                hidden = replace(survey.recorded, position_sigma=None)
                yield f"{kind} no sigma", f"seed {seed}", hidden, survey.matched, error, UNSTATED
    for seed in range(seeds):
        yield "not fixed at times", f"seed {seed}", *unfixed(seed), None
        yield "drifting for seconds", f"seed {seed}", *bumped(seed), None


def rates(trajectory, matched, error, pos):
    """Rates of the correction of one drive."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        correction = estimate_correction(trajectory, matched, pos).correction
    time = trajectory.gps_time
    moved = correction.corrected.position - trajectory.position
    steps = drift_history(trajectory).steps
    begin = time[:-1]
    end = time[1:]
    is_jump = np.isin(begin, trajectory.gaps[:, 0])
    excess = [0.0]
    sigmas = [0.0]
    for before, after, size, sigma in zip(
        steps.before, steps.after, steps.size, steps.sigma, strict=True
    ):
        is_jump |= (begin >= before - 1e-6) & (end <= after + 1e-6)
        first, last = np.searchsorted(time, [before - 1e-6, after - 1e-6])
        missed = moved[last] - moved[first] + size
        excess.append(float(np.linalg.norm(missed)))
        sigmas.append(float(np.abs(missed).max() / sigma))
    rate = np.linalg.norm(np.diff(moved, axis=0), axis=1) / np.diff(time)
    rate = np.maximum(rate - speed(time, error, is_jump), 0.0)
    rate[is_jump] = 0.0
    within = np.abs(error - moved) < 1.96 * correction.corrected.position_sigma
    return Rates(
        float(rate.max()),
        float(begin[rate.argmax()]),
        int(np.sum(rate > LIMIT)),
        max(excess),
        max(sigmas),
        left(correction, error),
        float(within.mean()),
    )


def speed(time, error, is_jump):
    """Speed (n - 1,) of the true error over two seconds on one side of jumps, m/s.

    MEMS units drift by half a meter per second at the end of an outage.
    """
    edges = np.concatenate([[0], np.flatnonzero(is_jump) + 1, [len(time)]])
    side = np.searchsorted(edges, np.arange(len(time) - 1), side="right")
    sooner = np.maximum(time[:-1] - 1.0, time[edges[side - 1]])
    later = np.minimum(time[:-1] + 1.0, time[edges[side] - 1])
    ends = [np.column_stack([np.interp(t, time, e) for e in error.T]) for t in (sooner, later)]
    apart = np.maximum(later - sooner, np.diff(time))
    return np.linalg.norm(ends[1] - ends[0], axis=1) / apart


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("series", nargs="?", help="of real POS errors, as OB_GINS writes (.err)")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--worst", type=int, default=10, help="drives that are listed one by one")
    arguments = parser.parse_args()
    found = {}
    for kind, name, *survey in surveys(arguments.series, arguments.seeds):
        found.setdefault(kind, []).append((name, rates(*survey)))
    titles = (
        "drives   largest m/s  drives beyond  epochs beyond  excess m  sigmas  RMS 3D m  within"
    )
    print(f"{'kind':24s} {titles}")
    for kind, rows in found.items():
        table = np.array([row for _, row in rows])
        rms = np.exp(np.log(table[:, 5]).mean())
        print(
            f"{kind:24s} {len(rows):6d} {table[:, 0].max():12.3f} {np.sum(table[:, 2] > 0):13d} "
            f"{table[:, 2].sum():13.0f} {table[:, 3].max():10.3f} "
            f"{table[:, 4].max():7.1f} {rms:9.4f} {table[:, 6].mean():7.1%}"
        )
    listed = [(rate, kind, name) for kind, rows in found.items() for name, rate in rows]
    beyond = sum(rate.beyond > 0 for rate, *_ in listed)
    print(f"{len(listed)} drives, {beyond} beyond {LIMIT} m/s; the fastest:")
    for rate, kind, name in sorted(listed, reverse=True)[: arguments.worst]:
        print(f"{kind:24s} {name:12s} {rate.largest:8.3f} m/s at {rate.at:.3f} s")


if __name__ == "__main__":
    main()
