"""Compare all methods of correction on one survey, and draw the table.

    python benchmarks/pictures/compare_methods.py [SURVEY] [--out FOLDER] [--picture FILE.png]

SURVEY is a survey.toml or its folder. Without it the semi-real drive through Wuhan is taken from
the shared surveys (MLSCORR_SHARED, or ../shared), else a small survey is simulated.
"""

import argparse
import os
import sys
import tempfile
from pathlib import Path

import numpy as np
from matplotlib import rc_context

import mlscorr
from mlscorr.report import comparison_figure
from mlscorr.report.style import STYLE

ROOT = Path(__file__).parents[2]
SHARED = Path(os.environ.get("MLSCORR_SHARED") or ROOT.parent / "shared")
DRIVE = SHARED / "surveys" / "wuhan_drive"


def main():
    arguments = parse()
    with tempfile.TemporaryDirectory() as scratch:
        path = arguments.survey or (DRIVE if DRIVE.exists() else simulated(Path(scratch)))

        # The whole task takes two lines.
        compared = mlscorr.compare(mlscorr.read_survey(path))
        report = compared.write(arguments.out or Path(scratch) / "compared")

    for row in report["methods"]:
        score = row[report["scored_by"]]
        if score["rmse"] is None:
            continue  # the statements say why
        print(f"{row['name']:15s} RMSE E/N/H {np.round(score['rmse'], 3)} m")
    print(*(fact["sentence"] for fact in report["statements"]), sep="\n")
    with rc_context(STYLE):
        comparison_figure(report).savefig(arguments.picture, dpi=150)
    print(f"Picture: {arguments.picture}")


def parse():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("survey", nargs="?", type=Path)
    parser.add_argument("--out", type=Path, help="keep compare.html and compare.json here")
    parser.add_argument(
        "--picture", type=Path, default=ROOT / "build" / "pictures" / "compare_methods.png"
    )
    arguments = parser.parse_args()
    arguments.picture.parent.mkdir(parents=True, exist_ok=True)
    return arguments


def simulated(folder):
    """A small simulated survey, the same each time."""
    from mlscorr.simulate import DEMO, simulate

    simulate(DEMO, np.random.default_rng(1)).write(folder / "survey")
    return folder / "survey"


if __name__ == "__main__":
    try:
        main()
    except (ValueError, OSError) as error:  # of the input: a sentence says it
        sys.exit(f"Error: {error}")
