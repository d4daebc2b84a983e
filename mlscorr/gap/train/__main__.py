"""Learn how evidence becomes probability: decision.json of the inference.

    OMP_NUM_THREADS=1 python -m mlscorr.gap.train FOLDER --first 1000 --worlds 40 --cases 24

What is weighed in each world is kept in FOLDER, so that a second run fits within seconds.
"""

import argparse
import json
from pathlib import Path

import mlscorr.gap.infer
from mlscorr.gap.infer.decision import OPERATING_POINTS
from mlscorr.gap.train.cases import known_mechanisms
from mlscorr.gap.train.fit import code_hash, document, figures, fit, hash_of, out_of_fold
from mlscorr.gap.train.records import collect
from mlscorr.gap.train.report import print_figures


def main() -> None:
    """Collect, fit, write, and print figures of worlds that the fit had not seen."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="Where records are kept.")
    parser.add_argument("--first", type=int, default=1000, help="Seed of the first world.")
    parser.add_argument("--worlds", type=int, default=40)
    parser.add_argument("--cases", type=int, default=24, help="In each world.")
    parser.add_argument("--replicas", type=int, default=50, help="Of clean surveys.")
    parser.add_argument("--mechanisms", type=Path, help="Further mechanisms, beside the grammar's.")
    parser.add_argument("--write", action="store_true", help="Into the package: decision.json.")
    given = parser.parse_args()
    mechanisms = known_mechanisms(given.mechanisms)
    seeds = range(given.first, given.first + given.worlds)
    records = collect(given.folder, seeds, given.cases, mechanisms, given.replicas)
    probabilities = out_of_fold(records)
    print_figures({
        title: figures(records, probabilities, costs) for title, costs in OPERATING_POINTS.items()
    })  # fmt: skip
    if given.write:
        made_of = {
            "seeds": [seeds[0], seeds[-1]], "cases": given.cases, "records": len(records),
            "mechanisms": hash_of(sorted(mechanisms)), "code": code_hash(),
        }  # fmt: skip
        path = Path(str(mlscorr.gap.infer.__file__)).with_name("decision.json")
        path.write_text(json.dumps(document(fit(records), made_of), indent=1) + "\n")
        print(f"Written: {path}")


if __name__ == "__main__":
    main()
