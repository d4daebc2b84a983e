"""Figures of a diagnosis: where the gap lies, and how far it shrinks."""

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from mlscorr.report.look import (
    AFTER,
    BEFORE,
    GREY,
    label,
    legend_above,
    new_figure,
    styled,
)
from mlscorr.report.sizes import known

BAND = "#dcdcdc"
COLUMNS = 3
PLAIN = 1.3  # times its share of the rows, from which on a bin's share of the gap is written
LEAST_SHARE = 0.15
BY = {
    "time": "Time since the start",
    "location": "Way along the road",
    "range": "Distance from the scanner",
    "incidence": "Angle of incidence",
    "scan_angle": "Scan angle",
    "intensity": "Intensity, log10",
    "speed": "Speed",
    "turn_rate": "Turn rate, to the right",
    "pass": "Pass",
    "axis": "Axis",
    "channel": "What was compared",
}


def numbers(values):
    """Numbers of a document as an array, NaN where it has none."""
    return np.array([v if known(v) else np.nan for v in values], dtype=float)


def band_of(bands):
    """Lower and upper ends (2, n) of bands."""
    return np.array([numbers(band) for band in bands], dtype=float).reshape(-1, 2).T


def split_title(split):
    """What a split of the gap is by, in words with its unit."""
    logarithm = split["by"] == "intensity"  # which has no unit that would tell a reader more
    unit = f" ({split['unit']})" if split["unit"] and not logarithm else ""
    return BY.get(split["by"], split["name"] or split["by"]) + unit


