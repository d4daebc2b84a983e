"""Is the collocation ever worse than interpolation between control points?

python benchmarks/pos_study.py [FILE of real POS errors (.err)] [--seeds 2] [--every 1]

RMS in 3D of the whole trajectory over many drives: windows of a real error series with and without
its sigma(t); clones of the paper's car and boat; MEMS and tactical units, filtered and smoothed,
with their stated sigmas, without any, and with sigmas ten times too small and too large; a POS
whose GNSS loses its fixed solution now and again; and one that drifts for seconds, three to eight
times in a window, and states 2 cm all along. Beside it what practitioners use on the same
control points: linear and monotone interpolation, the former cut at the steps of the path, and a
Gaussian process of scikit-learn. With --every 4 each fourth control point along the drive takes
part, with its passes.
"""

import argparse
import warnings
from dataclasses import replace

import numpy as np
from feature_surveys import feature_survey, scenarios
from real_windows import WINDOW, cases, window
from scipy.signal import lfilter

from mlscorr.baselines import fit_gaussian_process, fit_linear, fit_pchip
from mlscorr.estimate import estimate_correction
from mlscorr.survey import Pos

PEERS = {
    "linear": fit_linear,
    "pchip": fit_pchip,
    "linear-steps": lambda trajectory, matched: fit_linear(trajectory, matched, cut=True),
    "gp": fit_gaussian_process,
}
UNSTATED = Pos(position_sigma=0.5)  # m, a constant that says nothing of the drift
# m, m, s: fixed, not fixed, and how long its errors last
HELD = 0.02
FLOAT = 0.4
MEMORY = 60.0
WORSE = 1.1  # times the best peer: beyond it a survey counts as worse


def surveys(series, seeds):
    """Rows of name, recorded trajectory, matched control, true - recorded position, beliefs."""
    if series is not None:
        for name, trajectory, matched, error in cases(series):
            yield f"real {name}", trajectory, matched, error, None
            hidden = replace(trajectory, position_sigma=None)
            yield f"real {name} no sigma", hidden, matched, error, UNSTATED
    for name, scenario in drives().items():
        for seed in range(seeds):
            survey = feature_survey(scenario, seed)
            error = survey.true.position - survey.recorded.position
            for title, factor in (("", 1.0), (" no sigma", None), (" / 10", 0.1), (" x 10", 10.0)):
                if factor not in (1.0, None) and "filtered" not in name:
                    continue
                if factor is None:
                    sigma = None
                else:
                    sigma = factor * survey.recorded.position_sigma
                recorded = replace(survey.recorded, position_sigma=sigma)
                pos = UNSTATED if factor is None else None
                yield f"{name}{title}", recorded, survey.matched, error, pos
    for seed in range(seeds):
        yield "not fixed at times", *unfixed(seed), None
        yield "drifting for seconds", *bumped(seed), None


def unfixed(seed):
    """Recorded trajectory, matched control and error of a drive that GNSS fixes in turns."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, WINDOW, 0.1)
    turns = np.cumsum(rng.uniform(10.0, 60.0, 30))  # s
    size = np.where(np.searchsorted(turns, time) % 2, FLOAT, HELD)[:, None] * [1.0, 1.0, 1.5]
    kept = np.exp(-0.1 / MEMORY)
    series = lfilter([np.sqrt(1 - kept**2)], [1, -kept], rng.normal(size=(6, len(time) + 6000)))
    fixed, floated = series[:, -len(time) :].T.reshape(-1, 2, 3).swapaxes(0, 1)
    error = size * np.where(size > size.min(axis=0), floated, fixed)
    return window(345_600.0 + time, error, size, seed)


def bumped(seed):
    """Recorded trajectory, matched control and error of a drive whose POS drifts unstated."""
    rng = np.random.default_rng([seed, 1])
    time = np.arange(0.0, WINDOW, 0.1)
    error = HELD / 2 * rng.normal(size=3) + np.zeros((len(time), 3))
    for _ in range(rng.integers(3, 9)):
        # s
        begin = rng.uniform(0.0, WINDOW - 30.0)
        length = rng.uniform(10.0, 30.0)
        share = np.clip((time - begin) / length, 0.0, 1.0)[:, None]
        error += FLOAT * rng.normal(size=3) * np.sin(np.pi * share) ** 2
    return window(345_600.0 + time, error, np.full_like(error, HELD), seed)


def drives():
    """Scenarios by name."""
    known = scenarios()
    made = {name: known[name] for name in ("car", "boat")}
    for grade in ("mems", "tactical"):
        for processing in ("filtered", "smoothed"):
            pos = known[grade].pos.model_copy(update={"processing": processing})
            made[f"{grade} {processing}"] = known[grade].model_copy(update={"pos": pos})
    return made


def left(correction, error):
    """RMS in 3D (m) of what a correction leaves of the position error (n, 3)."""
    moved = correction.corrected.position - correction.recorded.position
    return float(np.sqrt(np.mean(np.sum((error - moved) ** 2, axis=1))))


def row(trajectory, matched, error, pos):
    """Raw RMS, that of each peer, that of mlscorr, and the share within 1.96 sigma."""
    peers = [left(fit(trajectory, matched), error) for fit in PEERS.values()]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        correction = estimate_correction(trajectory, matched, pos).correction
    moved = correction.corrected.position - trajectory.position
    within = np.mean(np.abs(error - moved) < 1.96 * correction.corrected.position_sigma)
    raw = float(np.sqrt(np.mean(np.sum(error**2, axis=1))))
    return [raw, *peers, left(correction, error), float(within)]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("series", nargs="?", help="of real POS errors, as OB_GINS writes (.err)")
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--every", type=int, default=1, help="only each n-th control point")
    arguments = parser.parse_args()
    titles = ["raw", *PEERS, "mlscorr"]
    print(f"{'survey':34s}" + "".join(f"{title:>13s}" for title in titles) + "   within")
    rows = []
    for name, trajectory, matched, *truth in surveys(arguments.series, arguments.seeds):
        kept = list(dict.fromkeys(matched.name))[:: arguments.every]
        rows.append(row(trajectory, matched[np.isin(matched.name, kept)], *truth))
        numbers = "".join(f"{value:13.3f}" for value in rows[-1][:-1])
        best = min(rows[-1][1:-2])
        mark = "  worse" if rows[-1][-2] > WORSE * best else ""
        print(f"{name:34s}{numbers}{rows[-1][-1]:9.0%}{mark}", flush=True)
    table = np.array(rows)
    ratio = table[:, 1:-2].min(axis=1) / table[:, -2]
    means = np.exp(np.log(table[:, :-1]).mean(axis=0))
    print(f"{'geometric mean':34s}" + "".join(f"{value:13.3f}" for value in means))
    print(
        f"{len(rows)} surveys: the best peer leaves {np.median(ratio):.2f} times as much in the "
        f"median; mlscorr leaves more than {WORSE} times as much in "
        f"{np.sum(ratio < 1 / WORSE)} of them, at worst {1 / ratio.min():.2f} times; "
        f"{table[:, -1].mean():.1%} within 1.96 sigma"
    )


if __name__ == "__main__":
    main()
