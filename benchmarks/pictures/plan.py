"""Draw how accurate a planned drive will be, and where more control would help.

    python benchmarks/pictures/plan.py [--picture FILE.png]

A street with an outage is simulated; its trajectory and its control points alone are planned with.
"""

import argparse
import tempfile
from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
import mlscorr
from mlscorr.simulate import Scenario, simulate

PICTURES = Path(__file__).parents[2] / "build" / "pictures"


def draw(path):
    """Write the picture."""
    scenario = Scenario(
        drive={"duration": 60.0},
        targets={"control": 6, "check": 0},
        scanner=[{"lines_per_second": 20, "points_per_line": 100}],  # a plan needs no cloud
        pos={"outages": [[22.0, 18.0]]},
    )
    with tempfile.TemporaryDirectory() as folder:
        simulate(scenario, np.random.default_rng(3)).write(folder)
        planned = mlscorr.plan(mlscorr.read_survey(folder))
    planned.plot("accuracy").savefig(path, dpi=110)


def main():
    picture = parse().picture
    draw(picture)
    print(f"Picture: {picture}")


def parse():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--picture", type=Path, default=PICTURES / "plan.png")
    arguments = parser.parse_args()
    arguments.picture.parent.mkdir(parents=True, exist_ok=True)
    return arguments


if __name__ == "__main__":
    main()
