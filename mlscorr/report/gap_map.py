"""The map of a diagnosis: trajectory, targets, and each row coloured by its innovation."""

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, MaxNLocator

from mlscorr.report.gap_figures import numbers
from mlscorr.report.gap_timeline import look_of
from mlscorr.report.look import GREY, MARKS, SKY, WIDTH, label, legend_above, new_figure, styled
from mlscorr.report.plan import TRACK

REACH = 4.0  # sigmas at the ends of the colours
GAP = 30.0  # times the usual step of the trajectory, across which no line is drawn
MOST_NAMES = 40
MARGIN = 1.8  # inch beside a plan: its labels and the colours
TALLEST = 1.6  # times its width, that a panel is high at most
WORDS = {"control": "Control point", "check": "Check point", "unused": "Not used"}


@styled
def gap_map(document):
    """Plan with the rows coloured by innovation, before and after side by side."""
    found = document["map"]
    rows = [row for row in found.get("rows") or [] if row.get("position")]
    states = ("before", "after") if rows and "before" in rows[0] else (None,)
    low, high = _bounds(found, rows)
    share = np.clip((high - low)[1] / (high - low)[0], 0.25, TALLEST)
    beside = share > 0.7 and len(states) == 2
    width = WIDTH / 2 if beside else WIDTH
    stacked = 1 if beside else len(states)
    figure = new_figure(0.8 + stacked * (0.35 + (width - MARGIN) * share))
    figure.set_dpi(180)
    panels = figure.subplots(
        stacked, len(states) if beside else 1, sharex=True, sharey=True, squeeze=False
    ).ravel()
    shown = None
    for panel, state in zip(panels, states, strict=True):
        shown = _plan(panel, found, rows, state) or shown
        panel.set_xlim(low[0], high[0])
        panel.set_ylim(low[1], high[1])
        panel.set_aspect("equal")
        _axes(panel)
    if shown is not None:
        bar = figure.colorbar(shown, ax=panels, shrink=0.8, pad=0.01, extend="both")
        bar.set_label("Innovation (sigma)")
    legend_above(figure, _legend(found, rows))
    return figure


def _bounds(found, rows):
    """Lower left and upper right corner of all that is drawn, with a margin. Units: m."""
    places = [one[:2] for one in found["trajectory"] if one]
    places += [one["position"][:2] for one in found["targets"] if one["position"]]
    places += [one["position"][:2] for one in rows]
    points = np.array([numbers(one) for one in places] or [[0.0, 0.0], [1.0, 1.0]])
    low, high = np.nanmin(points, axis=0), np.nanmax(points, axis=0)
    extent = max(float((high - low).max()), 1.0)
    middle, half = (low + high) / 2, np.maximum((high - low) / 2, 0.12 * extent)
    return middle - half - 0.04 * extent, middle + half + 0.04 * extent


def _plan(panel, found, rows, state):
    """Draw one state; returns what the colours are of, if there are any."""
    track = np.array([numbers(one[:2]) for one in found["trajectory"] if one]).reshape(-1, 2)
    panel.plot(*_broken(track).T, **TRACK, zorder=1)
    shown = None
    for channel in dict.fromkeys(row["channel"] for row in rows):
        mine = [row for row in rows if row["channel"] == channel]
        place = np.array([numbers(row["position"][:2]) for row in mine])
        mark = look_of(channel)[1]
        size = 26 if channel == "target" else 9
        if state is None:
            panel.scatter(*place.T, size, color=SKY, marker=mark, linewidths=0, rasterized=True)
            continue
        values = numbers([row[state] for row in mine])
        front = np.argsort(np.abs(np.nan_to_num(values)), kind="stable")
        shown = panel.scatter(
            *place[front].T, size, values[front], marker=mark, cmap="RdYlBu_r", vmin=-REACH,
            vmax=REACH, edgecolors="#444444" if channel == "target" else "#999999",
            linewidths=0.5 if channel == "target" else 0.15, rasterized=True, zorder=3,
        )  # fmt: skip
    _targets(panel, found["targets"])
    if state is not None:
        panel.set_title(state.capitalize())
    return shown


def _broken(track):
    """The track with NaN where it leaps, so that no line crosses from pass to pass."""
    step = np.hypot(*np.diff(track, axis=0).T)
    usual = np.median(step[step > 0]) if (step > 0).any() else np.inf
    return np.insert(track, np.flatnonzero(step > GAP * usual) + 1, np.nan, axis=0)


def _targets(panel, targets):
    for role in WORDS:
        place = [one["position"][:2] for one in targets if one["role"] == role and one["position"]]
        if place:
            look = MARKS[role] | {"markerfacecolor": "none", "markersize": 8}
            panel.plot(*np.array(place).T, linestyle="none", zorder=4, **look)
    for one in targets[:MOST_NAMES]:
        if one["position"]:
            panel.annotate(
                label(one["name"]), one["position"][:2], xytext=(5, 4), fontsize=6.5,
                textcoords="offset points", parse_math=False, zorder=5, annotation_clip=True,
            )  # fmt: skip


def _axes(panel):
    for axis, name in ((panel.xaxis, "Easting (m)"), (panel.yaxis, "Northing (m)")):
        axis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10], min_n_ticks=2))
        axis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:,.0f}".replace(",", " ")))
        axis.set_label_text(name)
        axis.set_tick_params(labelsize=7.5)
    panel.label_outer()


def _legend(found, rows):
    handles = [Line2D([], [], label="Trajectory", **TRACK)]
    for role, words in WORDS.items():
        if any(one["role"] == role for one in found["targets"]):
            look = MARKS[role] | {"markerfacecolor": "none", "markersize": 7}
            handles.append(Line2D([], [], linestyle="none", label=words, **look))
    for channel in dict.fromkeys(row["channel"] for row in rows):
        _, mark, words = look_of(channel)
        handles.append(
            Line2D([], [], linestyle="none", marker=mark, color=GREY, markersize=4, label=words)
        )
    return handles
