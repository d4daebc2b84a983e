"""Honesty of the sigmas of points, and the cost of writing them.

    python benchmarks/point_sigma.py [--seeds 10]

Corrects the demo's drive with another seed each time, and compares the positions of points with the
true hits of the pulses. Prints for each drive the RMSE of the points and the RMS of error over
sigma, then the share of points within 1 and 2 sigmas, and the time of a copy with sigmas over that
of the plain corrected copy.
"""

import argparse
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np

import mlscorr
from mlscorr.io.clouds import CorrectedPart, write_parts
from mlscorr.simulate import DEMO, simulate

EVERY = 20  # points; neighbors have the same pose and hardly tell more
REPEATS = 3


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=10)
    print("drive      RMSE of points E/N/H (m)   error over sigma E/N/H    time, size")
    rows = np.array([drive(seed) for seed in range(parser.parse_args().seeds)])
    mean = rows.mean(axis=0)
    print(f"within 1 sigma {mean[0]:.1%}, 2 sigma {mean[1]:.1%} of all points and axes")
    print(
        f"median time {np.median(rows[:, 2]):.2f}, size {np.median(rows[:, 3]):.2f} of a plain copy"
    )


def drive(seed):
    """Shares within 1 and 2 sigmas, ratio of times and of sizes."""
    simulated = simulate(DEMO, np.random.default_rng(seed))
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        simulated.write(Path(folder))
        result = mlscorr.correct(mlscorr.read_survey(folder))
        ratios = costs(result, Path(folder))
    cloud = simulated.cloud[::EVERY]
    error = result.estimate.correction.apply(cloud).xyz - simulated.pulses.point[::EVERY]
    sigma = result.point_sigma().at(cloud.xyz, cloud.gps_time)
    known = np.isfinite(sigma).all(axis=1)
    ratio = error[known] / sigma[known]
    numbers = [*np.sqrt(np.mean(error[known] ** 2, axis=0)), *np.sqrt(np.mean(ratio**2, axis=0))]
    print(f"seed {seed:3d}", *(f"{v:8.3f}" for v in numbers), *(f"{v:8.2f}" for v in ratios))
    return [np.mean(np.abs(ratio) < 1), np.mean(np.abs(ratio) < 2), *ratios]


def costs(result, folder):
    """Time and size of a copy with sigmas over those of a plain one; the best of three times."""
    file = result.survey.clouds[0]
    correction = result.estimate.correction
    sigma = result.point_sigma()
    best = [np.inf, np.inf]
    size = [0, 0]
    for _ in range(REPEATS):
        for kind, its in enumerate((None, sigma)):
            target = folder / f"copy-{kind}.laz"
            start = time.perf_counter()
            write_parts([CorrectedPart(file, correction, its)], target)
            best[kind] = min(best[kind], time.perf_counter() - start)
            size[kind] = target.stat().st_size
    return best[1] / best[0], size[1] / size[0]


if __name__ == "__main__":
    main()
