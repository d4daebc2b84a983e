"""Residuals of every target before and after, axis by axis."""

import numpy as np
from matplotlib.figure import Figure

from mlscorr.report.correction_report import CorrectionReport, array, ordered
from mlscorr.report.settings import SETTINGS
from mlscorr.report.style import GREY, MARKS, label, legend_above, mark_handles, new_figure, styled

WORDS = {
    "control": "Control point, 1 sigma",
    "check": "Check point (no part in the estimate), 1 sigma",
}


@styled
def residual_figure(report: CorrectionReport) -> Figure:
    """Misclosures of control and check points, before on the left, after on the right.

    Parameters
    ----------
    report : CorrectionReport
    """
    rows = [row for row in ordered(report.targets, *WORDS) if row.is_observed]
    rows.sort(key=lambda row: row.gps_time)
    figure = new_figure(5.8)
    panels = figure.subplots(3, 2, sharex=True, sharey="col")
    ranges = [_column(panels[:, i], rows, name) for i, name in enumerate(("before", "after"))]
    panels[0, 0].set_title("Before the correction")
    panels[0, 1].set_title(f"After the correction ({_scale(ranges[0] / ranges[1])})")
    for panel, axis in zip(panels[:, 0], ("Easting", "Northing", "Height"), strict=True):
        panel.set_ylabel(f"{axis} (m)")
    for panel in panels[2]:
        _name_targets(panel, rows)
    handles = mark_handles(WORDS, {row.group for row in rows})
    if handles:
        legend_above(figure, handles)
    return figure


def _scale(ratio):
    """How the right scale differs from the left one, in words.

    >>> _scale(18.24), _scale(1.0), _scale(0.5)
    ('scale 18 times finer', 'same scale', 'scale 2.0 times coarser')
    """
    if 0.95 < ratio < 1.05:
        return "same scale"
    times = max(ratio, 1 / ratio)
    return f"scale {times:.{int(times < 10)}f} times {'finer' if ratio > 1 else 'coarser'}"


def _column(panels, rows, name):
    """Draw one state of all axes with one range; returns half of that range. Units: m."""
    groups = np.array([row.group for row in rows])
    values = array(rows, name)
    sigma = np.nan_to_num(array(rows, "sigma"))
    for axis, panel in enumerate(panels):
        panel.axhline(0.0, color=GREY, linewidth=0.8)
        for group in WORDS:
            at = np.flatnonzero(groups == group)
            style = {"linestyle": "none", "elinewidth": 0.9, **MARKS[group]}
            panel.errorbar(at, values[at, axis], sigma[at, axis], **style)
    half = 1.08 * max(SETTINGS.difference, np.nanmax(np.abs(values) + sigma, initial=0.0))
    panels[0].set_ylim(-half, half)
    return half


def _name_targets(panel, rows):
    """Names under the axis, in the order of time."""
    panel.set_xlim(-0.7, max(len(rows), 1) - 0.3)
    if len(rows) > SETTINGS.axis_names:
        panel.set_xlabel("Targets in the order of time")
        return
    several_passes = len({row.pass_number for row in rows}) > 1
    names = [label(row.name) + f" · {row.pass_number}" * several_passes for row in rows]
    panel.set_xticks(range(len(rows)), names, rotation=90, fontsize=7, parse_math=False)
    panel.set_xlabel("Target" + " · pass" * several_passes + ", in the order of time")
