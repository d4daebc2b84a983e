"""Pictures of pos_gap.py."""

import numpy as np
from pos_drive import FIRST, LEAD, OUTAGE, PERIOD

from mlscorr.gap.evidence import signed_root
from mlscorr.report.style import AFTER, BEFORE, GREY

UPPER = "Error of a real MEMS GNSS/INS; grey: without GNSS"
LOWER = "Gap between simulated and real; bars: 95 % of it if that simulator is right"


def draw_summary(figure, one, believed, sigmas, cycles, r):
    """Draw errors with both models, and the gap of each outage below."""
    upper, lower = figure.subfigures(2, 1, height_ratios=(2, 1))
    upper.suptitle(UPPER, x=0.01, ha="left", fontsize=9.5)
    draw_errors(upper, one, believed, sigmas, cycles)
    lower.suptitle(LOWER, x=0.01, ha="left", fontsize=9.5)
    draw_by_outage(lower, r)


def draw_errors(figure, one, believed, sigmas, cycles):
    """Draw errors with both models."""
    panels = figure.subplots(3, 1, sharex=True)
    time = one.true.gps_time - FIRST
    for axis, panel in enumerate(panels):
        for start, length in one.outages:
            panel.axvspan(start - FIRST, start + length - FIRST, color="0.92", zorder=0)
        two = 2 * sigmas[0][:, axis]
        now = 2 * believed.position_sigma
        largest = 1.15 * np.abs(one.error.position[:, axis]).max()
        panel.fill_between(
            time,
            -two,
            two,
            color=AFTER,
            alpha=0.25,
            lw=0,
            label="2 sigma, simulator told of the outages",
        )
        panel.axhline(now, color=BEFORE, lw=1.2, label="2 sigma as believed")
        panel.axhline(-now, color=BEFORE, lw=1.2)
        panel.plot(time, one.error.position[:, axis], color="black", lw=0.9, label="real error")
        panel.set(ylim=(-largest, largest), ylabel=f"{('East', 'North', 'Height')[axis]} (m)")
    panels[-1].set_xlim(cycles[0][0] - FIRST, cycles[-1][1] - FIRST)
    panels[-1].set_xlabel(f"time since GNSS was withheld first, at {FIRST:.0f} s of the week (s)")
    panels[0].legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)


def draw_by_time(figure, cycles, measured):
    """Draw the gap by time since the outage's start, from squares and from innovations."""
    panels = figure.subplots(1, 2, sharey=True)
    since = np.concatenate([m["time"] - c[0] - LEAD for c, m in zip(cycles, measured, strict=True)])
    edges = np.arange(-LEAD, PERIOD - LEAD + 1, 7.5)
    number = np.digitize(since, edges) - 1
    middle = (edges[:-1] + edges[1:]) / 2
    kinds = (("plain", "left", "Squared misfit"), ("before", "after", "Innovations"))
    for panel, (before, after, title) in zip(panels, kinds, strict=True):
        panel.axvspan(0, OUTAGE, color="0.92", zorder=0)
        panel.axhline(0, color=GREY, lw=0.8)
        told = (before, BEFORE, "as believed"), (after, AFTER, "told of the outages")
        for key, color, label in told:
            values = np.concatenate([m[key] for m in measured])
            mean = np.array([values[number == i].mean() for i in range(len(middle))])
            panel.plot(middle, signed_root(mean), "o-", color=color, ms=3, label=label)
        panel.set_yscale("symlog", linthresh=10)
        panel.set(title=title, xlabel="time from the loss of GNSS (s)")
    panels[0].set_ylabel("gap (mm)")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)


def draw_by_outage(figure, r):
    """Draw the gap of each outage before and after, with its range by chance."""
    axes = figure.subplots()
    place = np.arange(len(r["cycles"]))
    for aside, key, band, color, label in (
        (-0.15, "before", "null_band", BEFORE, "as believed"),
        (0.15, "after", "null_band_after", AFTER, "told of the outages (settings from the others)"),
    ):
        low, high = np.array([c[band] for c in r["cycles"]]).T
        axes.bar(place + aside, high - low, 0.25, low, color=color, alpha=0.25)
        value = [c[key] for c in r["cycles"]]
        axes.plot(place + aside, value, "o", color=color, label=label)
    axes.axhline(0, color=GREY, lw=0.8)
    axes.set_xticks(place, [f"{c['outage'][0] - FIRST:.0f} s" for c in r["cycles"]])
    axes.set(xlabel="outage from", ylabel="gap (mm)")
    axes.use_sticky_edges = False  # else the lowest bar ends at the axis
    axes.margins(y=0.1)
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
