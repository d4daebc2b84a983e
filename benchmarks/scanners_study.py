"""Calibration of two scanners of a vehicle together compared with each alone, from clouds.

python benchmarks/scanners_study.py [--seeds 12] [--first 1] [--control 8]

RMS errors (mm, mdeg) of both mountings and of the second relative to the first, the median of their
sigmas, and the share within two; distance between both images of a wall seen on one pass, by these
errors and as stated by ``fit_sigma``; processor time of both. The scanners face left and right
symmetrically, and the errors of their recorded mountings are drawn uniformly up to 3 cm and 0.5
deg.
"""

import argparse
import tempfile
import time
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np

import mlscorr
from mlscorr.estimate import corrected_mounting
from mlscorr.simulate import Scenario, simulate

# s of each of two opposite passes, m/s
DURATION = 25.0
SPEED = 6.0
LINE = {"lines_per_second": 50, "points_per_line": 300}
LARGEST = np.repeat([0.03, np.radians(0.5)], 3)  # m, rad
UNITS = np.repeat([1e3, np.degrees(1e3)], 3)  # mm, mdeg
RADIUS = 1.5  # m of the search for targets, for speed


def write(folder, seed, control):
    """Write a survey folder of two scanners, and return the errors of both mountings (2, 6)."""
    scenario = Scenario(
        drive={"duration": DURATION, "speed": SPEED, "passes": [{}, {"direction": "back"}]},
        targets={"control": control, "check": 2, "hidden": 0.0},
        scanner=[
            {"lever_arm": [side, -0.6, 0.4], "boresight": [90.0, 0.0, turn], **LINE}
            for side, turn in ((-0.3, 35.0), (0.3, -35.0))
        ],
        pos={"grade": "tactical"},
    )
    simulated = simulate(scenario, np.random.default_rng(seed))
    lacks = np.random.default_rng([seed, 7]).uniform(-LARGEST, LARGEST, (2, 6))
    recorded = map(corrected_mounting, simulated.mountings, -lacks)
    replace(simulated, mountings=tuple(recorded)).write(folder)
    with (folder / "survey.toml").open("a") as described:
        described.write(f"[matching]\nsearch_radius = {RADIUS}\n")
    return lacks


def walls(calibration):
    """Mean square (12, 12) of the effect of both errors on walls that both saw on one pass."""
    ties = calibration.ties.ties[calibration.ties.used]
    segment = calibration.trajectory.segment(ties.gps_time.ravel()).reshape(-1, 2)
    is_both = (np.diff(ties.scanner, axis=1) != 0).ravel() & (segment[:, 0] == segment[:, 1])
    rows = calibration.adjustment.ties.columns[is_both, 0]
    return rows.T @ rows / len(rows)


def study(seed, control):
    """Errors and sigmas (3, 6) of both and of the difference, walls (m), seconds: by method."""
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings(action="ignore"):
        lacks = write(Path(folder) / "survey", seed, control)
        survey = mlscorr.read_survey(Path(folder) / "survey")
        start = time.process_time()
        both = mlscorr.calibrate(survey).calibration
        between = time.process_time()
        parts = [mlscorr.calibrate(part).calibration for part in survey.by_scanner.values()]
        end = time.process_time()
    alone = np.array([part.lsc.sigma for part in parts])
    sigma = {
        "together": [*both.lsc.sigma.reshape(2, 6), both.lsc.relative_to_first(1)[1]],
        "alone": [*alone, np.sqrt(np.sum(alone**2, axis=0))],
    }
    estimates = {
        "together": both.lsc.correction.reshape(2, 6),
        "alone": np.array([part.lsc.correction for part in parts]),
    }
    seconds = {"together": between - start, "alone": end - between}
    square = walls(both)
    results = {}
    for method, estimate in estimates.items():
        error = estimate - lacks
        wall = np.sqrt(error.ravel() @ square @ error.ravel())
        rows = np.vstack([error, error[1] - error[0]])
        results[method] = rows, np.array(sigma[method]), wall, seconds[method]
    return results, both.fit_sigma(1)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=12)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--control", type=int, default=8)
    arguments = parser.parse_args()
    seeds = range(arguments.first, arguments.first + arguments.seeds)
    results = [study(seed, arguments.control) for seed in seeds]
    for method in ("alone", "together"):
        columns = zip(*(result[method] for result, _ in results), strict=True)
        error, sigma, wall, seconds = map(np.array, columns)
        print(f"{method}: {np.median(seconds):.1f} s; walls {1e3 * rms(wall):.2f} mm apart")
        for row, name in enumerate(("first", "second", "difference")):
            within = np.mean(np.abs(error[:, row]) < 2 * sigma[:, row])
            print(f"  {name:11s}rms  ", *(f"{v:7.1f}" for v in UNITS * rms(error[:, row])))
            middle = UNITS * np.median(sigma[:, row], axis=0)
            print(f"{'':13s}sigma", *(f"{v:7.1f}" for v in middle), f"  within 2: {within:.0%}")
    stated = 1e3 * np.median([fit for _, fit in results])
    print(f"fit_sigma {stated:.2f} mm (median)")


def rms(values):
    """Root mean square over seeds."""
    return np.sqrt(np.mean(np.square(values), axis=0))


if __name__ == "__main__":
    main()
