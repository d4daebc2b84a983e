"""Innovations over time and on the map: the new information of each row."""

from math import erfc, sqrt
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from mlscorr.report import style
from mlscorr.report.gap._rows import numbers
from mlscorr.report.gap._settings import SETTINGS
from mlscorr.report.maps import (
    NEXT,
    NEXT_WORDS,
    WORDS,
    corners,
    frame,
    map_panels,
    mark_places,
    write_names,
)
from mlscorr.report.style import GREY, MARKS, TRACK, legend_above, mark_handle, styled
from mlscorr.wording import percent

WINDOW = "#f3d9e6"
STRIPE = "#efefef"


class ChannelStyle(NamedTuple):
    """Style and name of the rows of a channel."""

    color: str
    mark: str
    words: str


CHANNELS = {
    "target": ChannelStyle(style.BLACK, "o", "Targets"),
    "surface": ChannelStyle(style.SKY, "s", "Surfaces against the reference"),
    "shared": ChannelStyle(style.GREEN, "^", "Surfaces scanned in two passes"),
    "roughness": ChannelStyle(style.ORANGE, "D", "Roughness"),
    "return_rate": ChannelStyle(style.VERMILLION, "v", "Return rate"),
}


def channel_style(channel: str) -> ChannelStyle:
    """Color, mark and words of a channel.

    Parameters
    ----------
    channel : str
        Channel of the rows.
    """
    return CHANNELS.get(
        channel, ChannelStyle(style.GREY, "x", channel.replace("_", " ").capitalize())
    )


def passes_of(gps_time: np.ndarray) -> np.ndarray:
    """Start and end (k, 2) of the intervals with rows, sorted.

    Parameters
    ----------
    gps_time : (n,) array
        In any order; NaN is ignored. Units: s.

    >>> passes_of(np.array([0.0, 1.0, 2.0, 300.0, 301.0]))
    array([[  0.,   2.],
           [300., 301.]])
    """
    time = np.sort(gps_time[np.isfinite(gps_time)])
    if len(time) == 0:
        return np.empty((0, 2))
    steps = np.diff(time)
    if (steps > 0).any():
        usual = np.median(steps[steps > 0])
    else:
        usual = 0.0
    cut = np.flatnonzero(steps > max(SETTINGS.row_gap, SETTINGS.row_gap_steps * usual)) + 1
    return np.array([[part[0], part[-1]] for part in np.split(time, cut)])


@style.styled
def innovations_figure(document: dict) -> Figure:
    """Draw innovations before (top) and after (bottom), with one panel per pass.

    Parameters
    ----------
    document : dict
        Contents of gap.json.
    """
    rows = document["innovations"]
    windows = document["windows"]
    time = numbers(rows["gps_time"])
    channel = np.array(rows["channel"], dtype=str)
    values = {key: numbers(rows[key]) for key in ("before", "after")}
    styles = {name: channel_style(name) for name in dict.fromkeys(rows["channel"])}
    passes = passes_of(time)
    if len(passes) > SETTINGS.panels:
        passes = np.array([[passes[0, 0], passes[-1, 1]]])
    width = np.maximum(np.diff(passes)[:, 0], 0.12 * np.diff(passes).max())
    figure = style.new_figure(4.6)
    figure.set_dpi(180)  # of the marks, which are rasterized
    panels = figure.subplots(
        2, len(passes), sharey=True, sharex="col", squeeze=False, width_ratios=np.maximum(width, 1)
    )
    largest = np.nanmax(np.abs([*values.values()]), initial=0.0)
    limit = float(np.clip(largest, *SETTINGS.drawn_sigmas))
    for row, key in zip(panels, values, strict=True):
        for panel, (start, end) in zip(row, passes, strict=True):
            inside = (time >= start) & (time <= end)
            _draw(panel, time[inside] - start, values[key][inside], channel[inside], styles, limit)
            _draw_windows(panel, windows, start, end)
        row[0].set_ylabel("Innovation (sigma)")
        row[0].set_title(f"{key.capitalize()}: {_outside(values[key])}")
    for number, (panel, (start, _)) in enumerate(zip(panels[1], passes, strict=True), start=1):
        text = f"s after gps_time {start:.0f} s"
        panel.set_xlabel(f"Pass {number}: s after {start:.0f}" if len(passes) > 1 else text)
    style.legend_above(figure, _legend(styles, windows))
    return figure


def _draw(panel, time, values, channel, styles, limit):
    stripe = SETTINGS.stripe_sigmas
    panel.axhspan(-stripe, stripe, color=STRIPE, zorder=0.5)
    panel.axhline(0.0, color=style.GREY, linewidth=0.7, zorder=1)
    for line in (-stripe, stripe):
        panel.axhline(line, color=style.GREY, linewidth=0.7, linestyle="--", zorder=1)
    for name, symbol in styles.items():
        rows = channel == name
        is_target = name == "target"
        panel.plot(
            time[rows],
            np.clip(values[rows], -limit, limit),
            symbol.mark,
            color=symbol.color,
            markersize=4.0 if is_target else 2.2,
            markeredgewidth=0,
            alpha=0.75,
            rasterized=True,
            zorder=4 if is_target else 3,
        )
    panel.set_ylim(-1.05 * limit, 1.05 * limit)
    panel.margins(x=0.02)


