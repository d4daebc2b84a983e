"""Center errors, recall and honesty of covariances of simulated targets, by kind and points.

python benchmarks/target_study.py [views per row [looks, with commas [first seed]]]
"""

import argparse
import tempfile
import time
from dataclasses import replace
from functools import cache
from itertools import pairwise, product

import numpy as np
from target_rays import SCANNER, TARGETS, view

import mlscorr
from mlscorr.io.tables.control import NO_POINTS
from mlscorr.simulate import Scenario, simulate
from mlscorr.targets import fit_targets

CONDITIONS = {  # incidence (deg), share hidden
    "easy": (30.0, 0.0),
    "oblique": (70.0, 0.0),
    "hidden": (60.0, 0.4),
}
COUNTS = (25, 60, 200, 100_000)  # edges of the classes by number of points on the target
WITHIN_95 = 7.815  # chi-squared of 3 axes


def look_at(look, size, condition, seed, known=True):
    """Points on the target, error (3,), normalized square, false targets and score of a view."""
    rng = np.random.default_rng([seed, len(look), int(1000 * size)])
    seen = view(look, size, rng, *CONDITIONS[condition])
    shape = TARGETS[look][0], size if known else None
    found = fit_targets(seen.cloud, seen.path, [shape], SCANNER, rng)
    off = [np.linalg.norm(target.position - seen.centre) for target in found]
    false = sum(distance > size / 2 for distance in off)
    if len(found) == 0 or min(off) > size / 2:
        return seen.on_target, None, np.nan, false, np.nan
    best = found[int(np.argmin(off))]
    error = best.position - seen.centre
    return seen.on_target, error, error @ np.linalg.solve(best.covariance, error), false, best.score


def figures(seeds=(50,)):
    """Figures of a small study: a view of each row, with the size known and unknown, and a street.

    Recall counts targets of 25 points and more; of the street, objects that the search finds
    without control, and the targets that are found near control.
    """
    known = product(TARGETS, (0.6, 0.3), CONDITIONS, seeds, (True,))
    unknown = product(
        ("disc", "plate", "hole", "checkerboard"), (0.6,), CONDITIONS, seeds, (False,)
    )
    content = {}
    for label, rows in (("", known), ("unknown size, ", unknown)):
        results = [look_at(*row) for row in rows]
        results = [result for result in results if result[0] >= COUNTS[0]]
        best = [result for result in results if result[1] is not None]
        error = 1e3 * np.array([np.linalg.norm(result[1]) for result in best])
        content |= {
            f"{label}recall": len(best) / len(results),
            f"{label}median mm": np.median(error),
            f"{label}95 % mm": np.percentile(error, 95),
            f"{label}chi2/3": np.mean([result[2] for result in best]) / 3,
            f"{label}false": sum(result[3] for result in results),
            f"{label}score": np.mean([result[4] for result in best]),
        }
    survey = street()
    content |= street_figures("street, ", survey, survey)
    blind = replace(survey, control=NO_POINTS, check=NO_POINTS)
    return content | street_figures("street without control, ", survey, blind)


@cache
def street():
    """A simulated survey of 12 s with 8 targets."""
    scenario = Scenario(
        drive={"duration": 12.0},
        targets={"control": 6, "check": 2},
        scanner=[{"lines_per_second": 75, "points_per_line": 800}],
    )
    folder = tempfile.mkdtemp()
    simulate(scenario, np.random.default_rng(2)).write(folder)
    return mlscorr.read_survey(folder)


def street_figures(label, survey, searched):
    """Number of a street's targets that are found, and of other objects."""
    rows = mlscorr.extract(searched).targets
    place = np.array([row["observed"] for row in rows]).reshape(-1, 3)
    near = np.linalg.norm(place[None] - survey.surveyed.position[:, None], axis=2) < 0.3  # m
    others = ~near.any(axis=0)
    return {
        f"{label}targets": near.any(axis=1).sum(),
        f"{label}others": others.sum(),
        f"{label}score": np.mean([row["score"] for row in rows if row["score"] > 0]),
    }


def row(label, results):
    """One line of the table, of results with enough points on the target."""
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
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("views", nargs="?", type=int, default=200, help="per row")
    parser.add_argument("looks", nargs="?", default=",".join(TARGETS), help="with commas")
    parser.add_argument("seed", nargs="?", type=int, default=0, help="the first")
    given = parser.parse_args()
    study(given.views, given.looks.split(","), given.seed)
