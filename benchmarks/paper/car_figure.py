"""Figures 5 to 9 of Mao et al. 2015, drawn from the simulated clones of its car."""

import numpy as np
from drive import NORTH
from literal import Literal
from matplotlib import rc_context
from matplotlib.figure import Figure
from published import DURATION, TABLE_1_C0, TABLE_3, TABLE_4, TIMES
from tables import middle

from mlscorr.report.style import BLACK, BLUE, GREEN, GREY, ORANGE, SKY, STYLE, VERMILLION

COLOURS = {21: BLUE, 15: ORANGE, 9: GREEN}
PAPER = {"linestyle": "none", "marker": "x", "markersize": 5, "markeredgewidth": 1.3}


def draw(by_count, bases, parabolas, grid, curves):
    """Draw the figure: one drive above, all drives below.

    ``bases`` are the best C0 (seeds,) by order; ``parabolas`` and ``curves`` what the sweeps of C0
    and of the correlation time return, by number of control points.
    """
    with rc_context(STYLE):
        figure = Figure(figsize=(11.0, 9.4), layout="constrained")
        axes = figure.subplots(3, 2)
        drive = by_count[21][0]
        draw_raw(axes[0, 0], drive)
        draw_bases(axes[0, 1], drive)
        draw_times(axes[1, 0], drive)
        draw_parabolas(axes[1, 1], parabolas)
        draw_best_bases(axes[2, 0], bases)
        draw_curves(axes[2, 1], grid, curves)
        figure.suptitle(
            "The car of Mao et al. (2015) on simulated clones, not the paper's data: first drive "
            f"(a-c) and medians of {len(by_count[21])} drives (d-f)",
            x=0.01,
            ha="left",
            fontsize=10.5,
        )
        return figure


def draw_raw(axes, drive):
    """Figures 5 and 6: the POS error, and its observations at the control points."""
    seen = Literal.of(drive.survey, 5)
    for name, colour, error, found in zip(
        ("East", "North", "Height"),
        (BLUE, VERMILLION, GREEN),
        drive.error.T,
        seen.misclosure.T,
        strict=True,
    ):
        axes.plot(since(drive), error, color=colour, label=name)
        axes.plot(seen.gps_time - drive.gps_time[0], found, "o", color=colour, markersize=3.5)
    axes.set_title("(a) POS error, and control points (dots)   [Fig. 5, 6]")
    finish(axes, "Time (s)", "Error (m)")


def draw_bases(axes, drive):
    """Figure 7: residual errors with too small, best and too large C0, and in consistent mode."""
    literal = Literal.of(drive.survey, 5)
    time = TIMES[21]
    best = literal.best_base(drive.gps_time, drive.error, time)
    for factor, colour, name in (
        (0.0, GREY, "C0 = 0 (LS-5)"),
        (1.0, BLUE, "best C0"),
        (2.2, ORANGE, "2.2 best C0"),
    ):
        left = drive.error - literal.predict(drive.gps_time, factor * best, time)
        axes.plot(since(drive), left[:, NORTH], color=colour, label=name)
    left = drive.consistent()[:, NORTH]
    axes.plot(since(drive), left, color=BLACK, label="consistent, from control alone")
    axes.set_title("(b) North residual by C0, 21 control points   [Fig. 7]")
    finish_residuals(axes)


def draw_times(axes, drive):
    """Figure 9: residual errors with several correlation times."""
    literal = Literal.of(drive.survey, 5)
    fixed = literal.best_base(drive.gps_time, drive.error, TIMES[21])
    for time, colour in ((10.0, SKY), (30.0, BLUE), (80.0, VERMILLION)):
        left = drive.error - literal.predict(drive.gps_time, fixed, time)
        axes.plot(since(drive), left[:, NORTH], color=colour, label=f"dt = {time:g} s")
    axes.set_title("(c) North residual by correlation time, C0 fixed   [Fig. 9]")
    finish_residuals(axes)


