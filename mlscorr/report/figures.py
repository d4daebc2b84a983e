"""Figures of a correction, by name: curves over time, residuals of targets, and maps.

They are SVG in the page, and PNG files.
"""

from functools import cache, partial
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from mlscorr.correction import Correction
from mlscorr.estimate import TieResiduals
from mlscorr.report.correction_report import CorrectionReport, array, ordered
from mlscorr.report.maps import map_figure, tie_figure
from mlscorr.report.settings import SETTINGS
from mlscorr.report.style import (
    BAND,
    BLUE,
    GAP,
    GREY,
    MARKS,
    OUTAGE,
    OUTSIDE,
    SPAN,
    STEP,
    Figures,
    break_at_gaps,
    label,
    legend_above,
    mark_handles,
    new_figure,
    png,
    styled,
    thin,
)

PICTURES = ("correction", "map", "residuals", "ties")  # all figures; the page shows all
LEGEND = {
    "control": "Control point: misclosure before, 1 sigma",
    "check": "Check point: misclosure before, 1 sigma",
    "unused": "Not used (triangle: outside the axis)",
}


def correction_figures(
    correction: Correction, report: CorrectionReport, ties: TieResiduals | None = None
) -> Figures:
    """Make functions that draw the figures of a correction, by name, each once.

    ``correction``, ``attitude``, ``map``, and ``residuals`` and ``ties`` if there are any.

    Parameters
    ----------
    correction : Correction
        Its corrected trajectory may have sigmas from the estimate.
    report : CorrectionReport
    ties : TieResiduals, optional
    """
    figures: Figures = {
        "correction": partial(correction_figure, correction, report),
        "attitude": partial(attitude_figure, correction, report),
        "map": partial(map_figure, correction, report),
    }
    if report.control.n or report.check.n:
        figures["residuals"] = partial(residual_figure, report)
    if ties is not None:
        figures["ties"] = partial(tie_figure, correction, ties)
    return {name: cache(draw) for name, draw in figures.items()}


def write_pictures(
    folder: str | Path,
    correction: Correction,
    report: CorrectionReport,
    ties: TieResiduals | None = None,
    figures: Figures | None = None,
) -> list[Path]:
    """Write correction.png, map.png and, if available, residuals.png and ties.png.

    Parameters
    ----------
    folder : path
        Existing folder.
    correction : Correction
        Its corrected trajectory may have sigmas from the estimate.
    report : CorrectionReport
    ties : TieResiduals, optional
    figures : dict of functions, optional
        From ``correction_figures``, if a page also shows them.

    Returns
    -------
    list of Path
    """
    if figures is None:
        figures = correction_figures(correction, report, ties)
    paths = []
    for name, draw in figures.items():
        if name in PICTURES:
            path = Path(folder) / f"{name}.png"
            path.write_bytes(png(draw()))
            paths.append(path)
    return paths


@styled
def correction_figure(correction: Correction, report: CorrectionReport) -> Figure:
    """Draw the position correction in three panels, with misclosures before as marks.

    Parameters
    ----------
    correction : Correction
    report : CorrectionReport
    """
    new = correction.corrected
    change = new.position - correction.recorded.position
    rows = [row for row in ordered(report.targets) if row.is_observed]
    words = "the position", ("Easting (m)", "Northing (m)", "Height (m)")
    return _figure(6.6, correction, report, change, new.position_sigma, rows, words)


@styled
def attitude_figure(correction: Correction, report: CorrectionReport) -> Figure:
    """Draw the correction of roll, pitch and heading in three panels.

    Parameters
    ----------
    correction : Correction
    report : CorrectionReport
    """
    sigma = np.degrees(correction.corrected.attitude_sigma)
    words = "roll, pitch and heading", ("Roll (deg)", "Pitch (deg)", "Heading (deg)")
    change = np.degrees(correction.attitude_change)
    return _figure(4.4, correction, report, change, sigma, [], words)


def _figure(height, correction, report, change, sigma, rows, words):
    """Draw curves (n, 3) with sigma (n, 3), and the marks of rows of targets over them.

    Words name the corrected quantity, and its three components.
    """
    figure = new_figure(height)
    new = correction.corrected
    panels = figure.subplots(3, 1, sharex=True)
    span = report.coverage.control_span
    for axis, panel in enumerate(panels):
        panel.set_ylabel(words[1][axis])
        values = _curve(panel, new, change[:, axis], sigma[:, axis], span)
        for group in ("control", "check"):
            values += _marks(panel, new, [row for row in rows if row.group == group], axis, group)
        _set_range(panel, values, change[:, axis])
        _unused(panel, new, [row for row in rows if row.group == "unused"], axis)
    panels[0].set_title(f"Correction of {words[0]}: corrected − recorded")
    _shade(panels, new, span if report.control.n else (), report.support)
    handles = _legend(new, {row.group for row in rows}, report)
    legend_above(figure, handles, columns=2)
    return figure


def _start(trajectory):
    """Time zero of the axis, a whole second."""
    return np.floor(trajectory.gps_time[0])


