"""Draw what ties add to control points, from the tables of docs/results-ties.md.

python benchmarks/pictures/ties_gain.py [--picture FILE.png]
"""

import argparse
import re
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt

ROOT = Path(__file__).parents[2]
PICTURES = ROOT / "build" / "pictures"
PAGE = ROOT / "docs" / "results-ties.md"
SECTIONS = ("Both passes without GNSS", "Each pass loses GNSS elsewhere", "A spinning scanner")
BLUE = "#0072b2"
ORANGE = "#d55e00"


def rows_of(section):
    """Cells of the rows of the first table of a section by the name of the row."""
    text = PAGE.read_text(encoding="utf-8").split(f"## {section}\n")[1].split("\n## ")[0]
    lines = [line.strip("|").split("|") for line in text.splitlines() if line.startswith("|")]
    rows = {}
    for line in lines:  # the first row of a name
        rows.setdefault(line[0].strip(), [cell.strip() for cell in line[1:]])
    return rows


def numbers(cells):
    """The first number (m) of each cell."""
    return [float(re.match(r"[\d.]+", cell)[0]) for cell in cells]


def draw(path):
    """Write the picture."""
    figure, several = plt.subplots(1, 3, figsize=(11, 3.6), sharey=True, layout="constrained")
    for axes, section in zip(several, SECTIONS, strict=True):
        rows = rows_of(section)
        points = [int(cell) for cell in rows["control points"]]
        alone = next(row for name, row in rows.items() if "3D RMS by control alone" in name)
        tied = next(row for name, row in rows.items() if name.startswith("3D RMS with ties"))
        where = range(len(points))
        axes.plot(where, numbers(alone), "o-", color=ORANGE, label="control alone (0: as recorded)")
        axes.plot(where, numbers(tied), "o-", color=BLUE, label="with ties")
        title = section
        if section.startswith("A spinning"):
            title = f"{section}, one pass"
        axes.set_title(title, fontsize=10)
        axes.set_xticks(where, points)
        axes.set_xlabel("control points")
        axes.set_yscale("log")
        axes.set_yticks([0.01, 0.03, 0.1, 0.3, 1.0], ["1 cm", "3 cm", "10 cm", "30 cm", "1 m"])
        axes.minorticks_off()
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(axis="y", color="0.9")
    several[0].set_ylabel("3D RMS of the trajectory")
    several[0].legend(frameon=False, fontsize=8)
    figure.savefig(path, dpi=110)


def main():
    picture = parse().picture
    draw(picture)
    print(f"Picture: {picture}")


def parse():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--picture", type=Path, default=PICTURES / "ties_gain.png")
    arguments = parser.parse_args()
    arguments.picture.parent.mkdir(parents=True, exist_ok=True)
    return arguments


if __name__ == "__main__":
    main()
