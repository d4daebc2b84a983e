"""Gain from ties between passes through files: clouds there and back, targets and ties found.

python benchmarks/ties_files_study.py [--seeds 4] [--control 0 3 6 12] [--scanners 2] [--elsewhere]
    [--spinning] [--passes 1] [--road [--without-paint]]

RMS in 3D of the whole trajectory by control alone and with ties, the shares within 2 sigma, and the
difference that remains between both passes at one place, with its share within 2 sigma. Without
control the latter two are claimed, and of the error common to both passes only that it is as large
as the POS's sigmas and the ties imply: a survey has few independent values of it, so that its share
within 2 sigma is meaningful only over many surveys. Drives are the simulator's canyon by a MEMS
unit that has GNSS for 5 s at both ends of each pass of 150 s alone: its smoothed drift is 0.6 to 1
m. With --elsewhere each pass loses it once, for 70 to 120 s from a random moment. A second scanner
is turned to the other side. With --spinning it has 16 rings and an axis that leans back by 30 deg,
so that a pass sees a thing for seconds. With --road it sees the road alone, which has a dashed
middle line and lines along the curbs.
"""

import argparse
import tempfile
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
from feature_surveys import FOLDER

import mlscorr
from mlscorr.estimate import estimate_correction, prior_correction, tie_factor
from mlscorr.io.clouds import read_chunks
from mlscorr.pipeline.finding import find_control
from mlscorr.simulate import read_scenario, simulate
from mlscorr.surfaces import FeatureCollector
from mlscorr.survey import PAINTED, Ties, Trajectory
from mlscorr.ties import tie_passes

POINTS_PER_LINE = 400  # of 700: a survey takes two minutes
DURATION = 150.0  # s of each pass
GNSS = 5.0  # s, at both ends of a pass
OUTAGE = 70.0, 120.0  # s: shortest and longest of a pass, where passes lose GNSS by themselves
DOWNWARD = (-150.0, -30.0)  # deg, scan angles that meet the road or what stands less than 2 m high
SPINNING = {
    "kind": "spinning",
    "rings": tuple(np.linspace(-15.0, 15.0, 16)),  # deg: of the usual small ones
    "lines_per_second": 10.0,
    "points_per_line": 400,
    "boresight": (-30.0, 0.0, 0.0),
}
NEAREST = 5.0  # m between two passes that are compared in a place
PLACES = 50  # of each survey: the difference of both passes' errors and its sigma change slowly
PROBE = 1.0  # m, one sigma of the rows that ask for that sigma: they hold nothing


def scenario(scanners=1, duration=DURATION, rng=None, road=False, spinning=False, passes=2):
    """The canyon as recorded by a MEMS unit, with GNSS only at the ends of the passes.

    With a generator of random numbers, without it once in each pass; or its painted road alone.
    """
    canyon = read_scenario(FOLDER / "canyon.toml")
    outages = []
    for start in (0.0, duration + canyon.drive.passes[1].pause)[:passes]:
        if rng is None:
            length = duration - 2 * GNSS
        else:
            length = rng.uniform(*OUTAGE)
        latest = duration - GNSS - length
        begin = GNSS if rng is None else rng.uniform(GNSS, latest)
        outages.append((start + begin, length))
    pos = {"grade": "mems", "sky_view": False, "outages": tuple(outages)}
    seen = {"points_per_line": POINTS_PER_LINE}
    if road:  # as many points as a scanner has that sees paint
        seen = {"points_per_line": 4 * POINTS_PER_LINE, "field_of_view": DOWNWARD}
    first = canyon.scanner[0].model_copy(update=SPINNING if spinning else seen)
    turn = np.array([1.0, 1.0, -1.0])
    second = first.model_copy(update={"boresight": tuple(turn * first.boresight)})
    return canyon.model_copy(
        update={
            "scene": canyon.scene.model_copy(update={"markings": road}),
            "pos": canyon.pos.model_copy(update=pos),
            "drive": canyon.drive.model_copy(
                update={
                    "duration": duration,
                    "stops": (),
                    "passes": canyon.drive.passes[:passes],
                }
            ),
            "scanner": (first, second)[:scanners],
            "targets": canyon.targets.model_copy(update={"control": 16, "check": 4}),
        }
    )


def read(survey):
    """Control points found in the clouds, and planes and poles, each read once."""
    collector = FeatureCollector(survey)

    def chunks(file):
        for chunk in read_chunks(file):
            collector.add(file, chunk)
            yield chunk

    control = find_control(survey, None, None, chunks).control
    return control, collector.features()


def some_control(matched, number):
    """Observations of evenly chosen control points along the street."""
    names, rows = np.unique(matched.name, return_index=True)
    place = matched.surveyed.position[rows]
    along = np.linalg.svd(place - place.mean(axis=0))[2][0]  # their longest direction
    order = np.argsort(place @ along)
    kept = np.unique(np.linspace(0, len(order) - 1, number).round().astype(int))
    return matched[np.isin(matched.name, names[order[kept]])]


