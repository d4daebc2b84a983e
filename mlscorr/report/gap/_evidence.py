"""Figures of the evidence: the ladder of candidates, and separability of parameters."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from mlscorr.effects import OTHERS, family, parameter_title, title
from mlscorr.gap.evidence import SETTINGS as INFERENCE
from mlscorr.report.gap._rows import numbers
from mlscorr.report.gap._settings import SETTINGS
from mlscorr.report.style import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    VERMILLION,
    label,
    legend_above,
    new_figure,
    styled,
)
from mlscorr.wording import known, percent

FAMILIES = {  # color, hatch, words
    "none": (GREY, "", "no error"),
    "unknown": (ORANGE, "////", "something unknown"),
    "noise": (GREEN, "....", "noise class"),
    "effect": (BLUE, "", "known effect"),
}


@styled
def ladder_figure(document: dict) -> Figure:
    """Draw the evidence of each label over none, in powers of ten; the best at the top.

    Parameters
    ----------
    document : dict
        Contents of gap.json.
    """
    rungs = ladder(document)
    names = []
    figure = new_figure(1.0 + 0.21 * len(rungs))
    panel = figure.add_subplot()
    for place, rung in enumerate(rungs):
        value = rung["log_evidence_ratio"] / np.log(10.0)
        kind = family(rung["label"])
        is_in_set = rung["label"] in document["verdict"]["set"]
        color, hatch, _ = FAMILIES[kind]
        panel.barh(
            place,
            value,
            height=0.72,
            color=color,
            hatch=hatch,
            zorder=2,
            edgecolor="black" if is_in_set else "white",
            linewidth=1.4 if is_in_set else 0.4,
        )
        panel.plot(value, place, "|", color="black", markersize=8, zorder=3)
        name = label(title(rung["label"]), SETTINGS.ladder_letters)
        names.append("● " * is_in_set + name + " [noise]" * (kind == "noise"))
        _write_probability(panel, place, value, rung["probability"])
    panel.axvline(0.0, color="black", linewidth=0.9, zorder=3)
    panel.set_yticks(range(len(rungs)), names, parse_math=False)
    panel.set_ylim(len(rungs) - 0.4, -0.6)
    panel.margins(x=0.12)
    panel.grid(axis="y", visible=False)
    panel.tick_params(axis="y", length=0)
    panel.set_xlabel("Evidence over no error (powers of ten)")
    legend_above(figure, _legend(rungs), columns=4)
    return figure


def ladder(document: dict) -> list[dict]:
    """Drawn rows of evidence[], best first, always including none and unknown.

    Parameters
    ----------
    document : dict
        Contents of gap.json.
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


def classes_in_order(separability: dict) -> tuple[list[int], list[tuple[int, int]]]:
    """Order of the parameters with those of one class adjacent, and (first, last) of each class.

    Parameters of a class's effects that are separable from all others are excluded.

    Parameters
    ----------
    separability : dict
        classes and correlation of gap.json or plan.json.
    """
    names = separability["correlation"]["names"]
    square = np.nan_to_num(_squares(separability))
    effect = np.array([name.partition(" ")[0] for name in names])
    order = []
    boxes = []
    for members in separability["classes"]:
        inside = np.isin(effect, members)
        pairs = (square > INFERENCE.same) & inside[:, None] & inside
        pairs &= effect[:, None] != effect
        rows = [int(i) for i in np.flatnonzero(pairs.any(axis=1)) if i not in order]
        if rows:
            boxes.append((len(order), len(order) + len(rows) - 1))
        order += rows
    return order + [i for i in range(len(names)) if i not in order], boxes


def _squares(separability):
    """Squared correlation (n, n)."""
    return np.array([numbers(row) for row in separability["correlation"]["matrix"]]) ** 2


@styled
def heat_figure(separability: dict) -> Figure:
    """Draw squared correlations of the parameters, with a box around each class.

    Parameters
    ----------
    separability : dict
        classes and correlation of gap.json or plan.json.
    """
    order, boxes = classes_in_order(separability)
    names = [parameter_title(separability["correlation"]["names"][i]) for i in order]
    square = _squares(separability)[np.ix_(order, order)]
    n = len(names)
    figure = new_figure(5.3 + 0.03 * n)
    panel = figure.add_subplot()
    cells = panel.pcolormesh(square, cmap="Blues", vmin=0, vmax=1, edgecolor="white", linewidth=0.3)
    _write_cells(panel, square, max(4.5, 8 - 0.08 * n))
    for low, high in boxes:
        extent = high - low + 1
        panel.add_patch(
            Rectangle((low, low), extent, extent, fill=False, edgecolor=VERMILLION, linewidth=2.0)
        )
    letters = 7.5 if n < 30 else 6.5
    panel.set_xticks(np.arange(n) + 0.5, names, rotation=90, fontsize=letters)
    panel.set_yticks(np.arange(n) + 0.5, names, fontsize=letters)
    panel.invert_yaxis()
    panel.set_aspect("equal")
    panel.grid(visible=False)
    panel.tick_params(length=0)
    bar = figure.colorbar(cells, ax=panel, shrink=0.6, pad=0.02)
    bar.set_label("Squared correlation: 0 = separable, 1 = not separable")
    bar.ax.axhline(INFERENCE.same, color=VERMILLION, linewidth=1.5)
    return figure


def _write_cells(panel, square, letters):
    large = np.nan_to_num(square) >= SETTINGS.written_correlation
    for i, j in zip(*np.nonzero(large & ~np.eye(len(square), dtype=bool)), strict=True):
        panel.text(
            j + 0.5,
            i + 0.5,
            f"{square[i, j]:.2f}".lstrip("0"),
            fontsize=letters,
            horizontalalignment="center",
            verticalalignment="center",
            color="white" if square[i, j] > 0.6 else "black",
        )
