"""Accuracy of corrections over many simulated drives, against their truth.

    python benchmarks/seeds.py [--seeds 20]

Each drive is the demo's with another seed: another street, drive, drift, scan and survey. The drift
comes from its physical causes, not from the estimator's covariance. Prints one line per drive, then
the median and the worst, and the share of the truth within the stated sigmas.
"""

import argparse
import tempfile
import warnings
from pathlib import Path

import numpy as np

import mlscorr
from mlscorr.simulate import DEMO, simulate


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=20)
    rows = [drive(seed) for seed in range(parser.parse_args().seeds)]
    for title, function in (("median", np.median), ("worst", np.max)):
        print(title, *(f"{value:8.3f}" for value in function([row[:9] for row in rows], axis=0)))
    within = np.mean([row[9:11] for row in rows], axis=0)
    print(f"truth within 1 sigma {within[0]:.1%}, 2 sigma {within[1]:.1%}")
    print(f"targets seen {sum(row[11] for row in rows)}, rejected {sum(row[12] for row in rows)}")


def drive(seed):
    """Check RMSE before and after, RMS of the trajectory after (E, N, H each), coverage, counts."""
    simulated = simulate(DEMO, np.random.default_rng(seed))
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        simulated.write(Path(folder))
        result = mlscorr.correct(mlscorr.read_survey(folder))
    error = result.trajectory.position - simulated.true_trajectory.position
    ratio = np.abs(error) / result.trajectory.position_sigma
    numbers = [
        *result.check["before"]["rmse"],
        *result.check["after"]["rmse"],
        *np.sqrt(np.mean(error**2, axis=0)),
    ]
    print(f"seed {seed:3d}", *(f"{value:8.3f}" for value in numbers), flush=True)
    seen = len(result.matched_control) + len(result.matched_check)
    rejected = len(result.estimate.outliers)
    return [*numbers, np.mean(ratio < 1), np.mean(ratio < 2), seen, rejected]


if __name__ == "__main__":
    print("m:       check before E/N/H         check after E/N/H          trajectory after E/N/H")
    main()
