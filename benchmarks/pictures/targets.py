"""Draw the targets that extract finds in a simulated street.

python benchmarks/pictures/targets.py [--picture FILE.png]
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
        drive={"duration": 12.0, "speed": 6.0},
        targets={"control": 6, "check": 2, "hidden": 0.0},
        scanner=[{"lines_per_second": 150, "points_per_line": 1000}],
    )
    with tempfile.TemporaryDirectory() as folder:
        simulate(scenario, np.random.default_rng(2)).write(folder)
        found = mlscorr.extract(mlscorr.read_survey(folder))
        figure = found.plot()
    figure.savefig(path, dpi=110)


def main():
    picture = parse().picture
    draw(picture)
    print(f"Picture: {picture}")


def parse():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--picture", type=Path, default=PICTURES / "targets.png")
    arguments = parser.parse_args()
    arguments.picture.parent.mkdir(parents=True, exist_ok=True)
    return arguments


if __name__ == "__main__":
    main()
