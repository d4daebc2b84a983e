"""Location of the gap, and its reduction: figures with the band of chance."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from mlscorr.gap.evidence import SETTINGS as INFERENCE
from mlscorr.report.gap._innovations import WINDOW
from mlscorr.report.gap._rows import numbers, split_title
from mlscorr.report.gap._settings import SETTINGS
from mlscorr.report.style import AFTER, BEFORE, GREY, label, legend_above, new_figure, styled
from mlscorr.wording import percent

BAND = "#dcdcdc"


@styled
def where_figure(document: dict) -> Figure:
    """Draw the gap by each covariate, before and after, over the band of chance. Units: mm.

    Parameters
    ----------
    document : dict
        Contents of gap.json.
    """
    splits = document["where"]
    columns = 3
    rows = -(-len(splits) // columns)
    figure = new_figure(0.6 + 1.75 * rows)
    panels = figure.subplots(rows, columns, sharey=True, squeeze=False)
    label = document["verdict"]["label"]
    is_explained = any(c["rms_mm"] for c in document["causes"] if c["effect"] == label)
    for panel, split in zip(panels.flat, splits, strict=False):
        _split(panel, split, is_explained)
    for panel in panels.flat[len(splits) :]:
        panel.set_visible(False)
    for panel in panels[:, 0]:
        panel.set_ylabel("Gap (mm)")
    panels[0, 0].set_ylim(*_limits(splits))
    lines = (
        Line2D([], [], color=BEFORE, linewidth=2.2, label="Before"),
        Line2D([], [], color=AFTER, linewidth=2.2, linestyle="--", label="After"),
    )
    acts = [Patch(color=WINDOW, label="Interval in which the cause acts")]
    legend_above(figure, _legend(*lines) + acts * any(split.get("extent") for split in splits))
    return figure


def _limits(splits):
    """Lower and upper limit of all panels, with space for a number above."""
    values = [numbers(split[key]) for split in splits for key in ("before", "after")]
    values = np.concatenate([[0.0], *values, *(_band(split).ravel() for split in splits)])
    low = np.nanmin(values)
    high = np.nanmax(values)
    extent = max(high - low, 1.0)
    return low - 0.06 * extent, high + 0.16 * extent


def _band(split):
    """Lower and upper ends (2, n) of the null band."""
    return np.reshape([numbers(band) for band in split["null_band"]], (-1, 2)).T


def _legend(*before_after):
    """Legend entries of before, after and the null band."""
    return [*before_after, Patch(color=BAND, label="Without any error (95 %)")]


def _split(panel, split, is_explained):
    n = len(split["count"])
    has_edges = split.get("edges") is not None
    if has_edges:
        edges = numbers(split["edges"])
    else:
        edges = np.arange(n + 1.0) - 0.5
    low, high = _band(split)
    panel.stairs(high, edges, baseline=low, fill=True, color=BAND, zorder=1)
    panel.axhline(0.0, color=GREY, linewidth=0.7, zorder=2)
    _draw_extent(panel, split, edges)
    for key, color, style in (("before", BEFORE, "-"), ("after", AFTER, "--")):
        values = numbers(split[key])
        panel.hlines(values, edges[:-1], edges[1:], color=color, linestyle=style, lw=2.2, zorder=4)
        panel.stairs(values, edges, baseline=None, color=color, lw=0.6, alpha=0.6, zorder=3)
    _write_share(panel, split, edges, high, is_explained)
    panel.set_title(split_title(split), fontsize=8.5)
    panel.grid(axis="x", visible=False)
    if not has_edges:
        names = [label(str(name).replace("_", " "), 12) for name in split["bins"]]
        panel.set_xticks(range(n), names, fontsize=7.5, parse_math=False)
    panel.margins(x=0.01)


def _draw_extent(panel, split, edges):
    """Draw the interval in which the cause acts, if its share exceeds that of its rows."""
    extent = split.get("extent")
    if extent and extent["share"] > INFERENCE.plain * extent["rows"]:
        turns = (0.0, 360.0) if split["by"] == "scan_angle" else (0.0,)
        for turn in turns:  # an angle may be given in the next turn
            low = max(extent["low"] - turn, edges[0])
            high = min(extent["high"] - turn, edges[-1])
            if low < high:
                panel.axvspan(low, high, color=WINDOW, zorder=0.5)


def _write_share(panel, split, edges, high, is_explained):
    """Write the share of a bin that exceeds that of its rows: of the explained part, or of a
    significant gap.
    """
    count, share, before = (numbers(split[key]) for key in ("count", "share", "before"))
    of_rows = count / max(count.sum(), 1.0)
    plain = (share > INFERENCE.plain * of_rows) & (share > SETTINGS.least_share)
    plain &= is_explained | (before > high)
    if not plain.any():
        return
    i = int(np.argmax(np.where(plain, share - of_rows, -np.inf)))
    middle = edges[i : i + 2].mean()
    place = (middle - edges[0]) / (edges[-1] - edges[0])
    alignment = "center"
    if place < 0.1:
        alignment = "left"
    elif place > 0.9:
        alignment = "right"
    panel.annotate(
        percent(min(share[i], 1.0)),
        (middle, np.nanmax([before[i], high[i], 0.0])),
        xytext=(0, 3),
        textcoords="offset points",
        fontsize=7.5,
        zorder=5,
        horizontalalignment=alignment,
    )


@styled
def closure_figure(document: dict) -> Figure:
    """Draw the gap on held-out data, if any, before and after: in total, and by block.

    Parameters
    ----------
    document : dict
        Contents of gap.json.
    """
    closure = document["closure"]
    figure = new_figure(2.7)
    whole, each = figure.subplots(1, 2, width_ratios=[1, 2.4])
    _whole(whole, closure)
    whole.set_title("All held-out data" if closure["is_held_out"] else "All data")
    whole.set_ylabel(f"Gap ({closure['unit']})")
    _folds(each, closure["folds"] if closure["is_held_out"] else [])
    bars = Patch(color=BEFORE, label="Before"), Patch(color=AFTER, label="After")
    legend_above(figure, _legend(*bars))
    return figure


def _whole(panel, closure):
    low, high = numbers(closure["null_band"])
    if np.isfinite([low, high]).all():
        panel.axhspan(low, high, color=BAND, zorder=0)
    values = numbers([closure["before"], closure["after"]])
    panel.bar([0, 1], values, width=0.6, color=[BEFORE, AFTER], zorder=2)
    ends = _interval(closure)
    if np.isfinite(ends).all():
        ends = np.abs(ends[:, None] - values[1])
        panel.errorbar([1], values[1:], ends, color="black", capsize=4, linewidth=1.2, zorder=3)
    for place, value in enumerate(values):
        if np.isfinite(value):
            panel.annotate(
                f"{value:.1f}",
                (place, max(value, 0.0)),
                xytext=(-14, 3),
                fontsize=8,
                textcoords="offset points",
                horizontalalignment="center",
                zorder=4,
            )
    panel.axhline(0.0, color=GREY, linewidth=0.7, zorder=1)
    panel.set_xticks([0, 1], ["Before", "After"])
    panel.margins(y=0.15)
    panel.grid(axis="x", visible=False)


def _interval(closure):
    """95 % interval (2,) of the gap after, from that of the removed share; it contains the gap."""
    before, after, *shares = numbers([closure["before"], closure["after"], *closure["interval"]])
    square = np.sign(before) * before**2 * (1 - np.array(shares))
    ends = np.sort(np.sign(square) * np.sqrt(np.abs(square)))
    return np.array([np.minimum(ends[0], after), np.maximum(ends[1], after)])


def _folds(panel, folds):
    """Before and after of each held-out part of the data."""
    places = np.arange(len(folds))
    for key, color, shift in (("before", BEFORE, -0.2), ("after", AFTER, 0.2)):
        panel.bar(places + shift, numbers(f[key] for f in folds), width=0.36, color=color, zorder=2)
    panel.axhline(0.0, color=GREY, linewidth=0.7)
    panel.set_xlabel("Block of held-out data")
    places = places[:: 1 + len(folds) // 10]
    panel.set_xticks(places, [str(place + 1) for place in places], fontsize=7.5)
    panel.set_title("Each held-out block")
    panel.grid(axis="x", visible=False)
    panel.set_visible(bool(folds))
