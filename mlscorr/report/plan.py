"""The map: trajectory, targets and their horizontal residuals as arrows."""

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, MaxNLocator

from mlscorr.report.look import (
    AFTER,
    BEFORE,
    MARKS,
    WIDTH,
    break_at_gaps,
    label,
    legend_above,
    new_figure,
    styled,
    thin,
)
from mlscorr.report.tables import GROUPS, array, ordered

LETTER = np.array([0.0105, 0.018])  # size of a letter of a name, as a share of the map's width
ARROW_SHARE = 0.12  # the longest arrow, as a share of the map's width
SHORTEST = 0.008  # a shorter arrow hides under its mark
TRACK = {"color": "#9a9a9a", "linewidth": 1.4}


def nice(value):
    """The largest of 1, 2, 5 times a power of ten that is not above a positive value.

    >>> nice(0.71), nice(380.0)
    (0.5, 200.0)
    """
    power = 10.0 ** np.floor(np.log10(value))
    return float(max(step * power for step in (1, 2, 5) if step * power <= value * (1 + 1e-9)))


@styled
def map_figure(survey, correction, document):
    """Plan of the trajectory and the targets with residual arrows before and after."""
    track = _track(correction.corrected)
    rows = [row for row in ordered(document["targets"]) if row.get("surveyed")]
    places = array(rows, "surveyed")[:, :2]
    points = np.vstack([track[np.isfinite(track).all(axis=1)], places])
    extent = max(float(np.ptp(points, axis=0).max()), 1.0)
    arrows = [row for row in ordered(rows, "control", "check") if row.get("before")]
    times = _enlargement(array(arrows, "before")[:, :2], extent)
    tips = array(arrows, "surveyed")[:, :2] + times * array(arrows, "before")[:, :2]
    low, high, strip = _bounds(np.vstack([points, tips[np.isfinite(tips).all(axis=1)]]), extent)
    width, height = high - low
    figure = new_figure(1.25 + (WIDTH - 1.1) * height / width)
    axes = figure.add_subplot()
    axes.plot(*track.T, **TRACK)
    short = _arrows(axes, arrows, times, SHORTEST * width)
    for role in GROUPS[::-1]:
        axes.plot(*array(ordered(rows, role), "surveyed")[:, :2].T, linestyle="none", **MARKS[role])
    _names(axes, rows, width)
    _frame(axes, low, high)
    _key(axes, low, high, strip, times)
    legend_above(figure, _legend(rows, arrows, times, short), columns=3)
    return figure


def _track(trajectory):
    """Thinned plan positions (m, 2) of a trajectory, broken at its gaps."""
    plan = trajectory.position[:, :2]
    rows = thin(plan, trajectory.gps_time, trajectory.gaps)
    return break_at_gaps(trajectory.gps_time[rows], trajectory.gaps, plan[rows])[1]


def _enlargement(residuals, extent):
    """How many times the arrows are larger than the map: 1, 2, 5, 10, ...; 0 without arrows."""
    lengths = np.hypot(*residuals.T)
    longest = np.nanmax(lengths, initial=0.0) if np.isfinite(lengths).any() else 0.0
    return nice(ARROW_SHARE * extent / longest) if longest > 0 else 0.0


def _bounds(points, extent):
    """Lower left and upper right corner with a margin, and the height of the strip at the foot.

    The strip is kept free of data for the scale bar and the north arrow.
    """
    low, high = points.min(axis=0) - 0.06 * extent, points.max(axis=0) + 0.06 * extent
    size = high - low
    wanted = np.maximum(size, [size[1], 0.4 * size[0]])
    low, high = low - (wanted - size) / 2, high + (wanted - size) / 2
    strip = 0.11 * wanted[0]
    return low - [0.0, strip], high, strip


def _arrows(axes, rows, times, shortest):
    """Draw horizontal residuals from the surveyed place, broad before and thin after.

    Returns how many after the correction are too short to draw.
    """
    if not times:
        return 0
    place = array(rows, "surveyed")[:, :2]
    for key, color, width in (("before", BEFORE, 0.026), ("after", AFTER, 0.018)):
        residual = times * array(rows, key)[:, :2]
        long = np.hypot(*residual.T) > shortest
        _quiver(axes, place[long], residual[long], color, width)
    return int((np.hypot(*residual.T) <= shortest).sum())


