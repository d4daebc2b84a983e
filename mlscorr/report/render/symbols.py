"""What stands beside the points: scale bar, compass and legend."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator

from mlscorr.report.render.quantities import LABELS, ColourScale, colour_table, swatches
from mlscorr.report.render.view import Camera
from mlscorr.report.style import mark_handle, nice

MARK = "#E6007E"  # what was surveyed: a colour that no scale has
HALO = (withStroke(linewidth=4.0, foreground="white"),)
SYMBOLS: dict[str, dict[str, Any]] = {
    "control": {"marker": "o", "color": "black"},
    "check": {"marker": "D", "color": "black", "markerfacecolor": "white"},
    "unused": {"marker": "x", "color": "black"},
}
POINTS = ("N", "NE", "E", "SE", "S", "SW", "W", "NW")
WORDS = {"control": "Control point", "check": "Check point", "unused": "Not used"}


def letter(where: Axes | Figure, factor: float) -> float:
    """Font size in points: a share of the figure's height, and no less than can be read."""
    figure = where.get_figure()
    return factor * max(figure.bbox.height / 58, 14.0) * 72 / figure.dpi


def _unit(size):
    """Length of the compass's arrows. Units: pixels."""
    return 0.05 * np.sqrt(size[0] * size[1])


def scale_bar(axes: Axes, camera: Camera) -> None:
    """A bar of round length at the lower left, true at the middle of the picture."""
    width, height = camera.size
    unit = _unit(camera.size)
    length = nice(0.25 * min(width, 1.5 * height) / camera.scale)
    left = 0.6 * unit
    foot = height - 0.5 * unit
    right = left + length * camera.scale
    _paper(axes, 0.3 * unit, height - 1.45 * unit, right + 0.3 * unit, height - 0.2 * unit)
    axes.plot([left, right], [foot, foot], color="black", linewidth=4, solid_capstyle="butt")
    above: dict[str, Any] = {"ha": "center", "va": "bottom", "fontsize": letter(axes, 0.9)}
    axes.text((left + right) / 2, foot - 0.2 * unit, f"{length:g} m", **above)


def _paper(axes, left, top, right, bottom):
    """A white patch, on which symbols can be read before any points."""
    axes.add_patch(
        Rectangle((left, top), right - left, bottom - top, color="white", alpha=0.92, lw=0)
    )


def free_corner(*pictures: np.ndarray) -> tuple[int, int]:
    """The corner (column, row; 0 or 1) other than the scale bar's with the least points."""
    height, width = pictures[0].shape[:2]
    side = round(4 * _unit((width, height)))

    def drawn(corner):
        if corner[0]:
            columns = slice(width - side, width)
        else:
            columns = slice(0, side)
        if corner[1]:
            rows = slice(height - side, height)
        else:
            rows = slice(0, side)
        return sum(int((p[rows, columns] != 255).any(axis=2).sum()) for p in pictures)

    return min(((1, 1), (1, 0), (0, 0)), key=drawn)


def compass(axes: Axes, camera: Camera, corner: tuple[int, int]) -> None:
    """North and east in a corner; in a level view what is up and what is right."""
    arm = _unit(camera.size)
    middle = np.array(camera.size) * corner + 2.0 * arm * (1 - 2 * np.array(corner))
    right, up, away = camera.axes
    if abs(away[2]) < 0.35:
        point = round(np.degrees(np.arctan2(right[0], right[1])) / 45) % 8
        arrows = {"up": up[[0, 2]] * [0, 1], POINTS[point]: np.array([1.0, 0.0])}
    else:
        arrows = {"E": camera.axes[:2, 0], "N": camera.axes[:2, 1]}
    tips = np.array([[0, 0], *(1.35 * d for d in arrows.values())]) * [1, -1] * arm + middle
    _paper(axes, *(tips.min(axis=0) - 0.4 * arm), *(tips.max(axis=0) + 0.4 * arm))
    line: dict[str, Any] = {"arrowstyle": "<|-", "linewidth": 1.4, "shrinkA": 1, "shrinkB": 0}
    for name, direction in arrows.items():
        color = "#777777" if name in ("E", "up") else "black"
        axes.annotate(
            name,
            xy=middle,
            xytext=middle + 1.35 * arm * direction * [1, -1],
            ha="center",
            va="center",
            color=color,
            fontsize=letter(axes, 0.8),
            fontweight="normal" if name in ("E", "up") else "bold",
            arrowprops={**line, "color": color},
        )


def legend(figure: Figure, view: Any, scale: ColourScale, margins: tuple[float, float]) -> None:
    """What colours and marks mean, in the foot of the page.

    Parameters
    ----------
    figure : Figure
    view : View
    scale : ColourScale
    margins : (float, float)
        Beside the panels and below them, over width and height of the page.
    """
    gap, foot = margins
    place: dict[str, Any] = {"loc": "lower left", "bbox_to_anchor": (gap, 0.01)}
    if view.colour in LABELS:
        place = {"loc": "center left", "bbox_to_anchor": (0.5, foot / 2 + 0.012)}
        _colour_bar(figure, view.colour, scale, (1.5 * gap, foot * 0.50, 0.40, foot * 0.14))
    handles = list(_handles(view))
    if handles:
        figure.legend(
            handles=handles,
            **place,
            ncols=len(handles),
            frameon=False,
            fontsize=letter(figure, 0.85),
            handletextpad=0.5,
            columnspacing=1.4,
        )


def _colour_bar(figure, colour, scale, place):
    words, unit = LABELS[colour]
    axes = figure.add_axes(place)
    axes.imshow(colour_table(colour)[None], aspect="auto", extent=(0, 1, 0, 1))
    axes.set_yticks([])
    size = letter(figure, 0.85)
    axes.tick_params(labelsize=size, length=3)
    values = MaxNLocator(6).tick_values(scale.low, scale.high)
    values = values[(values >= scale.low) & (values <= scale.high)]
    if scale.exponent < 1:  # where even steps would crowd at the end
        values = np.array([scale.low, *_quarters(scale), scale.high])
    axes.set_xticks(scale.share(values), [f"{value:.2g}" for value in values])
    if unit:
        words = f"{words} ({unit})"
    axes.set_title(words, fontsize=size, loc="left", pad=4)


def _quarters(scale):
    """Values at a quarter, the half and three quarters of a scale."""
    return scale.low + (scale.high - scale.low) * np.array([0.25, 0.5, 0.75]) ** (
        1 / scale.exponent
    )


def _handles(view) -> Iterator[Line2D]:
    """Legend entries of what is drawn in a view."""
    marks = [mark for side in view.marks for mark in side]
    kinds = {mark.kind for mark in marks}
    arrow = r"$\rightarrow$"
    if "surveyed" in kinds:
        yield Line2D([], [], color=MARK, linewidth=2.2, label="Surveyed position of a target")
    if "offset" in kinds:
        yield mark_handle(arrow, MARK, "From scanned to surveyed center", size=9)
    for kind, text in WORDS.items():
        if kind in kinds:
            yield Line2D([], [], linestyle="none", markersize=6, label=text, **SYMBOLS[kind])
    for number in {mark.text for mark in marks if mark.kind == "residual"}:
        yield mark_handle(arrow, MARK, f"To the surveyed position, enlarged {number} times", size=9)
    for colour, text in swatches(view.colour, view.visits):
        yield mark_handle("s", colour, text.capitalize(), size=9)
