"""Centre errors, recall and honesty of covariances of simulated targets, by kind and points.

python benchmarks/target_study.py [views per row [looks, with commas [first seed]]]
"""

import sys
import time
from itertools import pairwise
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from target_rays import SCANNER, TARGETS, view

from mlscorr.targets.fit import fit_targets

CONDITIONS = {  # incidence (deg), share hidden
    "easy": (30.0, 0.0),
    "oblique": (70.0, 0.0),
    "hidden": (60.0, 0.4),
}
COUNTS = (25, 60, 200, 100_000)  # edges of the classes by number of points on the target
WITHIN_95 = 7.815  # chi-squared of 3 axes


def look_at(look, size, condition, seed, known=True):
    """(points on the target, error (3,), normalised square, false targets, score)."""
    rng = np.random.default_rng([seed, len(look), int(1000 * size)])
    seen = view(look, size, rng, *CONDITIONS[condition])
    shape = TARGETS[look][0], size if known else None
    found = fit_targets(seen.cloud, seen.sight, [shape], SCANNER, rng)
    off = [np.linalg.norm(target.position - seen.centre) for target in found]
    false = sum(distance > size / 2 for distance in off)
    if len(found) == 0 or min(off) > size / 2:
        return seen.on_target, None, np.nan, false, np.nan
    best = found[int(np.argmin(off))]
    error = best.position - seen.centre
    return seen.on_target, error, error @ np.linalg.solve(best.covariance, error), false, best.score


def row(label, results):
    """One line of the table, of results that have enough points to be asked for."""
    results = [result for result in results if result[0] >= COUNTS[0]]
    found = [result for result in results if result[1] is not None]
    if not found:
        print(f"{label:44s} {len(results):4d} none found")
        return
    error = 1e3 * np.array([np.linalg.norm(result[1]) for result in found])
    square = np.array([result[2] for result in found])
    rich = [result[1] is not None for result in results if result[0] >= 60]
    share = 100 * np.mean(rich) if rich else np.nan
    print(
        f"{label:44s} {len(results):4d} {100 * len(found) / len(results):6.1f} {share:6.1f} "
        f"{np.median(error):7.2f} {np.percentile(error, 95):7.2f} {error.max():7.1f} "
        f"{square.mean() / 3:6.2f} {100 * np.mean(square < WITHIN_95):6.1f} "
        f"{sum(result[3] for result in results):5d}"
    )


def study(number, looks=TARGETS, first=0, sizes=(0.6, 0.3)):
    print(
        f"{'look, size, condition':44s}    n found% of>=60 med(mm)   95 %     max chi2/3 "
        "in95% false"
    )
    for look in looks:
        everything = []
        started = time.perf_counter()
        for size in sizes:
            for condition in CONDITIONS:
                seeds = range(first, first + number)
                results = [look_at(look, size, condition, seed) for seed in seeds]
                row(f"{look} {size} m {condition}", results)
                everything += results
        for low, high in pairwise(COUNTS):
            row(f"  {look}, {low} to {high} points", [r for r in everything if low <= r[0] < high])
        spent = (time.perf_counter() - started) / len(everything)
        print(f"  {1e3 * spent:.0f} ms a view, with its simulation")


if __name__ == "__main__":
    looks = sys.argv[2].split(",") if len(sys.argv) > 2 else TARGETS
    first = int(sys.argv[3]) if len(sys.argv) > 3 else 0
    study(int(sys.argv[1]) if len(sys.argv) > 1 else 200, looks, first)