def measure(true, estimate):
    """RMS (m) of the residual error and its share within 2 sigma, and both between the passes."""
    corrected = estimate.correction.corrected
    left = true.at(corrected.gps_time).position - corrected.position
    within = np.mean(np.abs(left) < 2 * corrected.position_sigma)
    if len(true.passes) < 2:
        return rms(left), float(within), np.nan, np.nan
    there, back = _meetings(true, corrected.gps_time)
    apart = left[there] - left[back]
    if estimate.adjustment.ties is None:
        return rms(left), float(within), rms(apart), np.nan
    rows = np.unique(np.linspace(0, len(there) - 1, PLACES).round().astype(int))
    sigma = _sigma_apart(estimate, there[rows], back[rows])
    return rms(left), float(within), rms(apart), float(np.mean(np.abs(apart[rows]) < 2 * sigma))


def _meetings(true, gps_time):
    """Epochs of the first pass, and those of the second at the same places."""
    (first, last), (begin, end) = true.passes[:2]
    place = true.at(gps_time).position
    there, back = (
        np.flatnonzero((gps_time >= a) & (gps_time <= b))[::20]
        for a, b in ((first, last), (begin, end))
    )
    away = np.linalg.norm(place[there][:, None] - place[back], axis=2)
    near = away.min(axis=1) < NEAREST
    return there[near], back[away.argmin(axis=1)][near]


def _sigma_apart(estimate, there, back):
    """Sigma (k, 3) of the difference of the errors at two epochs of the trajectory. Units: m.

    By the most probable parameters, like that of unobserved ties.
    """
    adjustment = estimate.adjustment
    trajectory = adjustment.trajectory
    number = 3 * len(there)
    rows = np.repeat(np.column_stack([there, back]), 3, axis=0)
    probes = Ties(
        gps_time=trajectory.gps_time[rows],
        place=trajectory.position[rows],
        direction=np.tile(np.eye(3), (len(there), 1)),
        misclosure=np.zeros(number),
        variance=np.full(number, PROBE**2),
        kind=np.full(number, "plane"),
        pass_number=np.tile([1, 2], (number, 1)),
        scanner=np.zeros((number, 2), int),
        feature=np.arange(2 * number).reshape(-1, 2),
    )
    factor = replace(tie_factor(adjustment.errors, probes), kind="probe")
    asked = adjustment.with_factor(factor)
    solved = asked.solve(estimate.parameters)
    _, covariance = solved.leave_out(asked.rows_of("probe"))
    return np.sqrt(np.maximum(np.diag(covariance) - PROBE**2, 0.0)).reshape(-1, 3)


def rms(left):
    """Root mean square (m) of the lengths of vectors (n, 3)."""
    return float(np.sqrt(np.mean(np.sum(left**2, axis=1))))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--scanners", type=int, choices=(1, 2), default=1)
    parser.add_argument("--spinning", action="store_true", help="a scanner of 16 rings")
    parser.add_argument("--passes", type=int, choices=(1, 2), default=2)
    parser.add_argument("--elsewhere", action="store_true", help="outages by pass")
    parser.add_argument("--road", action="store_true", help="nothing but a painted road")
    parser.add_argument("--without-paint", action="store_true", help="ties of planes and poles")
    parser.add_argument("--control", type=int, nargs="+", default=[0, 3, 6, 12])
    arguments = parser.parse_args()
    print("control  seed     raw   alone  within    ties  within   apart  within   ratio")
    ratios = {number: [] for number in arguments.control}
    for seed in range(arguments.first, arguments.first + arguments.seeds):
        if arguments.elsewhere:
            rng = np.random.default_rng([seed, 1])
        else:
            rng = None
        drive = scenario(
            arguments.scanners,
            rng=rng,
            road=arguments.road,
            spinning=arguments.spinning,
            passes=arguments.passes,
        )
        with tempfile.TemporaryDirectory() as folder:
            simulated = simulate(drive, np.random.default_rng(seed))
            simulated.write(Path(folder) / "survey")
            true = Trajectory.concatenate(simulated.true_passes)
            with warnings.catch_warnings(action="ignore"):
                survey = mlscorr.read_survey(Path(folder) / "survey")
                found, features = read(survey)
            if arguments.without_paint:
                features = features[~np.isin(features.kind, PAINTED)]
        recorded = survey.trajectory
        raw = rms(true.at(recorded.gps_time).position - recorded.position)
        for number in arguments.control:
            if number:
                control = some_control(found, number)
                start = estimate_correction(recorded, control, survey.pos)
                alone = measure(true, start)
            else:
                start = prior_correction(recorded, survey.pos)
                alone = (np.nan, np.nan)
            tied = measure(true, tie_passes(survey, start, features))
            ratios[number].append(tied[0] / alone[0])
            print(
                f"{number:7d}{seed:6d}{raw:8.3f}{alone[0]:8.3f}{alone[1]:8.0%}"
                f"{tied[0]:8.3f}{tied[1]:8.0%}{tied[2]:8.4f}{tied[3]:8.0%}"
                f"{ratios[number][-1]:8.2f}",
                flush=True,
            )
    for number, values in ratios.items():
        if number:
            print(f"{number:7d} median {np.median(values):.2f}, largest {max(values):.2f}")


if __name__ == "__main__":
    main()
