"""Figures of the evidence, of what can be told apart, and of how small an effect shows."""

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from mlscorr.report.effect_words import kind, title
from mlscorr.report.gap_figures import numbers
from mlscorr.report.look import (
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
from mlscorr.report.sizes import known

LONGEST = 26  # labels on the ladder at most, none and unknown always among them
KINDS = {  # colour, hatch, words
    "none": (GREY, "", "nothing wrong"),
    "unknown": (ORANGE, "////", "something unknown"),
    "noise": (GREEN, "....", "noise class"),
    "effect": (BLUE, "", "known effect"),
}
SAME = 0.9  # squared correlation, above which two can't be told apart
WRITTEN = 0.5  # from which on it is written into its cell
NAME = 34  # letters


@styled
def ladder_figure(document):
    """Evidence of each label over none, in powers of ten; the best at the top."""
    rows = ladder(document)
    figure = new_figure(1.0 + 0.21 * len(rows))
    panel = figure.add_subplot()
    values = numbers([one["log_evidence_ratio"] for one in rows]) / np.log(10.0)
    inside = set(document["verdict"]["set"])
    names = []
    for place, (one, value) in enumerate(zip(rows, values, strict=True)):
        color, hatch, _ = KINDS[kind(one["label"])]
        held = one["label"] in inside
        panel.barh(
            place, value, height=0.72, color=color, hatch=hatch, zorder=2,
            edgecolor="black" if held else "white", linewidth=1.4 if held else 0.4,
        )  # fmt: skip
        mark = "● " if held else ""
        tag = " [noise]" if kind(one["label"]) == "noise" else ""
        panel.plot(value, place, "|", color="black", markersize=8, zorder=3)
        names.append(mark + label(title(one["label"]), NAME) + tag)
        _probability(panel, place, value, one["probability"])
    panel.axvline(0.0, color="black", linewidth=0.9, zorder=3)
    panel.set_yticks(range(len(rows)), names, parse_math=False)
    panel.set_ylim(len(rows) - 0.4, -0.6)
    panel.margins(x=0.12)
    panel.grid(axis="y", visible=False)
    panel.tick_params(axis="y", length=0)
    panel.set_xlabel("Powers of ten by which it explains the data better than nothing wrong")
    panel.legend(handles=_kinds(rows), loc="lower right", frameon=True, framealpha=0.9)
    return figure


def ladder(document):
    """Rows of evidence[] that are drawn, the best first; none and unknown are always there."""
    rows = [one for one in document["evidence"] if known(one["log_evidence_ratio"])]
    rows = sorted(rows, key=lambda one: -one["log_evidence_ratio"])
    kept = rows[:LONGEST]
    return kept + [one for one in rows[LONGEST:] if kind(one["label"]) in ("none", "unknown")]


def _probability(panel, place, value, probability):
    if not known(probability) or probability < 0.005:
        return
    panel.annotate(
        f"{100 * probability:.0f} %", (max(value, 0.0), place), xytext=(4, 0), fontsize=7.5,
        textcoords="offset points", verticalalignment="center", zorder=4,
    )  # fmt: skip


def _kinds(rows):
    there = {kind(one["label"]) for one in rows}
    handles = [
        Patch(facecolor=color, hatch=hatch, edgecolor="white", label=words.capitalize())
        for name, (color, hatch, words) in KINDS.items()
        if name in there
    ]
    edge = Patch(facecolor="white", edgecolor="black", linewidth=1.4, label="● In the 95 % set")
    return [*handles, edge]


def parameter_title(name):
    """The name of a parameter in words: the effect's, and which part of it.

    >>> parameter_title("lever_arm up"), parameter_title("time_offset")
    ('Lever arm, up', 'Scanner clock offset')
    """
    effect, _, part = name.partition(" ")
    part = part.replace("magnitude ", "").replace("(phase)", "")
    return title(effect) + (f", {part}" if part else "")


def in_classes(separability):
    """Order of the parameters with those of one class side by side, and (first, last) of each.

    Parameters of a class's effects that can be told from all others are not among them.
    """
    names = separability["correlation"]["names"]
    effect = np.array([name.partition(" ")[0] for name in names])
    square = np.nan_to_num([numbers(row) for row in separability["correlation"]["matrix"]]) ** 2
    order, boxes = [], []
    for members in separability["classes"]:
        mine = np.isin(effect, members)
        alike = (square > SAME) & mine[:, None] & mine & (effect[:, None] != effect)
        inside = [int(i) for i in np.flatnonzero(alike.any(axis=1)) if i not in order]
        if inside:
            boxes.append((len(order), len(order) + len(inside) - 1))
        order += inside
    return order + [i for i in range(len(names)) if i not in order], boxes


@styled
def heat_figure(separability):
    """Squared correlation of the parameters, those of a class together in a box."""
    order, boxes = in_classes(separability)
    names = [parameter_title(separability["correlation"]["names"][i]) for i in order]
    matrix = np.array([numbers(row) for row in separability["correlation"]["matrix"]])
    square = matrix[np.ix_(order, order)] ** 2
    n = len(names)
    letters = max(4.5, 8 - 0.08 * n)
    figure = new_figure(5.3 + 0.03 * n)
    panel = figure.add_subplot()
    shown = panel.pcolormesh(square, cmap="Blues", vmin=0, vmax=1, edgecolor="white", linewidth=0.3)
    for i, j in zip(*np.nonzero(np.nan_to_num(square) >= WRITTEN), strict=True):
        if i != j:
            panel.text(
                j + 0.5, i + 0.5, f"{square[i, j]:.2f}".lstrip("0"), fontsize=letters,
                horizontalalignment="center", verticalalignment="center",
                color="white" if square[i, j] > 0.6 else "black",
            )  # fmt: skip
    for low, high in boxes:
        size = high - low + 1
        panel.add_patch(
            Rectangle((low, low), size, size, fill=False, edgecolor=VERMILLION, linewidth=2.0)
        )
    small = 7.5 if n < 30 else 6.5
    panel.set_xticks(np.arange(n) + 0.5, names, rotation=90, fontsize=small)
    panel.set_yticks(np.arange(n) + 0.5, names, fontsize=small)
    panel.invert_yaxis()
    panel.set_aspect("equal")
    panel.grid(visible=False)
    panel.tick_params(length=0)
    bar = figure.colorbar(shown, ax=panel, shrink=0.6, pad=0.02)
    bar.set_label("Squared correlation: 0 = told apart, 1 = the same")
    bar.ax.axhline(SAME, color=VERMILLION, linewidth=1.5)
    return figure


@styled
def detectable_figure(rows):
    """How small an effect shows, over its usual size; left of one the survey can see it.

    rows are dicts with title and ratio, the plainest first.
    """
    rows = [one for one in rows if known(one["ratio"])]
    figure = new_figure(1.0 + 0.2 * len(rows))
    panel = figure.add_subplot()
    ratio = np.array([one["ratio"] for one in rows])
    low, high = min(0.5, ratio.min() / 1.6), max(2.0, ratio.max() * 1.6)
    panel.axvspan(low, 1.0, color="#e6f1f8", zorder=0)
    for place, value in enumerate(ratio):
        seen = value <= 1
        panel.plot([1.0, value], [place] * 2, color="#b8bfc5", linewidth=1.2, zorder=1)
        panel.plot(value, place, "o" if seen else "X", color=BLUE if seen else VERMILLION, zorder=3)
    panel.axvline(1.0, color="black", linewidth=0.9, zorder=2)
    panel.set_xscale("log")
    panel.set_xlim(low, high)
    panel.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    panel.set_yticks(range(len(rows)), [one["title"] for one in rows])
    panel.set_ylim(len(rows) - 0.4, -0.6)
    panel.grid(axis="y", visible=False)
    panel.tick_params(axis="y", length=0)
    panel.set_xlabel("Smallest size that shows, over the usual size (logarithmic)")
    words = (("o", BLUE, "Shows at its usual size"), ("X", VERMILLION, "Must be larger to show"))
    handles = [
        Line2D([], [], linestyle="none", marker=mark, color=color, label=text)
        for mark, color, text in words
    ]
    legend_above(figure, handles)
    return figure
