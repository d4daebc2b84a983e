"""Maps: trajectory, targets with horizontal residuals as arrows, and tie features.

Both have panels in equal scales, with whole meters as tick labels.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, MaxNLocator

from mlscorr.correction import Correction
from mlscorr.estimate import TieResiduals
from mlscorr.report.correction_report import GROUPS, CorrectionReport, array, ordered
from mlscorr.report.render import colour_table
from mlscorr.report.settings import SETTINGS
from mlscorr.report.style import (
    AFTER,
    BEFORE,
    MARKS,
    TRACK,
    break_at_gaps,
    label,
    legend_above,
    mark_handles,
    new_figure,
    nice,
    styled,
    thin,
)
from mlscorr.survey import Ties, Trajectory
from mlscorr.wording import thousands

STATES = ("Before the correction", "After the correction")


@styled
def tie_figure(correction: Correction, residuals: TieResiduals) -> Figure:
    """Draw a plan of the ties, before and after, side by side or, for a long street, stacked.

    Parameters
    ----------
    correction : Correction
    residuals : TieResiduals
        Residuals of the ties after the correction.
    """
    states = dict(zip(STATES, (residuals.ties.misclosure, residuals.after), strict=True))
    words = "Trajectory (corrected)"
    return _tie_plan(correction.corrected, residuals.ties.place, residuals.used, states, words)


@styled
def search_figure(trajectory: Trajectory, ties: Ties, refused: Ties) -> Figure:
    """Draw a plan of the ties found by a search, and of the refused pairs.

    Parameters
    ----------
    trajectory : Trajectory
        Recorded trajectory.
    ties, refused : Ties
    """
    both = Ties.concatenate([ties, refused])
    used = np.arange(len(both)) < len(ties)
    states = {f"{len(ties)} ties, {len(refused)} pairs rejected": both.misclosure}
    return _tie_plan(trajectory, both.place, used, states, "Trajectory (recorded)")


def _tie_plan(trajectory, place, used, states, words):
    """Draw plans of positions (n, 2, 3) colored by misclosures (n,) of one or two states, in m."""
    path = track(trajectory)
    places = place.mean(axis=1)[:, :2]
    magnitudes = [1000 * np.abs(misclosure) for misclosure in states.values()]  # mm
    low, high = corners(np.vstack([path, places]), 0.1)
    figure, panels = map_panels(len(states), (high - low)[1] / (high - low)[0])
    figure.set_dpi(SETTINGS.dots_per_inch)
    largest = max(np.max(magnitude[used], initial=10.0) for magnitude in magnitudes)
    scale = {"norm": LogNorm(1.0, largest), "cmap": ListedColormap(colour_table("sigma") / 255)}
    for panel, magnitude, title in zip(panels, magnitudes, states, strict=True):
        panel.plot(*path.T, **TRACK, zorder=1)
        panel.plot(*places[~used].T, linestyle="none", zorder=2, rasterized=True, **MARKS["unused"])
        front = np.flatnonzero(used)[np.argsort(magnitude[used], kind="stable")]  # the worst on top
        dots = panel.scatter(
            *places[front].T,
            9,
            np.maximum(magnitude[front], 1.0),
            linewidths=0,
            zorder=3,
            rasterized=True,
            **scale,
        )
        frame(panel, low, high, 4)
        panel.set_title(title)
        panel.label_outer()
    bar = figure.colorbar(dots, ax=panels, pad=0.01, extend="min", format="%g")
    bar.set_label("Misclosure of tie features (mm)")
    legend_above(figure, _kinds_legend(used, words))
    return figure


def _kinds_legend(used, words):
    """Legend entries of drawn items."""
    handles = [Line2D([], [], label=words, **TRACK)]
    dot = {"linestyle": "none", "marker": "o", "markersize": 3, "color": "#5b2a86"}
    if used.any():
        handles.append(Line2D([], [], label="Used", **dot))
    if not used.all():
        words = "Rejected: contradicts the others"
        handles.append(Line2D([], [], linestyle="none", label=words, **MARKS["unused"]))
    return handles


WORDS = {"control": "Control point", "check": "Check point", "unused": "Not used"}
NEXT: dict[str, Any] = {"color": "#009e73", "marker": "*", "markersize": 11.0}
NEXT |= {"linestyle": "none", "zorder": 6}
NEXT_WORDS = "Best positions for another control point"


@styled
def map_figure(correction: Correction, report: CorrectionReport) -> Figure:
    """Draw a plan of the trajectory and the targets with residual arrows before and after.

    Parameters
    ----------
    correction : Correction
    report : CorrectionReport
    """
    path = track(correction.corrected)
    driven = path[np.isfinite(path).all(axis=1)]
    margin = max(float(np.ptp(driven, axis=0).max()), 200.0) / 4  # m
    low = driven.min(axis=0) - margin
    high = driven.max(axis=0) + margin
    rows = [
        row
        for row in ordered(report.targets)
        if row.is_observed or np.all((row.surveyed[:2] >= low) & (row.surveyed[:2] <= high))
    ]
    outside = len(report.targets) - len(rows)
    points = np.vstack([driven, array(rows, "surveyed")[:, :2]])
    extent = max(float(np.ptp(points, axis=0).max()), 1.0)
    arrows = [row for row in ordered(rows, "control", "check") if row.is_observed]
    times = _enlargement(array(arrows, "before")[:, :2], extent)
    tips = array(arrows, "surveyed")[:, :2] + times * array(arrows, "before")[:, :2]
    low, high, strip = _bounds(np.vstack([points, tips]), extent)
    width, height = high - low
    figure = new_figure(1.25 + (SETTINGS.figure_width - 1.1) * height / width)
    axes = figure.add_subplot()
    axes.plot(*path.T, **TRACK)
    # hidden under its mark
    if times:
        short = _arrows(axes, arrows, times, 0.008 * width)
    else:
        short = 0
    for group in GROUPS[::-1]:
        places = array(ordered(rows, group), "surveyed")
        axes.plot(*places[:, :2].T, linestyle="none", **MARKS[group])
    names = {row.name: (row.surveyed[:2], -1 if row.before[0] > 0 else 1) for row in rows[::-1]}
    mark_places(axes, [(place.easting, place.northing) for place in report.next_control])
    write_names(axes, names, width)
    frame(axes, low, high)
    far = f" (far outside: {outside})" if outside else ""
    if report.targets:
        title = "Map of the targets"
    else:
        title = "The trajectory"
    axes.set_title(f"{title}{', with horizontal residuals' * bool(times)}{far}")
    _key(axes, low, high, strip, times)
    handles = _legend(rows, len(arrows), times, short)
    handles += [Line2D([], [], label=NEXT_WORDS, **NEXT)] * bool(report.next_control)
    legend_above(figure, handles, columns=2)
    return figure


def mark_places(axes: Axes, places: Sequence[tuple[float, float]]) -> None:
    """Number the positions for further control points, best first.

    Parameters
    ----------
    axes : Axes
        Axes of a map.
    places : sequence of (easting, northing)
        Units: m.
    """
    for number, place in enumerate(places, start=1):
        axes.plot(*place, **NEXT)
        axes.annotate(
            str(number),
            place,
            xytext=(6, 5),
            textcoords="offset points",
            color=NEXT["color"],
            fontsize=9,
            fontweight="bold",
            zorder=6,
        )


def _enlargement(residuals, extent):
    """Magnification of the arrows relative to the map: 1, 2, 5, 10, ...; 0 without arrows."""
    longest = np.hypot(*residuals.T).max(initial=0.0)
    if longest > 0:
        return nice(SETTINGS.longest_arrow * extent / longest)
    return 0.0


def _bounds(points, extent):
    """Lower left and upper right corner with a margin, and height of the strip at the bottom.

    The strip is kept free of data for the scale bar and the north arrow.
    """
    low = points.min(axis=0) - 0.06 * extent
    high = points.max(axis=0) + 0.06 * extent
    size = high - low
    extent_drawn = np.maximum(size, [size[1], 0.4 * size[0]])
    low = low - (extent_drawn - size) / 2
    high = high + (extent_drawn - size) / 2
    strip = 0.11 * extent_drawn[0]
    return low - [0.0, strip], high, strip


def _arrows(axes, rows, times, shortest):
    """Draw horizontal residuals from the surveyed position, wide before and thin after.

    Return the number of arrows after the correction that are too short to draw.
    """
    place = array(rows, "surveyed")[:, :2]
    for name, color, width in (("before", BEFORE, 0.026), ("after", AFTER, 0.018)):
        residual = times * array(rows, name)[:, :2]
        long = np.hypot(*residual.T) > shortest
        _quiver(axes, place[long], residual[long], color, width)
    return int((~long).sum())


def _quiver(axes, place, vector, color, width):
    symbol = {"units": "inches", "angles": "xy", "scale_units": "xy", "scale": 1.0, "zorder": 3}
    heads = {"headwidth": 4.5, "headlength": 5.0}
    axes.quiver(*place.T, *vector.T, color=color, width=width, **symbol, **heads)


def write_names(axes: Axes, names: Mapping[str, tuple[Any, int]], width: float) -> None:
    """Write each target's name next to its mark, unless it would cover another name.

    Parameters
    ----------
    axes : Axes
        Axes of a map, with its stars; a name avoids stars and names by using the other side.
    names : mapping
        Name to easting and northing (m), and 1 for a name right of the mark, -1 for left.
    width : float
        Width of a whole figure on the map. Units: m.
    """
    # m on the map
    taken = []
    letter = np.array([0.0105, 0.018]) * width
    places = [line.get_xydata() for line in axes.lines if line.get_marker() == NEXT["marker"]]
    stars = [[*np.ravel(place) + letter[1] / 4, *letter[[1, 1]]] for place in places]
    for name, (place, side) in names.items():
        text = label(name)
        half = letter * [len(text) / 2, 0.5]
        boxes = {
            s: [*np.add(place, [s * (half[0] + letter[0]), 0.0]), *half] for s in (side, -side)
        }
        free = [s for s in boxes if not _covers(boxes[s], [*stars, *taken])]
        if not free:
            continue
        taken.append(boxes[free[0]])
        axes.annotate(
            text,
            place,
            xytext=(6 * free[0], 0),
            textcoords="offset points",
            horizontalalignment="left" if free[0] > 0 else "right",
            verticalalignment="center",
            fontsize=7,
            parse_math=False,
            zorder=5,
        )


def _covers(box, others):
    """True if a box (middle and half its size) covers any others."""
    others = np.reshape(others, (-1, 4))
    return (np.abs(others[:, :2] - box[:2]) < others[:, 2:] + box[2:]).all(axis=1).any()


def _key(axes, low, high, strip, times):
    """Draw scale bar, arrow scale and north arrow in the free strip at the bottom."""
    width = high[0] - low[0]
    axes.axhspan(low[1], low[1] + strip, color="white", zorder=2.5)
    axes.axhline(low[1] + strip, color="#bbbbbb", linewidth=0.6, zorder=2.6)
    middle = low[1] + 0.35 * strip
    top = low[1] + 0.62 * strip
    text = {"horizontalalignment": "left", "verticalalignment": "center", "fontsize": 8.5}
    bar = nice(0.22 * width)
    west = low[0] + 0.03 * width
    axes.plot([west, west + bar], [middle] * 2, color="black", linewidth=3, zorder=3)
    axes.text(west, top, f"{bar:g} m on the map", **text)
    if times:
        west = low[0] + 0.36 * width
        length = nice(SETTINGS.longest_arrow * width / times)
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
    """Legend entries of drawn items."""
    handles = [Line2D([], [], label="Trajectory (corrected)", **TRACK)]
    handles += mark_handles(WORDS, {row.group for row in rows})
    if times:
        if short:
            hidden = f" ({short} of {arrows} too short to show)"
        else:
            hidden = ""
        colours = {"Residual before": BEFORE, f"Residual after{hidden}": AFTER}
        for text, color in colours.items():
            handles.append(Line2D([], [], color=color, linewidth=2.5, label=text))
    return handles


def map_panels(count: int, share: float) -> tuple[Figure, np.ndarray]:
    """Make a figure with panels (count,), side by side or, for a long street, stacked.

    Parameters
    ----------
    count : int
        Number of maps of the same area: one or two.
    share : float
        Ratio of height to width.
    """
    columns = 2 if share > 0.7 and count > 1 else 1
    # inch: labels and colors
    lines = count // columns
    label_width = 1.8
    width = SETTINGS.figure_width / columns - label_width
    figure = new_figure(0.8 + lines * (0.35 + width * share))
    return figure, figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False).ravel()


def track(trajectory: Trajectory) -> np.ndarray:
    """Thinned plan positions (m, 2) of a trajectory, with NaN at its gaps. Units: m.

    Parameters
    ----------
    trajectory : Trajectory
    """
    plan = trajectory.position[:, :2]
    rows = thin(plan, trajectory.gps_time, trajectory.gaps)
    return break_at_gaps(trajectory.gps_time[rows], trajectory.gaps, plan[rows])[1]


def corners(points: np.ndarray, thinnest: float) -> tuple[np.ndarray, np.ndarray]:
    """Lower left and upper right corner (2,) of a map of points, with a margin. Units: m.

    Parameters
    ----------
    points : (n, 2) array
        NaN if unknown. Units: m.
    thinnest : float
        Smallest half width of the map over its length, so that it is not a thin line.
    """
    low = np.nanmin(points, axis=0)
    high = np.nanmax(points, axis=0)
    extent = max(float((high - low).max()), 1.0)
    middle = (low + high) / 2
    half = np.maximum((high - low) / 2, thinnest * extent) + 0.04 * extent
    return middle - half, middle + half


def frame(axes: Axes, low: np.ndarray, high: np.ndarray, ticks: int = 5) -> None:
    """Set limits, equal scale on both axes, and whole meters as tick labels.

    Parameters
    ----------
    axes : Axes
    low, high : (2,) array
        Corners. Units: m.
    ticks : int
        Largest number of intervals of an axis.
    """
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal")
    for axis, name in ((axes.xaxis, "Easting (m)"), (axes.yaxis, "Northing (m)")):
        axis.set_major_locator(MaxNLocator(ticks, steps=[1, 2, 5, 10], min_n_ticks=2))
        decimals = 0 if np.ptp(axis.get_view_interval()) > 5 else 1
        metres = FuncFormatter(lambda v, _, d=decimals: thousands(v, d))
        axis.set_major_formatter(metres)
        axis.set_label_text(name)