def _quiver(axes, place, vector, color, width):
    axes.quiver(
        *place.T,
        *vector.T,
        color=color,
        width=width,
        units="inches",
        angles="xy",
        scale_units="xy",
        scale=1.0,
        headwidth=4.5,
        headlength=5.0,
        zorder=3,
    )


def _names(axes, rows, width):
    """Each target's name once, beside its arrow; left out where it would cover another name."""
    taken = np.empty((0, 4))
    for name, row in {row["name"]: row for row in rows[::-1]}.items():
        text = label(name)
        side = -1 if ((row.get("before") or [0.0])[0] or 0.0) > 0 else 1
        half = LETTER * [len(text) / 2, 0.5] * width
        middle = np.add(row["surveyed"][:2], [side * (half[0] + LETTER[0] * width), 0.0])
        apart = np.abs(taken[:, :2] - middle) >= taken[:, 2:] + half
        if not apart.any(axis=1).all():
            continue
        taken = np.vstack([taken, [*middle, *half]])
        axes.annotate(
            text,
            row["surveyed"][:2],
            xytext=(5 * side, 0),
            textcoords="offset points",
            horizontalalignment="left" if side > 0 else "right",
            verticalalignment="center",
            fontsize=7,
            parse_math=False,
            zorder=5,
        )


def _frame(axes, low, high):
    """Limits, equal scale on both axes, and whole metres as tick labels."""
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal")
    for axis, name in ((axes.xaxis, "Easting (m)"), (axes.yaxis, "Northing (m)")):
        axis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10], min_n_ticks=2))
        decimals = 0 if np.ptp(axis.get_view_interval()) > 5 else 1
        axis.set_major_formatter(
            FuncFormatter(lambda v, _, d=decimals: f"{v:,.{d}f}".replace(",", " "))
        )
        axis.set_label_text(name)
    axes.set_title("Where the targets lie, and their horizontal residuals")


def _key(axes, low, high, strip, times):
    """Scale bar, arrow scale and north arrow in the free strip at the foot."""
    width = high[0] - low[0]
    axes.axhspan(low[1], low[1] + strip, color="white", zorder=2.5)
    axes.axhline(low[1] + strip, color="#bbbbbb", linewidth=0.6, zorder=2.6)
    middle, top = low[1] + 0.35 * strip, low[1] + 0.62 * strip
    text = {"horizontalalignment": "left", "verticalalignment": "center", "fontsize": 8.5}
    bar, west = nice(0.22 * width), low[0] + 0.03 * width
    axes.plot([west, west + bar], [middle] * 2, color="black", linewidth=3, zorder=3)
    axes.text(west, top, f"{bar:g} m on the map", **text)
    if times:
        west = low[0] + 0.36 * width
        length = nice(ARROW_SHARE * width / times)
        _quiver(axes, np.array([[west, middle]]), np.array([[times * length, 0]]), "black", 0.02)
        axes.text(
            west, top, f"Residual of {length:g} m (arrows enlarged {times:,.0f} times)", **text
        )
    east = low[0] + 0.95 * width
    axes.annotate(
        "N",
        (east, low[1] + 0.9 * strip),
        xytext=(east, low[1] + 0.22 * strip),
        arrowprops={"arrowstyle": "-|>", "color": "black", "linewidth": 1.4},
        horizontalalignment="center",
        verticalalignment="center",
        fontweight="bold",
        zorder=4,
    )


def _legend(rows, arrows, times, short):
    """Legend entries of what is really drawn."""
    handles = [Line2D([], [], label="Trajectory (corrected)", **TRACK)]
    words = {"control": "Control point", "check": "Check point", "unused": "Not used"}
    for role, text in words.items():
        if ordered(rows, role):
            handles.append(Line2D([], [], linestyle="none", label=text, **MARKS[role]))
    if times:
        hidden = f" ({short} of {len(arrows)} too short to show)" if short else ""
        for text, color in (("Residual before", BEFORE), (f"Residual after{hidden}", AFTER)):
            handles.append(Line2D([], [], color=color, linewidth=2.5, label=text))
    return handles
