"""Grade the decision of a diagnosis on evidence of made-up surveys of features.

    OMP_NUM_THREADS=1 python -m mlscorr.blind FOLDER --first 5000 --worlds 10 --cases 24

Worlds are others than those it was learned on, and mechanisms those of the half that grades. What
is weighed in each world is kept in FOLDER.
"""

import argparse
from collections.abc import Callable
from pathlib import Path

import numpy as np

from mlscorr.blind.grading import grading_mechanisms
from mlscorr.gap.infer.decision import OPERATING_POINTS, learned
from mlscorr.gap.train.fit import figures
from mlscorr.gap.train.records import collect
from mlscorr.gap.train.report import print_figures


def main() -> None:
    """Collect, and print figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="Where records are kept.")
    parser.add_argument("--first", type=int, default=5000, help="Seed of the first world.")
    parser.add_argument("--worlds", type=int, default=10)
    parser.add_argument("--cases", type=int, default=24, help="In each world.")
    parser.add_argument("--replicas", type=int, default=50, help="Of clean surveys.")
    given = parser.parse_args()
    seeds = range(given.first, given.first + given.worlds)
    mechanisms: dict[str, Callable] = {each.name: each for each in grading_mechanisms()}
    records = collect(given.folder, seeds, given.cases, mechanisms, given.replicas)
    probabilities = [learned().probabilities(each.joint) for each in records]
    print_figures({
        title: figures(records, probabilities, costs) for title, costs in OPERATING_POINTS.items()
    })  # fmt: skip
    p = [learned().calibrated(r.p_value) for r in records if r.p_value is not None]
    if p:
        low = np.mean(np.array(p) < 0.05)
        print(
            f"p-values of {len(p)} clean surveys: {low:.3f} below 0.05, median {np.median(p):.2f}"
        )


if __name__ == "__main__":
    main()
