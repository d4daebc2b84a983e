"""Figures of a correction's first screen and of its check points, for internal use."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from mlscorr.correction import Correction
from mlscorr.evaluate import TargetRow
from mlscorr.report.correction_report import CorrectionReport, array, ordered
from mlscorr.report.maps import track
from mlscorr.report.render import MARK
from mlscorr.report.settings import SETTINGS
from mlscorr.report.style import MARKS, TRACK, new_figure, nice, styled

WEAK: dict[str, Any] = {"color": "#c99700", "linewidth": 4.0, "solid_capstyle": "butt"}


@styled
def locator_map(
    correction: Correction, report: CorrectionReport, marked: TargetRow | None = None
) -> Figure:
    """Draw a small map of the drive, control and check points, without axes.

    Parameters
    ----------
    correction : Correction
    report : CorrectionReport
    marked : TargetRow, optional
        Target of the picture next to the map, marked by a ring and its name.
    """
    plan = track(correction.corrected)
    rows = [row for row in ordered(report.targets) if row.is_observed]
    points = np.vstack([plan[np.isfinite(plan).all(axis=1)], array(rows, "surveyed")[:, :2]])
    low = points.min(axis=0)
    high = points.max(axis=0)
    extent = max(float((high - low).max()), 1.0)
    middle = (low + high) / 2
    half = np.maximum((high - low) / 2, 0.22 * extent) + 0.06 * extent
    width = SETTINGS.locator_width
    figure = Figure((width, width * half[1] / half[0]))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=middle[0] + half[0] * np.array([-1, 1]), aspect="equal")
    axes.set(ylim=middle[1] + half[1] * np.array([-1, 1]), xticks=[], yticks=[])
    axes.spines[:].set_visible(False)
    axes.plot(*plan.T, **{**TRACK, "linewidth": 2.0})
    for line in weak_lines(correction, report):
        axes.plot(*line.T, **WEAK, zorder=1.5)
    for group in ("control", "check"):
        places = array([row for row in rows if row.group == group], "surveyed")
        axes.plot(*places[:, :2].T, linestyle="none", **MARKS[group])
    if marked is not None:
        place = (float(marked.surveyed[0]), float(marked.surveyed[1]))
        ring: dict[str, Any] = {"marker": "o", "markersize": 13.0, "markerfacecolor": "none"}
        axes.plot(*place, color=MARK, markeredgewidth=2.0, **ring)
        text_style: dict[str, Any] = {
            "xytext": (0, 10),
            "textcoords": "offset points",
            "ha": "center",
        }
        axes.annotate(marked.name or "no name", place, fontsize=11, fontweight="bold", **text_style)
    bar = nice(0.3 * 2 * half[0])
    west = middle[0] - 0.95 * half[0]
    foot = middle[1] - 0.93 * half[1]
    axes.plot([west, west + bar], [foot, foot], color="black", linewidth=3, solid_capstyle="butt")
    above: dict[str, Any] = {"xytext": (0, 4), "textcoords": "offset points", "fontsize": 10}
    axes.annotate(f"{bar:g} m", (west, foot), **above)
    tip = middle + half * [0.93, 0.93]
    arrow = {"arrowstyle": "-|>", "color": "black", "linewidth": 1.4}
    foot_of_arrow = tip - [0, min(0.35 * half[1], 0.18 * half[0])]
    axes.annotate("", (tip[0], tip[1]), xytext=foot_of_arrow, arrowprops=arrow)
    axes.annotate(
        "N", (tip[0], foot_of_arrow[1]), fontsize=10, fontweight="bold", ha="center", va="top"
    )
    return figure


def weak_lines(correction: Correction, report: CorrectionReport) -> list[np.ndarray]:
    """Plan positions (m, 2) of the corrected drive within each poorly constrained interval.

    Parameters
    ----------
    correction : Correction
    report : CorrectionReport
    """
    corrected = correction.corrected
    lines = []
    for interval in report.support.weak:
        time = corrected.gps_time
        inside = np.flatnonzero((time >= interval.start) & (time <= interval.end))
        if len(inside):
            step = max(1, len(inside) // SETTINGS.curve_epochs)
            lines.append(corrected.position[inside[::step], :2])
    return lines


@styled
def sigma_figure(z: np.ndarray) -> Figure:
    """Draw a histogram of residuals over their stated sigmas, and the normal density.

    Parameters
    ----------
    z : (n, 3) array
    """
    figure = new_figure(2.9)
    axes = figure.add_subplot()
    values = z.ravel()
    largest = max(3.5, float(np.ceil(np.abs(values).max())))
    count = int(np.clip(2 * np.sqrt(len(values)), 7, 41)) | 1  # odd, so that one bin contains zero
    width = 2 * largest / count
    axes.hist(
        values,
        np.linspace(-largest, largest, count + 1).tolist(),
        color="#8fb0dd",
        edgecolor="white",
        label=f"{len(values)} residuals (E, N, H) over their stated sigmas",
    )
    x = np.linspace(-largest, largest, 200)
    density = np.exp(-(x**2) / 2) / np.sqrt(2 * np.pi)
    words = "Expected: normal distribution with sigma 1"
    axes.plot(x, len(values) * width * density, color="#D55E00", label=words)
    axes.set(xlabel="Residual / stated sigma", ylabel="Number", xlim=(-largest, largest))
    figure.legend(loc="outside upper left", ncols=2)
    return figure
