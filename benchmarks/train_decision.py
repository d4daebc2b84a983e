"""Train the mapping from evidence to probability: decision.json of the inference.

    OMP_NUM_THREADS=1 python benchmarks/train_decision.py FOLDER --first 1000 --worlds 40 --cases 24

The evidence of each world is kept in FOLDER, so that a second run fits within seconds.
"""

import json
from pathlib import Path

from gap_training.cases import known_mechanisms
from gap_training.fit import document, fit, hash_of, out_of_fold
from gap_training.records import collect, first_evidence
from gap_training.report import print_figures, study_arguments

import mlscorr.gap.evidence


def main() -> None:
    """Collect records, fit, write, and print figures of worlds outside the training set."""
    parser = study_arguments(__doc__, 1000, 40)
    parser.add_argument("--mechanisms", type=Path, help="Further mechanisms, beside the grammar's.")
    parser.add_argument("--write", action="store_true", help="Into the package: decision.json.")
    given = parser.parse_args()
    mechanisms = known_mechanisms(given.mechanisms)
    seeds = range(given.first, given.first + given.worlds)
    records = collect(given.folder, seeds, given.cases, mechanisms, given.replicas)
    probabilities = out_of_fold(records)
    print_figures(records, probabilities)
    if given.write:
        made_of = {
            "seeds": [seeds[0], seeds[-1]],
            "cases": given.cases,
            "records": len(records),
            "mechanisms": hash_of(sorted(mechanisms)),
            "evidence": first_evidence(seeds[0], mechanisms),
        }
        path = Path(str(mlscorr.gap.evidence.__file__)).with_name("decision.json")
        path.write_text(json.dumps(document(fit(records), made_of), indent=1) + "\n")
        print(f"Written: {path}")


if __name__ == "__main__":
    main()