@styled
def where_figure(document):
    """The gap by each covariate, before and after, over what chance makes it. Units: mm."""
    splits = document["where"]
    rows = -(-len(splits) // COLUMNS)
    figure = new_figure(0.6 + 1.75 * rows)
    panels = figure.subplots(rows, COLUMNS, sharey=True, squeeze=False)
    explained = any(cause["rms_mm"] for cause in document["causes"] if is_chosen(cause, document))
    for panel, split in zip(panels.flat, splits, strict=False):
        _split(panel, split, explained)
    for panel in panels.flat[len(splits) :]:
        panel.set_visible(False)
    for panel in panels[:, 0]:
        panel.set_ylabel("Gap (mm)")
    panels[0, 0].set_ylim(*_limits(splits))
    lines = (
        Line2D([], [], color=BEFORE, linewidth=2.2, label="Before"),
        Line2D([], [], color=AFTER, linewidth=2.2, linestyle="--", label="After"),
    )
    legend_above(figure, _legend(*lines))
    return figure


def is_chosen(cause, document):
    """Whether a cause is the verdict's."""
    return cause["effect"] == document["verdict"]["label"]


def _limits(splits):
    """Lower and upper end of what all panels show, with room for a number above."""
    shown = [numbers(split[key]) for split in splits for key in ("before", "after")]
    shown += [band_of(split["null_band"]).ravel() for split in splits]
    values = np.concatenate([[0.0], *shown])
    low, high = np.nanmin(values), np.nanmax(values)
    extent = max(high - low, 1.0)
    return low - 0.06 * extent, high + 0.16 * extent


def _legend(*before_after):
    """Legend entries of before, after and the null band."""
    return [*before_after, Patch(color=BAND, label="When nothing is wrong (95 %)")]


def _split(panel, split, explained):
    count, n = numbers(split["count"]), len(split["count"])
    edges = np.arange(n + 1.0) - 0.5 if split.get("edges") is None else numbers(split["edges"])
    low, high = band_of(split["null_band"])
    panel.stairs(high, edges, baseline=low, fill=True, color=BAND, zorder=1)
    panel.axhline(0.0, color=GREY, linewidth=0.7, zorder=2)
    for key, color, style in (("before", BEFORE, "-"), ("after", AFTER, "--")):
        values = numbers(split[key])
        panel.hlines(values, edges[:-1], edges[1:], color=color, linestyle=style, lw=2.2, zorder=4)
        panel.stairs(values, edges, baseline=None, color=color, lw=0.6, alpha=0.6, zorder=3)
    _most(panel, split, edges, count, explained)
    panel.set_title(split_title(split), fontsize=8.5)
    panel.grid(axis="x", visible=False)
    if split.get("edges") is None:
        names = [label(str(name).replace("_", " "), 12) for name in split["bins"]]
        panel.set_xticks(range(n), names, fontsize=7.5, parse_math=False)
    panel.margins(x=0.01)


def _most(panel, split, edges, count, explained):
    """Write the share of the bin that holds more than its rows account for: of what the cause
    explains, or of the gap where that stands out."""
    share, before = numbers(split["share"]), numbers(split["before"])
    of_rows = count / max(count.sum(), 1.0)
    high = band_of(split["null_band"])[1]
    plain = (share > PLAIN * of_rows) & (share > LEAST_SHARE) & (explained | (before > high))
    if not plain.any():
        return
    i = int(np.argmax(np.where(plain, share - of_rows, -np.inf)))
    middle, span = edges[i : i + 2].mean(), edges[-1] - edges[0]
    side = "left" if middle < edges[0] + 0.1 * span else "center"
    side = "right" if middle > edges[-1] - 0.1 * span else side
    panel.annotate(
        f"{100 * min(share[i], 1.0):.0f} %",
        (middle, np.nanmax([before[i], high[i], 0.0])),
        xytext=(0, 3),
        textcoords="offset points",
        horizontalalignment=side,
        fontsize=7.5,
        zorder=5,
    )


@styled
def closure_figure(document):
    """The gap on held-out data, before and after: in all, and block by block."""
    closure = document["closure"]
    blocks = held_out(closure)
    figure = new_figure(2.7)
    whole, each = figure.subplots(1, 2, width_ratios=[1, 2.4])
    _whole(whole, closure)
    whole.set_ylabel(f"Gap ({closure['unit']})")
    if blocks:
        _blocks(each, blocks)
    else:
        each.set_visible(False)
    bars = Patch(color=BEFORE, label="Before"), Patch(color=AFTER, label="After")
    legend_above(figure, _legend(*bars))
    return figure


def _whole(panel, closure):
    low, high = band_of([closure["null_band"]])[:, 0]
    if np.isfinite([low, high]).all():
        panel.axhspan(low, high, color=BAND, zorder=0)
    values = numbers([closure["before"], closure["after"]])
    interval = after_interval(closure)
    panel.bar([0, 1], values, width=0.6, color=[BEFORE, AFTER], zorder=2)
    if interval is not None:
        ends = np.abs(np.array(interval)[:, None] - values[1])
        panel.errorbar([1], values[1:], ends, color="black", capsize=4, linewidth=1.2, zorder=3)
    for place, value in enumerate(values):
        if np.isfinite(value):
            panel.annotate(
                f"{value:.1f}", (place, max(value, 0.0)), xytext=(-14, 3), fontsize=8,
                textcoords="offset points", horizontalalignment="center", zorder=4,
            )  # fmt: skip
    panel.axhline(0.0, color=GREY, linewidth=0.7, zorder=1)
    panel.set_xticks([0, 1], ["Before", "After"])
    panel.set_title("All held-out data")
    panel.margins(y=0.15)
    panel.grid(axis="x", visible=False)


def after_interval(closure):
    """95 % of the gap after, by the interval of the share that is gone; None where not known."""
    if not all(map(known, [closure["before"], *closure["interval"]])):
        return None
    square = np.sign(closure["before"]) * closure["before"] ** 2
    ends = square * (1 - np.array(closure["interval"], dtype=float))
    low, high = np.sort(np.sign(ends) * np.sqrt(np.abs(ends)))
    after = closure["after"]
    return (min(low, after), max(high, after)) if known(after) else None


def _blocks(panel, blocks):
    """Before and after of each held-out block, with its time where it has one."""
    for key, color, shift in (("before", BEFORE, -0.2), ("after", AFTER, 0.2)):
        values = numbers([one[key] for one in blocks])
        panel.bar(np.arange(len(blocks)) + shift, values, width=0.36, color=color, zorder=2)
    panel.axhline(0.0, color=GREY, linewidth=0.7)
    names, first = [str(i + 1) for i in range(len(blocks))], blocks[0].get("start")
    panel.set_xlabel("Block of data that was held out")
    if known(first):
        names = [f"{one['start'] - first:.0f}–{one['end'] - first:.0f}" for one in blocks]
        panel.set_xlabel(f"Seconds after gps_time {first:.0f} s")
    step = 1 + len(names) // 10
    panel.set_xticks(range(0, len(names), step), names[::step], fontsize=7.5)
    panel.set_title("Each held-out block by itself")
    panel.grid(axis="x", visible=False)


def held_out(closure):
    """The blocks of a closure, in time where they have one."""
    blocks = closure.get("blocks") or closure.get("folds") or []
    timed = all(known(one.get("start")) for one in blocks)
    return sorted(blocks, key=lambda one: one["start"]) if timed else blocks
