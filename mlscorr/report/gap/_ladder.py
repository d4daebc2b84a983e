"""The ladder of evidence: how much better each candidate explains the data than nothing wrong."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from mlscorr.effects import OTHERS, family, title
from mlscorr.report.gap._settings import SETTINGS
from mlscorr.report.style import BLUE, GREEN, GREY, ORANGE, label, legend_above, new_figure, styled
from mlscorr.wording import known, percent

FAMILIES = {  # colour, hatch, words
    "none": (GREY, "", "nothing wrong"),
    "unknown": (ORANGE, "////", "something unknown"),
    "noise": (GREEN, "....", "noise class"),
    "effect": (BLUE, "", "known effect"),
}


@styled
def ladder_figure(document: dict) -> Figure:
    """Evidence of each label over none, in powers of ten; the best at the top.

    Parameters
    ----------
    document : dict
        The content of gap.json.
    """
    rungs = ladder(document)
    names = []
    figure = new_figure(1.0 + 0.21 * len(rungs))
    panel = figure.add_subplot()
    for place, rung in enumerate(rungs):
        value = rung["log_evidence_ratio"] / np.log(10.0)
        kind = family(rung["label"])
        is_held = rung["label"] in document["verdict"]["set"]
        color, hatch, _ = FAMILIES[kind]
        panel.barh(
            place,
            value,
            height=0.72,
            color=color,
            hatch=hatch,
            zorder=2,
            edgecolor="black" if is_held else "white",
            linewidth=1.4 if is_held else 0.4,
        )
        panel.plot(value, place, "|", color="black", markersize=8, zorder=3)
        name = label(title(rung["label"]), SETTINGS.ladder_letters)
        names.append("● " * is_held + name + " [noise]" * (kind == "noise"))
        _write_probability(panel, place, value, rung["probability"])
    panel.axvline(0.0, color="black", linewidth=0.9, zorder=3)
    panel.set_yticks(range(len(rungs)), names, parse_math=False)
    panel.set_ylim(len(rungs) - 0.4, -0.6)
    panel.margins(x=0.12)
    panel.grid(axis="y", visible=False)
    panel.tick_params(axis="y", length=0)
    panel.set_xlabel("Powers of ten by which it explains the data better than nothing wrong")
    legend_above(figure, _legend(rungs), columns=4)
    return figure


def ladder(document: dict) -> list[dict]:
    """Rows of evidence[] that are drawn, the best first; none and unknown are always there.

    Parameters
    ----------
    document : dict
        The content of gap.json.
    """
    rungs = [row for row in document["evidence"] if known(row["log_evidence_ratio"])]
    rungs = sorted(rungs, key=lambda row: -row["log_evidence_ratio"])
    below = [row for row in rungs[SETTINGS.ladder_rows :] if row["label"] in OTHERS]
    return rungs[: SETTINGS.ladder_rows] + below


def _write_probability(panel, place, value, probability):
    if not known(probability) or probability < 0.005:  # 0 %
        return
    panel.annotate(
        percent(probability),
        (max(value, 0.0), place),
        xytext=(4, 0),
        fontsize=7.5,
        textcoords="offset points",
        verticalalignment="center",
        zorder=4,
    )


def _legend(rungs):
    drawn = {family(rung["label"]) for rung in rungs}
    handles = [
        Patch(facecolor=color, hatch=hatch, edgecolor="white", label=words.capitalize())
        for name, (color, hatch, words) in FAMILIES.items()
        if name in drawn
    ]
    edge = Patch(facecolor="white", edgecolor="black", linewidth=1.4, label="● In the 95 % set")
    return [*handles, edge]
