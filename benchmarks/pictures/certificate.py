"""Draw the first page of the certificate of a simulated street.

python benchmarks/pictures/certificate.py [--picture FILE.png]
"""

import argparse
import tempfile
from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
from matplotlib.transforms import Bbox

import mlscorr
from mlscorr.report import certificate
from mlscorr.report.style import STYLE
from mlscorr.simulate import Scenario, simulate

PICTURES = Path(__file__).parents[2] / "build" / "pictures"
NAMES = """
[project]
title = "Ring road, section 3"
client = "City of Wuhan"
project = "2024-017"
instrument = "RIEGL VMX-2HA, no. S2223456"
operator = "J. Meyer"
"""


def draw(path):
    """Write the picture."""
    scenario = Scenario(
        drive={"duration": 20.0, "speed": 6.0},
        targets={"control": 8, "check": 4, "hidden": 0.0},
        scanner=[{"lines_per_second": 75, "points_per_line": 400}],
        pos={"processing": "filtered", "outages": [[6.0, 6.0]]},
    )
    with tempfile.TemporaryDirectory() as folder:
        simulate(scenario, np.random.default_rng(4)).write(folder)
        survey_toml = Path(folder) / "survey.toml"
        survey_toml.write_text(survey_toml.read_text() + NAMES)
        result = mlscorr.correct(mlscorr.read_survey(folder))
        report = result.write(Path(folder) / "corrected")
    with mpl.rc_context(STYLE):
        sheet = certificate._Sheet()
        certificate._first_page(sheet, report)
        sheet.figure.savefig(path, dpi=90, bbox_inches=Bbox([[0, 2.6], [8.27, 11.69]]))


def main():
    picture = parse().picture
    draw(picture)
    print(f"Picture: {picture}")


def parse():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--picture", type=Path, default=PICTURES / "certificate.png")
    arguments = parser.parse_args()
    arguments.picture.parent.mkdir(parents=True, exist_ok=True)
    return arguments


if __name__ == "__main__":
    main()