def _curve(panel, trajectory, change, sigma, span):
    """Draw a curve with its 1-sigma band; return the values that the axis must show."""
    time = trajectory.gps_time
    gaps = trajectory.gaps
    curves = np.column_stack([change - sigma, change, change + sigma])
    rows = thin(curves, time, gaps)
    at, broken = break_at_gaps(time[rows], gaps, curves[rows])
    at = at - _start(trajectory)
    panel.axhline(0.0, color=GREY, linewidth=0.8)
    panel.fill_between(at, broken[:, 0], broken[:, 2], **BAND)
    panel.plot(at, broken[:, 1], color=BLUE)
    inside = (time >= span[0]) & (time <= span[1])
    inside |= not inside.any()
    return [0.0, curves[inside, 0].min(), curves[inside, 2].max()]


def _marks(panel, trajectory, rows, axis, group):
    """Draw misclosures of a group with sigma; return the values to show."""
    time = np.array([row.gps_time for row in rows]) - _start(trajectory)
    value = array(rows, "before")[:, axis]
    sigma = np.nan_to_num(array(rows, "sigma")[:, axis])
    symbol = {"linestyle": "none", "elinewidth": 0.9, "capsize": 2.0, **MARKS[group]}
    panel.errorbar(time, value, sigma, **symbol)
    return [*(value - sigma), *(value + sigma)]


def _unused(panel, trajectory, rows, axis):
    """Draw unused targets; as a triangle on the panel's edge if they are outside."""
    low, high = panel.get_ylim()
    for row in rows:
        value = row.before[axis]
        if value < low:
            marker = "v"
        else:
            marker = "^" if value > high else "x"
        symbol = {**MARKS["unused"], "marker": marker, "clip_on": False, "zorder": 4}
        panel.plot(row.gps_time - _start(trajectory), np.clip(value, low, high), **symbol)


def _set_range(panel, values, change):
    """Set limits that contain given values; outside the control span, up to twice as much."""
    low = np.nanmin(values)
    high = np.nanmax(values)
    room = max(high - low, SETTINGS.difference)  # of an axis in m or in deg
    low = max(low - room, min(low, change.min()))
    high = min(high + room, max(high, change.max()))
    panel.set_ylim(low - 0.07 * room, high + 0.07 * room)


def _shade(panels, trajectory, span, support):
    """Shade gaps, outages and extrapolated parts, mark steps and span; label the time axis."""
    start = _start(trajectory)
    first = trajectory.gps_time[0]
    last = trajectory.gps_time[-1]
    for panel in panels:
        panel.set_xlim(first - start, last - start)
        for gap in trajectory.gaps - start:
            panel.axvspan(*gap, zorder=0.6, linewidth=0, **GAP)
        for interval in support.weak:
            panel.axvspan(interval.start - start, interval.end - start, zorder=0.5, **OUTSIDE)
        low = panel.get_xaxis_transform()
        for begin, end in support.outages:  # a strip, as an outage may also be extrapolated
            outage = np.array([begin, end]) - start
            panel.fill_between(outage, 0.0, 0.06, transform=low, zorder=0.55, **OUTAGE)
        for step in support.steps:
            panel.axvline(step - start, **STEP)
        for edge in span:
            panel.axvline(edge - start, **SPAN)
    panels[-1].set_xlabel(f"Time since gps_time {start:.0f} s (s)")


def _legend(trajectory, groups, report):
    """Legend entries of drawn items."""
    support = report.support
    handles = [Line2D([], [], color=BLUE, label="Correction")]
    handles.append(Patch(**BAND, label="1 sigma of the corrected value"))
    handles += mark_handles(LEGEND, groups)
    if support.weak:
        handles.append(Patch(**OUTSIDE, label="Extrapolated, outside the control"))
    if support.outages:
        handles.append(Patch(**OUTAGE, label="GNSS outage: the position drifts"))
    if support.steps:
        words = "GNSS re-acquired: the recorded position jumps"
        handles.append(Line2D([], [], **STEP, label=words))
    if report.control.n:
        handles.append(Line2D([], [], **SPAN, label="First and last control point"))
    if len(trajectory.gaps):
        handles.append(Patch(linewidth=0, **GAP, label="Gap of the trajectory"))
    return handles


WORDS = {
    "control": "Control point, 1 sigma",
    "check": "Check point (not used in the estimate), 1 sigma",
}


@styled
def residual_figure(report: CorrectionReport) -> Figure:
    """Draw misclosures of control and check points, before on the left, after on the right.

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
    """Ratio of the right scale to the left one, in words.

    >>> _scale(18.24), _scale(1.0), _scale(0.5)
    ('scale 18 times finer', 'same scale', 'scale 2.0 times coarser')
    """
    if 0.95 < ratio < 1.05:
        return "same scale"
    times = max(ratio, 1 / ratio)
    return f"scale {times:.{int(times < 10)}f} times {'finer' if ratio > 1 else 'coarser'}"


def _column(panels, rows, name):
    """Draw one state of all axes with a common range; return half of that range. Units: m."""
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
    """Write names under the axis, in order of time."""
    panel.set_xlim(-0.7, max(len(rows), 1) - 0.3)
    if len(rows) > SETTINGS.axis_names:
        panel.set_xlabel("Targets in time order")
        return
    several_passes = len({row.pass_number for row in rows}) > 1
    names = [label(row.name) + f" · {row.pass_number}" * several_passes for row in rows]
    panel.set_xticks(range(len(rows)), names, rotation=90, fontsize=7, parse_math=False)
    panel.set_xlabel("Target" + " · pass" * several_passes + ", in time order")
