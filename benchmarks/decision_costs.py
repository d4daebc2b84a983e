"""Effect of the cost of a false alarm: clean surveys given a cause against effects named.

    python benchmarks/decision_costs.py [--records FOLDER] [--worlds N] [--picture FILE]

Synthetic surveys of features, whose evidence is kept in FOLDER (as by ``train_decision.py``; a
missing world takes minutes), are labeled at costs from a tenth to a hundred times the default, by
probabilities learned on other worlds.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import matplotlib as mpl
import numpy as np
from gap_training.cases import known_mechanisms
from gap_training.fit import figures, out_of_fold
from gap_training.records import collect

from mlscorr.gap.evidence import OPERATING_POINTS

mpl.use("Agg")
import matplotlib.pyplot as plt

FIRST = 1000  # seed of the first world
FALSE_ALARMS = np.geomspace(0.4, 400.0, 41)  # in wrong names
CLEAN = ("clean, open sky: a cause claimed", "clean, bad sky: a cause claimed")
RIGHT = {
    "one effect right at 1.6 to 2.5 MDB": ("One effect of 1.6 to 2.5 MDB", "#0072b2"),
    "one effect right at 3 MDB and more": ("One effect of 3 MDB and more", "#d55e00"),
}
MARKS = {"sensitive": "^", "default": "o", "careful": "s"}


def rates(records, probabilities, costs):
    """Share of clean surveys that are given a cause, and of effects that are named correctly."""
    known = figures(records, probabilities, costs)
    claims = sum(known[name][0] * known[name][1] for name in CLEAN if known[name][1])
    clean = sum(known[name][1] for name in CLEAN)
    return claims / clean, *(known[name][0] for name in RIGHT)


def draw(records, probabilities, path):
    """Draw both shares over the cost of a false alarm, and the three operating points."""
    default = OPERATING_POINTS["default"]
    curve = np.array(
        [rates(records, probabilities, replace(default, false_alarm=cost)) for cost in FALSE_ALARMS]
    )
    figure, panel = plt.subplots(figsize=(6.4, 3.9), dpi=140, layout="constrained")
    for column, (title, color) in enumerate(RIGHT.values(), start=1):
        panel.plot(100 * curve[:, 0], 100 * curve[:, column], color=color, label=title, lw=1.6)
    for name, costs in OPERATING_POINTS.items():
        clean, *right = rates(records, probabilities, costs)
        print(f"{name}: {clean:.3f} of clean surveys, {', '.join(f'{r:.2f}' for r in right)} right")
        words = f"{name} (false alarm {costs.false_alarm:g})"
        panel.plot(
            [100 * clean] * 2, 100 * np.array(right), MARKS[name], color="black", ms=6, label=words
        )
    worlds = len({record.world for record in records})
    panel.set(
        xlabel="Clean surveys that are given a cause (%)",
        ylabel="Effects named rightly (%)",
        xlim=(-0.5, 100 * curve[:, 0].max() + 1),
        ylim=(0, 101),
        title=f"{len(records)} surveys of {worlds} worlds, each judged by what others taught",
    )
    panel.title.set_fontsize(9)
    panel.grid(color="#e4e4e4")
    panel.legend(frameon=False, fontsize=8, loc="lower right")
    figure.savefig(path, metadata={"Software": "mlscorr"})


def main():
    """Collect missing records, and draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--records", type=Path, default=Path("build/records"))
    parser.add_argument("--worlds", type=int, default=69)
    parser.add_argument("--picture", type=Path, default=Path("decision_costs.png"))
    given = parser.parse_args()
    mechanisms = known_mechanisms(Path(__file__).parents[1] / "tests/withheld/mechanisms.py")
    seeds = range(FIRST, FIRST + given.worlds)
    records = collect(given.records, seeds, 24, mechanisms, 50)
    draw(records, out_of_fold(records), given.picture)


if __name__ == "__main__":
    main()
