"""The innovations over time: what each row tells that all before it did not predict."""

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from mlscorr.report.gap_figures import numbers
from mlscorr.report.look import (
    BLACK,
    GREEN,
    GREY,
    ORANGE,
    SKY,
    VERMILLION,
    legend_above,
    new_figure,
    styled,
)

SIGMAS = 2.0
EXPECTED = 4.55  # percent of a normal distribution outside of two sigmas
REACH = (3.0, 6.0)  # sigmas shown at least and at most; what lies beyond is drawn at the edge
PAUSE = 15.0  # s without a row, which at the least separate two passes
LONG = 20.0  # times the usual step between rows, likewise
MOST_PASSES = 6  # beside each other
WINDOW, STRIPE = "#f3d9e6", "#efefef"
CHANNELS = {  # colour, mark, words
    "target": (BLACK, "o", "Targets"),
    "surface": (SKY, "s", "Surfaces against the reference"),
    "shared": (GREEN, "^", "Surfaces seen in two passes"),
    "roughness": (ORANGE, "D", "Roughness"),
    "return_rate": (VERMILLION, "v", "Return rate"),
}


def look_of(channel):
    """Colour, mark and words of a channel."""
    return CHANNELS.get(channel, (GREY, "x", channel.replace("_", " ").capitalize()))


def passes_of(gps_time):
    """Start and end (k, 2) of the stretches in which rows were seen, in their order.

    >>> passes_of(np.array([0.0, 1.0, 2.0, 300.0, 301.0]))
    array([[  0.,   2.],
           [300., 301.]])
    """
    time = np.sort(gps_time[np.isfinite(gps_time)])
    if len(time) == 0:
        return np.empty((0, 2))
    steps = np.diff(time)
    usual = np.median(steps[steps > 0]) if (steps > 0).any() else 0.0
    cut = np.flatnonzero(steps > max(PAUSE, LONG * usual)) + 1
    return np.array([[part[0], part[-1]] for part in np.split(time, cut)])


@styled
def innovations_figure(document):
    """Innovations before (top) and after (bottom), each pass in a panel of its own."""
    told = document["innovations"]
    time = numbers(told["gps_time"])
    passes = passes_of(time)
    if len(passes) > MOST_PASSES:
        passes = np.array([[passes[0, 0], passes[-1, 1]]])
    long = np.maximum(np.diff(passes)[:, 0], 0.12 * np.diff(passes).max())
    figure = new_figure(4.6)
    figure.set_dpi(180)  # of the marks, which are drawn as a picture
    panels = figure.subplots(
        2, len(passes), sharey=True, sharex="col", squeeze=False, width_ratios=np.maximum(long, 1)
    )
    channel = np.array(told["channel"], dtype=str)
    largest = np.nanmax(np.abs([numbers(told[key]) for key in ("before", "after")]), initial=0.0)
    reach = float(np.clip(largest, *REACH))
    shown = list(dict.fromkeys(told["channel"]))
    for row, key in zip(panels, ("before", "after"), strict=True):
        values = numbers(told[key])
        for panel, (start, end) in zip(row, passes, strict=True):
            here = (time >= start) & (time <= end)
            _panel(panel, time[here] - start, values[here], channel[here], shown, reach)
            panel.margins(x=0.02)
            _windows(panel, document["windows"], start, end)
        row[0].set_ylabel("Innovation (sigma)")
        row[0].set_title(f"{key.capitalize()}: {_outside(values)}")
    for number, (panel, (start, _)) in enumerate(zip(panels[1], passes, strict=True)):
        which = f"Pass {number + 1}: " if len(passes) > 1 else ""
        panel.set_xlabel(
            f"{which}s after {start:.0f}" if which else f"s after gps_time {start:.0f} s"
        )
    legend_above(figure, _legend(shown, document["windows"]))
    return figure


def _panel(panel, time, values, channel, shown, reach):
    panel.axhspan(-SIGMAS, SIGMAS, color=STRIPE, zorder=0.5)
    panel.axhline(0.0, color=GREY, linewidth=0.7, zorder=1)
    for line in (-SIGMAS, SIGMAS):
        panel.axhline(line, color=GREY, linewidth=0.7, linestyle="--", zorder=1)
    for name in shown:
        color, mark, _ = look_of(name)
        mine = channel == name
        size = 4.0 if name == "target" else 2.2
        panel.plot(
            time[mine], np.clip(values[mine], -reach, reach), mark, color=color, markersize=size,
            markeredgewidth=0, alpha=0.75, rasterized=True, zorder=4 if name == "target" else 3,
        )  # fmt: skip
    panel.set_ylim(-1.05 * reach, 1.05 * reach)


def _outside(values):
    """How many innovations lie beyond two sigmas, in words."""
    values = values[np.isfinite(values)]
    if len(values) == 0:
        return "nothing to show"
    share = 100 * np.mean(np.abs(values) > SIGMAS)
    return f"{share:.1f} % beyond ±2 sigma ({EXPECTED:.1f} % when nothing is wrong)"


def _windows(panel, windows, start, end):
    for one in windows:
        low, high = numbers([one["start"], one["end"]])
        if low <= end and high >= start:
            panel.axvspan(max(low, start) - start, min(high, end) - start, color=WINDOW, zorder=0)
            for edge in (low, high):
                if start <= edge <= end:
                    panel.axvline(edge - start, color="#a03a6b", linewidth=1.0, zorder=2)


def _legend(shown, windows):
    handles = [
        Line2D([], [], linestyle="none", marker=look[1], color=look[0], markersize=4, label=look[2])
        for look in map(look_of, shown)
    ]
    handles.append(Patch(color=STRIPE, label="±2 sigma"))
    if windows:
        handles.append(Patch(color=WINDOW, label="When the effect acts"))
    return handles
