"""Find, round by round, the effects in a survey that a simulator does not model.

    python benchmarks/pictures/diagnose_gap.py [--picture FILE.png]

A street is simulated with a scanner clock that is 6 ms off and control in a height datum that is 6
cm off. The diagnosis uses the survey alone: it names one effect, adds it to the simulator, and is
repeated until nothing is left.
"""

import argparse
import tempfile
from pathlib import Path

import matplotlib as mpl
import numpy as np

import mlscorr
from mlscorr.simulate import Scenario, simulate

mpl.use("Agg")
import matplotlib.pyplot as plt

PICTURES = Path(__file__).parents[2] / "build" / "pictures"
HIDDEN = [
    {"name": "time_offset", "magnitude": 0.006},
    {"name": "vertical_datum", "magnitude": 0.06},
]
ROUNDS = 4
BEFORE = "#d55e00"
AFTER = "#0072b2"
BAND = "0.85"


def survey_to_explain(folder):
    """A survey of two opposite passes, made by a simulator with hidden effects."""
    scenario = Scenario(
        drive={"duration": 40.0, "passes": [{}, {"direction": "back"}]},
        scene={"reference": True},
        targets={"control": 14, "check": 5},
        scanner=[{"lines_per_second": 100, "points_per_line": 400}],
        effects=HIDDEN,
    )
    simulate(scenario, np.random.default_rng(8)).write(folder)
    return mlscorr.read_survey(folder)


def rounds(survey):
    """Diagnoses, each with the simulator improved by the previous one, until no effect is found."""
    found = []
    simulator = None
    while len(found) < ROUNDS:
        found.append(mlscorr.diagnose(survey, simulator))
        told = found[-1].document
        print(f"round {len(found)}: {told['verdict']['sentence']}")
        if told["verdict"]["label"] in ("none", "unknown"):
            break
        closure = told["closure"]
        print(f"         gap {closure['before']:.2f} -> {closure['after']:.2f} mm, held out")
        simulator = found[-1].improved
    return [one.document for one in found]


def draw(several, path):
    """Draw the first round's gap by speed, by quantity and by axis, and that of all rounds."""
    first = several[0]
    figure, axes = plt.subplots(1, 4, figsize=(12, 3.4), width_ratios=[3, 2, 2, 2])
    for axis, by in zip(axes, ("speed", "channel", "axis"), strict=False):
        split(axis, next(one for one in first["where"] if one["by"] == by))
    axes[0].set_ylabel("gap (mm)")
    axes[0].legend(frameon=False, fontsize=8)
    numbers = np.arange(len(several))
    closure = [told["closure"] for told in several]
    for side, colour, moved in (("before", BEFORE, -0.2), ("after", AFTER, 0.2)):
        axes[3].bar(numbers + moved, [one[side] for one in closure], 0.4, color=colour)
    names = [told["verdict"]["label"].replace("+", "\n+ ") for told in several]
    axes[3].set_xticks(numbers, [f"round {i}:\n{name}" for i, name in enumerate(names, start=1)])
    axes[3].set_title("held out, by any one cause", fontsize=9)
    for axis in axes:
        axis.spines[["top", "right"]].set_visible(False)
        axis.tick_params(labelsize=8)
        axis.axhline(0, color="0.4", linewidth=0.6)
    figure.tight_layout()
    figure.savefig(path, dpi=110)


def split(axis, one):
    """Draw one split of the gap: before, after, and its range by chance."""
    low, high = np.array(one["null_band"]).T
    if "edges" in one:
        edges = np.array(one["edges"])
    else:
        edges = np.arange(len(one["bins"]) + 1) - 0.5
        axis.set_xticks(range(len(one["bins"])), one["bins"])
    axis.stairs(high, edges, baseline=low, fill=True, color=BAND, label="by chance (95 %)")
    axis.stairs(one["before"], edges, baseline=None, color=BEFORE, linewidth=2, label="before")
    axis.stairs(one["after"], edges, baseline=None, color=AFTER, linewidth=2, label="after")
    axis.set_title(f"by {one['name']}" + (f" ({one['unit']})" if one["unit"] else ""), fontsize=9)


def main():
    picture = parse().picture
    with tempfile.TemporaryDirectory() as folder:
        draw(rounds(survey_to_explain(folder)), picture)
    print(f"Picture: {picture}")


def parse():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--picture", type=Path, default=PICTURES / "diagnose.png")
    arguments = parser.parse_args()
    arguments.picture.parent.mkdir(parents=True, exist_ok=True)
    return arguments


if __name__ == "__main__":
    main()
