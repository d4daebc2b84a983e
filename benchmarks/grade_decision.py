"""Grade the decision of a diagnosis on the evidence of synthetic surveys of features.

    OMP_NUM_THREADS=1 python benchmarks/grade_decision.py FOLDER --first 5000 --worlds 10 --cases 24

Its worlds differ from those of the training, and its mechanisms are those of the grading half. The
evidence of each world is kept in FOLDER.
"""

import numpy as np
from gap_training.records import collect
from gap_training.report import print_figures, study_arguments

from mlscorr.blind import outside_mechanisms
from mlscorr.gap.evidence.decision import learned


def main() -> None:
    """Collect records, and print figures."""
    given = study_arguments(__doc__, 5000, 10).parse_args()
    seeds = range(given.first, given.first + given.worlds)
    records = collect(given.folder, seeds, given.cases, outside_mechanisms(), given.replicas)
    print_figures(records, [learned().probabilities(each.joint) for each in records])
    p = [learned().calibrated(r.p_value) for r in records if r.p_value is not None]
    if p:
        low = np.mean(np.array(p) < 0.05)
        print(
            f"p-values of {len(p)} clean surveys: {low:.3f} below 0.05, median {np.median(p):.2f}"
        )


if __name__ == "__main__":
    main()
