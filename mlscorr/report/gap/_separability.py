"""What can be told apart, and how small an effect shows: two figures."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from mlscorr.effects import parameter_title
from mlscorr.gap.evidence import SETTINGS as INFERENCE
from mlscorr.report.gap._rows import DetectableRow
from mlscorr.report.gap._settings import SETTINGS
from mlscorr.report.gap.numbers import numbers
from mlscorr.report.style import BLUE, VERMILLION, legend_above, mark_handle, new_figure, styled
from mlscorr.wording import known


def classes_in_order(separability: dict) -> tuple[list[int], list[tuple[int, int]]]:
    """Order of the parameters with those of one class side by side, and (first, last) of each.

    Parameters of a class's effects that can be told from all others are not among them.

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
    """Squared correlation of the parameters, those of a class together in a box.

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
    bar.set_label("Squared correlation: 0 = told apart, 1 = the same")
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


@styled
def detectable_figure(rows: list[DetectableRow]) -> Figure:
    """How small an effect shows, over its usual size; left of one the survey can see it.

    Parameters
    ----------
    rows : list of DetectableRow
        The plainest first; those without a ratio are left out.
    """
    rows = [row for row in rows if known(row.ratio)]
    ratio = np.array([row.ratio for row in rows])
    figure = new_figure(1.0 + 0.2 * len(rows))
    panel = figure.add_subplot()
    low = min(0.5, ratio.min() / 1.6)
    high = max(2.0, ratio.max() * 1.6)
    panel.axvspan(low, 1.0, color="#e6f1f8", zorder=0)
    marks = (("o", BLUE, "Shows at its usual size"), ("X", VERMILLION, "Must be larger to show"))
    for place, value in enumerate(ratio):
        mark, color, _ = marks[int(value > 1)]
        panel.plot([1.0, value], [place] * 2, color="#b8bfc5", linewidth=1.2, zorder=1)
        panel.plot(value, place, mark, color=color, zorder=3)
    panel.axvline(1.0, color="black", linewidth=0.9, zorder=2)
    panel.set_xscale("log")
    panel.set_xlim(low, high)
    panel.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    panel.set_yticks(range(len(rows)), [row.title for row in rows])
    panel.set_ylim(len(rows) - 0.4, -0.6)
    panel.grid(axis="y", visible=False)
    panel.tick_params(axis="y", length=0)
    panel.set_xlabel("Smallest size that shows, over the usual size (logarithmic)")
    legend_above(figure, [mark_handle(*mark) for mark in marks])
    return figure