def _outside(values):
    """RMS of the innovations, and number outside the stripe, in words."""
    values = values[np.isfinite(values)]
    stripe = SETTINGS.stripe_sigmas
    if len(values) == 0:
        return "nothing to show"
    share = np.mean(np.abs(values) > stripe)
    usual = erfc(stripe / sqrt(2))
    rms = np.sqrt(np.mean(values**2))
    beyond = f"{percent(share, 1)} beyond ±{stripe:.0f} sigma ({percent(usual, 1)})"
    return f"RMS {rms:.2f} (expected 1), {beyond}"


def _draw_windows(panel, windows, start, end):
    for window in windows:
        low, high = numbers([window["start"], window["end"]])
        if low <= end and high >= start:
            panel.axvspan(max(low, start) - start, min(high, end) - start, color=WINDOW, zorder=0)
            for edge in (low, high):
                if start <= edge <= end:
                    panel.axvline(edge - start, color="#a03a6b", linewidth=1.0, zorder=2)


def _legend(styles, windows):
    handles = [style.mark_handle(s.mark, s.color, s.words, size=4) for s in styles.values()]
    handles.append(Patch(color=STRIPE, label=f"±{SETTINGS.stripe_sigmas:.0f} sigma"))
    if windows:
        handles.append(Patch(color=WINDOW, label="Interval in which the effect acts"))
    return handles


@styled
def site_map(document: dict) -> Figure:
    """Draw a plan with rows colored by innovation, before and after side by side.

    Parameters
    ----------
    document : dict
        Contents of gap.json, or of plan.json, which has no rows yet.
    """
    site = document["map"]
    rows = site.get("rows") or []
    states = ("before", "after") if rows else (None,)
    places = [place[:2] for place in site["trajectory"]]
    places += [row["position"][:2] for row in (*site["targets"], *rows)]
    points = [numbers(place) for place in places] or [np.zeros(2), np.ones(2)]
    low, high = corners(np.array(points), 0.12)
    figure, panels = map_panels(len(states), np.clip((high - low)[1] / (high - low)[0], 0.25, 1.6))
    figure.set_dpi(180)
    for panel, state in zip(panels, states, strict=True):
        colours = _draw_state(panel, site, rows, state)
        names = {target["name"]: (target["position"][:2], 1) for target in site["targets"]}
        write_names(panel, names, (high - low)[0] / panel.get_position().width)
        frame(panel, low, high, 4)
        panel.tick_params(labelsize=7.5)
        panel.label_outer()
    if rows:
        bar = figure.colorbar(colours, ax=panels, shrink=0.8, pad=0.01, extend="both")
        bar.set_label("Innovation (sigma)")
    legend_above(figure, _map_legend(panels[0], site, rows))
    return figure


def _draw_state(panel, site, rows, state):
    """Draw one state; return the object of the color scale, if there is one."""
    track = np.array([numbers(place[:2]) for place in site["trajectory"]]).reshape(-1, 2)
    panel.plot(*_parted(track).T, **TRACK, zorder=1, label="Trajectory")
    colours = None
    limit = SETTINGS.map_sigmas
    for channel in dict.fromkeys(row["channel"] for row in rows):
        part = [row for row in rows if row["channel"] == channel]
        place = np.array([row["position"][:2] for row in part])
        values = [r[state] for r in part]
        values = numbers(values)
        is_target = channel == "target"
        front = np.argsort(np.abs(np.nan_to_num(values)), kind="stable")
        colours = panel.scatter(
            *place[front].T,
            26 if is_target else 9,
            values[front],
            vmin=-limit,
            vmax=limit,
            marker=channel_style(channel).mark,
            cmap="RdYlBu_r",
            rasterized=True,
            zorder=3,
            edgecolors="#444444" if is_target else "#999999",
            linewidths=0.5 if is_target else 0.15,
        )
    _draw_targets(panel, site["targets"])
    mark_places(panel, [place[:2] for place in site.get("next_control") or []])
    if state is not None:
        panel.set_title(state.capitalize())
    return colours


def _parted(track):
    """Track with NaN at its jumps, so that no line connects passes."""
    step = np.hypot(*np.diff(track, axis=0).T)
    if (step > 0).any():
        usual = np.median(step[step > 0])
    else:
        usual = np.inf
    leaps = np.flatnonzero(step > SETTINGS.row_gap_steps * usual)
    return np.insert(track, leaps + 1, np.nan, axis=0)


def _draw_targets(panel, targets):
    for role, words in WORDS.items():
        places = [target["position"][:2] for target in targets if target["role"] == role]
        if places:
            symbol = MARKS[role] | {"markerfacecolor": "none", "markersize": 8}
            panel.plot(*np.array(places).T, linestyle="none", zorder=4, label=words, **symbol)


def _map_legend(panel, site, rows):
    handles = panel.get_legend_handles_labels()[0]
    handles += [Line2D([], [], label=NEXT_WORDS, **NEXT)] * bool(site.get("next_control"))
    kinds = map(channel_style, dict.fromkeys(row["channel"] for row in rows))
    return handles + [mark_handle(kind.mark, GREY, kind.words, size=4) for kind in kinds]
