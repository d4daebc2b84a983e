"""What stands beside the points: scale bar, compass and legend."""

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator

from mlscorr.report.look import AFTER, BEFORE
from mlscorr.report.plan import nice
from mlscorr.report.render.quantities import FIRST, GHOST, LABELS, SECOND, colour_table

MARK = "#E6007E"  # what was surveyed: a colour that no scale has
HALO = (withStroke(linewidth=4.0, foreground="white"),)
SYMBOLS = {
    "control": {"marker": "o", "color": "black"},
    "check": {"marker": "D", "color": "black", "markerfacecolor": "white"},
    "unused": {"marker": "x", "color": "black"},
}
ARROW = r"$\rightarrow$"
INCH = 100.0  # pixels
LETTER = 1 / 58  # height of a letter over that of the page
SMALLEST = 14.0  # pixels, of a letter
GAP, HEAD, FOOT = 0.012, 0.105, 0.11  # of the page: between the panels, above and below them
LENGTHS = 0.25  # of the picture's width, the longest scale bar
SYMBOL = 0.05  # size of the compass's arrows over that of the picture
LEVEL = 0.35  # sine of the elevation below which a view is level
POINTS = ("N", "NE", "E", "SE", "S", "SW", "W", "NW")


def letter(where, factor):
    """Font size in points, by the height of the figure."""
    figure = where.get_figure()
    return factor * max(LETTER * figure.get_figheight(), SMALLEST / INCH) * 72


def scale_bar(axes, camera):
    """A bar of round length at the lower left, true at the middle of the picture."""
    width, height = camera.size
    unit = SYMBOL * np.sqrt(width * height)
    length = nice(LENGTHS * min(width, 1.5 * height) / camera.scale)
    left, foot = 0.6 * unit, height - 0.5 * unit
    right = left + length * camera.scale
    _paper(axes, 0.3 * unit, height - 1.45 * unit, right + 0.3 * unit, height - 0.2 * unit)
    axes.plot([left, right], [foot, foot], color="black", linewidth=4, solid_capstyle="butt")
    axes.text(
        (left + right) / 2,
        foot - 0.2 * unit,
        f"{length:g} m",
        ha="center",
        va="bottom",
        fontsize=letter(axes, 0.9),
    )


def _paper(axes, left, top, right, bottom):
    """A white patch, on which symbols can be read before any points."""
    axes.add_patch(
        Rectangle((left, top), right - left, bottom - top, color="white", alpha=0.92, lw=0)
    )


def free_corner(*pictures):
    """The corner (column, row; 0 or 1) other than the scale bar's with the least points."""
    height, width = pictures[0].shape[:2]
    side = round(4 * SYMBOL * np.sqrt(width * height))

    def drawn(corner):
        columns = slice(width - side, width) if corner[0] else slice(0, side)
        rows = slice(height - side, height) if corner[1] else slice(0, side)
        return sum(int((p[rows, columns] != 255).any(axis=2).sum()) for p in pictures)

    return min(((1, 1), (1, 0), (0, 0)), key=drawn)


def compass(axes, camera, corner):
    """North and east in a corner; in a level view what is up and what is right."""
    width, height = camera.size
    arm = SYMBOL * np.sqrt(width * height)
    middle = np.array([width, height]) * corner + 2.0 * arm * (1 - 2 * np.array(corner))
    right, up, away = camera.axes
    if abs(away[2]) < LEVEL:
        point = round(np.degrees(np.arctan2(right[0], right[1])) / 45) % 8
        arrows = {"up": up[[0, 2]] * [0, 1], POINTS[point]: np.array([1.0, 0.0])}
    else:
        arrows = {"E": camera.axes[:2, 0], "N": camera.axes[:2, 1]}
    tips = np.array([[0, 0], *(1.35 * d for d in arrows.values())]) * [1, -1] * arm + middle
    _paper(axes, *(tips.min(axis=0) - 0.4 * arm), *(tips.max(axis=0) + 0.4 * arm))
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
            arrowprops={
                "arrowstyle": "<|-",
                "color": color,
                "linewidth": 1.4,
                "shrinkA": 1,
                "shrinkB": 0,
            },
        )


def legend(figure, picture):
    """What colours and marks mean, in the foot of the page."""
    colour = picture.view.colour
    if colour in LABELS:
        _colour_bar(figure, colour, picture.limits)
    handles = list(_handles(picture.view))
    if handles:
        figure.legend(
            handles=handles,
            loc="center left" if colour in LABELS else "lower left",
            bbox_to_anchor=(0.5, FOOT / 2 + 0.012) if colour in LABELS else (GAP, 0.01),
            ncols=len(handles),
            frameon=False,
            fontsize=letter(figure, 0.85),
            handletextpad=0.5,
            columnspacing=1.4,
        )


def _colour_bar(figure, colour, limits):
    words, unit = LABELS[colour]
    axes = figure.add_axes((1.5 * GAP, FOOT * 0.50, 0.40, FOOT * 0.14))
    axes.imshow(colour_table(colour)[None], aspect="auto", extent=(*limits, 0, 1))
    axes.set_yticks([])
    size = letter(figure, 0.85)
    axes.tick_params(labelsize=size, length=3)
    axes.xaxis.set_major_locator(MaxNLocator(6))
    axes.set_title(f"{words} ({unit})" if unit else words, fontsize=size, loc="left", pad=4)


def _handles(view):
    """Legend entries of what is drawn in a view."""
    kinds = {mark.kind for side in view.marks for mark in side}
    if "surveyed" in kinds:
        yield Line2D([], [], color=MARK, linewidth=2.2, label="Where the target was surveyed")
    if "offset" in kinds:
        yield _handle(ARROW, MARK, "From the scanned centre to the surveyed one")
    words = {"control": "Control point", "check": "Check point", "unused": "Not used"}
    for kind, text in words.items():
        if kind in kinds:
            yield Line2D([], [], linestyle="none", markersize=6, label=text, **SYMBOLS[kind])
    times = {mark.text for side in view.marks for mark in side if mark.kind == "residual"}
    for number in times:
        yield _handle(ARROW, MARK, f"To its surveyed place, {number} times enlarged")
    if view.colour == "visit":
        yield _handle("s", FIRST, "Scanned at the first visit")
        yield _handle("s", SECOND, "Scanned at the second visit")
    if view.colour == "state":
        yield _handle("s", BEFORE, "As recorded")
        yield _handle("s", AFTER, "Corrected")
        yield _handle("s", GHOST, "The other of the two")


def _handle(marker, color, text):
    return Line2D([], [], linestyle="none", marker=marker, markersize=9, color=color, label=text)
