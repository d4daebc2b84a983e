"""Symbols of a picture: scale bar, compass and legend."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from mlscorr.report.pen import Pen
from mlscorr.report.render.quantities import LABELS, ColourScale, colour_table, swatches
from mlscorr.report.render.view import Camera
from mlscorr.report.style import mark_handle, nice

MARK = "#E6007E"  # what was surveyed: a colour that no scale has
PT = 100 / 72  # pixels of a point: pictures have 100 dots an inch
SYMBOLS: dict[str, dict[str, Any]] = {
    "control": {"marker": "o", "color": "black"},
    "check": {"marker": "D", "color": "black", "markerfacecolor": "white"},
    "unused": {"marker": "x", "color": "black"},
}
SYMBOL = 6 * PT  # pixels, the diameter of a symbol
EDGE = 1.3 * PT  # pixels, the width of its line
POINTS = ("N", "NE", "E", "SE", "S", "SW", "W", "NW")
WORDS = {"control": "Control point", "check": "Check point", "unused": "Not used"}


def letter(height: float, factor: float) -> float:
    """Size of letters: a share of a picture's height, and no less than can be read.

    Parameters
    ----------
    height : float
        Units: pixels.
    factor : float

    Returns
    -------
    float
        Units: pixels.
    """
    return factor * max(height / 58, 14.0)


def points_of(figure: Figure, factor: float) -> float:
    """Size of the same letters on a figure. Units: pt."""
    return letter(figure.bbox.height, factor) * 72 / figure.dpi


def symbol(pen: Pen, kind: str, middle: np.ndarray) -> None:
    """Draw the symbol of a target: a dot, a diamond or a cross.

    Parameters
    ----------
    pen : Pen
    kind : str
        Of SYMBOLS.
    middle : (2,) array
        Units: pixels.
    """
    half = SYMBOL / 2
    if kind == "control":
        pen.dots(middle[None], "black", SYMBOL + EDGE)
    elif kind == "check":
        corners = middle + half * np.sqrt(2) * np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
        pen.polygon(corners, "white")
        pen.line(corners, "black", EDGE, closed=True)
    else:
        for arm in half * np.array([[1, 1], [1, -1]]):
            pen.line(np.stack([middle - arm, middle + arm]), "black", EDGE)


def _unit(size):
    """Length of the compass's arrows. Units: pixels."""
    return 0.05 * np.sqrt(size[0] * size[1])


def bar_length(camera: Camera) -> float:
    """Length of the scale bar: a round number at the middle of the picture. Units: m."""
    width, height = camera.size
    return nice(0.25 * min(width, 1.5 * height) / camera.scale)


def scale_bar(pen: Pen, camera: Camera, size: float) -> None:
    """Draw a bar of round length at the lower left, true at the middle of the picture.

    Parameters
    ----------
    pen : Pen
    camera : Camera
    size : float
        Of its letters. Units: pixels.
    """
    height = camera.size[1]
    unit = _unit(camera.size)
    length = bar_length(camera)
    left = 0.6 * unit
    foot = height - 0.5 * unit
    right = left + length * camera.scale
    _paper(pen, 0.3 * unit, height - 1.45 * unit, right + 0.3 * unit, height - 0.2 * unit)
    pen.line(np.array([[left, foot], [right, foot]]), "black", 4 * PT)
    pen.text(((left + right) / 2, foot - 0.25 * unit), f"{length:g} m", size, anchor="mb")


def _paper(pen, left, top, right, bottom):
    """White patch on which symbols are readable over any points."""
    corners = np.array([[left, top], [right, top], [right, bottom], [left, bottom]])
    pen.tint(corners, "white", 0.92)


def free_corner(*pictures: np.ndarray) -> tuple[int, int]:
    """Corner (column, row; 0 or 1) with the least points, except the scale bar's."""
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


def directions(camera: Camera) -> dict[str, np.ndarray]:
    """North and east in a picture (right, up); in a level view what is up and what is right.

    Parameters
    ----------
    camera : Camera

    Returns
    -------
    dict of (2,) arrays
        By their names.
    """
    right, up, away = camera.axes
    if abs(away[2]) < 0.35:
        point = round(np.degrees(np.arctan2(right[0], right[1])) / 45) % 8
        return {"up": up[[0, 2]] * [0, 1], POINTS[point]: np.array([1.0, 0.0])}
    return {"E": camera.axes[:2, 0], "N": camera.axes[:2, 1]}


def compass(pen: Pen, camera: Camera, corner: tuple[int, int], size: float) -> None:
    """Draw the directions in a corner.

    Parameters
    ----------
    pen : Pen
    camera : Camera
    corner : (int, int)
        Column and row, 0 or 1.
    size : float
        Of its letters. Units: pixels.
    """
    arm = _unit(camera.size)
    middle = np.array(camera.size) * corner + 2.0 * arm * (1 - 2 * np.array(corner))
    arrows = {name: 1.35 * arm * d * [1, -1] for name, d in directions(camera).items()}
    tips = np.array([[0, 0], *arrows.values()]) + middle
    _paper(pen, *(tips.min(axis=0) - 0.4 * arm), *(tips.max(axis=0) + 0.4 * arm))
    for name, arrow in arrows.items():
        is_second = name in ("E", "up")
        color = "#777777" if is_second else "black"
        length = float(np.hypot(*arrow))
        if length > 0.9 * size:  # else it points to the eye
            shaft = arrow * (1 - 0.75 * size / length)  # ends before its letter
            ends = np.stack([middle, middle + shaft])
            pen.arrow(ends, color, 1.4 * PT, (0.4 * size, 0.25 * size))
        pen.text(tuple(middle + arrow), name, size, color, "mm", bold=not is_second)


def legend(figure: Figure, view: Any, scale: ColourScale, margins: tuple[float, float]) -> None:
    """Explain colors and marks at the bottom of the page.

    Parameters
    ----------
    figure : Figure
    view : View
    scale : ColourScale
    margins : (float, float)
        Margins next to and below the panels, relative to width and height of the page.
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
            fontsize=points_of(figure, 0.85),
            handletextpad=0.5,
            columnspacing=1.4,
        )


def _colour_bar(figure, colour, scale, place):
    words, unit = LABELS[colour]
    axes = figure.add_axes(place)
    axes.imshow(colour_table(colour)[None], aspect="auto", extent=(0, 1, 0, 1))
    axes.set_yticks([])
    size = points_of(figure, 0.85)
    axes.tick_params(labelsize=size, length=3)
    values = MaxNLocator(6).tick_values(scale.low, scale.high)
    values = values[(values >= scale.low) & (values <= scale.high)]
    if scale.exponent < 1:  # even steps would crowd at the end
        values = np.array([scale.low, *_quarters(scale), scale.high])
    axes.set_xticks(scale.share(values), [f"{value:.2g}" for value in values])
    if unit:
        words = f"{words} ({unit})"
    axes.set_title(words, fontsize=size, loc="left", pad=4)


def _quarters(scale):
    """Values at one quarter, one half and three quarters of a scale."""
    return scale.low + (scale.high - scale.low) * np.array([0.25, 0.5, 0.75]) ** (
        1 / scale.exponent
    )


def _handles(view) -> Iterator[Line2D]:
    """Yield legend entries of items drawn in a view."""
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