def draw_parabolas(axes, parabolas):
    """Figure 8a: RMS over C0, both in units common to two different drives."""
    for count, (factors, found, best) in parabolas.items():
        if any(best > 0):
            relative = middle((found / found[:, :1])[best > 0])
        else:
            relative = np.ones(1)
        if len(relative) > 1:
            dense = np.linspace(0.0, factors[-1], 100)
            square = np.polyval(np.polyfit(factors, relative**2, 2), dense)
            axes.plot(dense, np.sqrt(square), color=COLOURS[count], label=f"{count} control points")
        base, of_paper = (np.array(values) for values in TABLE_3[count])
        curve = np.polyfit(base, of_paper**2, 2)
        axes.plot(
            base / (-curve[1] / 2 / curve[0]),
            of_paper / np.sqrt(curve[2]),
            color=COLOURS[count],
            **PAPER,
        )
    axes.plot([], [], color=BLACK, label="paper's Table 3", **PAPER)
    axes.set_ylim(0.6, 1.3)
    axes.set_title("(d) North RMS by C0   [Fig. 8a, Table 3]")
    finish(axes, "C0 / best C0", "RMS / RMS at C0 = 0 (LS-5)")


def draw_best_bases(axes, bases):
    """Figure 8b: the best C0 over the polynomial's order."""
    orders = list(bases)
    low, median, high = np.percentile(list(bases.values()), (16, 50, 84), axis=1)
    axes.errorbar(
        orders,
        median,
        (median - low, high - median),
        color=BLUE,
        marker="o",
        capsize=3,
        label="clones, 16-84 %",
    )
    axes.plot(orders, [TABLE_1_C0[order] for order in orders], color=BLACK, label="paper", **PAPER)
    axes.set(yscale="log", xticks=orders, ylim=(0.02, 4.0))
    axes.set_title("(e) Best C0 north by order, 21 control points   [Fig. 8b]")
    finish(axes, "Order of the polynomial", "Best C0 (m²)")


def draw_curves(axes, grid, curves):
    """Table 4 as curves: C0 fixed (solid) and tuned anew at each correlation time (dashed)."""
    for count, (fixed, tuned) in curves.items():
        nominal = TIMES[count] / DURATION * (count - 1)
        reference = np.array([np.interp(nominal, grid, one) for one in fixed])[:, None]
        name = f"{count} control points"
        axes.plot(grid, middle(fixed / reference), color=COLOURS[count], label=name)
        axes.plot(grid, middle(tuned / reference), color=COLOURS[count], linestyle="--")
        times, of_paper = (np.array(values) for values in TABLE_4[count])
        interval = DURATION / (count - 1)
        axes.plot(times / interval, of_paper / of_paper.min(), color=COLOURS[count], **PAPER)
    axes.plot([], [], color=BLACK, linestyle="--", label="C0 tuned at each dt")
    axes.plot([], [], color=BLACK, label="paper's Table 4", **PAPER)
    axes.axvspan(3.0, 5.0, color="#eeeeee", zorder=0)
    axes.set(xscale="log", ylim=(0.8, 2.1), xticks=(0.5, 1, 2, 5, 10, 20, 40))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.minorticks_off()
    axes.set_title("(f) North RMS by correlation time   [Table 4; grey: 3 to 5]")
    finish(axes, "dt / mean control interval", "RMS / RMS at the paper's dt", "upper right")


def since(drive):
    """Time since the start of the drive. Units: s."""
    return drive.gps_time - drive.gps_time[0]


def finish(axes, horizontal, vertical, where="upper left"):
    """Add labels and a legend."""
    axes.set(xlabel=horizontal, ylabel=vertical)
    axes.legend(fontsize=7.5, ncols=2, loc=where)


def finish_residuals(axes):
    """Add the same to residuals over time, with room for the legend above them."""
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.3 * (high - low))
    finish(axes, "Time (s)", "Residual (m)")
