"""The innovations over time: what each row tells that all before it did not predict."""

from math import erfc, sqrt
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from mlscorr.report import style
from mlscorr.report.gap._settings import SETTINGS
from mlscorr.report.gap.numbers import numbers
from mlscorr.wording import percent

WINDOW = "#f3d9e6"
STRIPE = "#efefef"


class ChannelStyle(NamedTuple):
    """How the rows of a channel are drawn and called."""

    color: str
    mark: str
    words: str


CHANNELS = {
    "target": ChannelStyle(style.BLACK, "o", "Targets"),
    "surface": ChannelStyle(style.SKY, "s", "Surfaces against the reference"),
    "shared": ChannelStyle(style.GREEN, "^", "Surfaces seen in two passes"),
    "roughness": ChannelStyle(style.ORANGE, "D", "Roughness"),
    "return_rate": ChannelStyle(style.VERMILLION, "v", "Return rate"),
}


def channel_style(channel: str) -> ChannelStyle:
    """Colour, mark and words of a channel.

    Parameters
    ----------
    channel : str
        As rows have it.
    """
    return CHANNELS.get(
        channel, ChannelStyle(style.GREY, "x", channel.replace("_", " ").capitalize())
    )


def passes_of(gps_time: np.ndarray) -> np.ndarray:
    """Start and end (k, 2) of the stretches in which rows were seen, in their order.

    Parameters
    ----------
    gps_time : (n,) array
        In any order; NaN is left out. Units: s.

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
    """Innovations before (top) and after (bottom), each pass in a panel of its own.

    Parameters
    ----------
    document : dict
        The content of gap.json.
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
    figure.set_dpi(180)  # of the marks, which are drawn as a picture
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
    """RMS of the innovations, and how many lie outside of the stripe, in words."""
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
        handles.append(Patch(color=WINDOW, label="When the effect acts"))
    return handles
