"""The correction over time: position with the misclosures it rests on, and attitude."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from mlscorr.correction import Correction
from mlscorr.report import style
from mlscorr.report.correction_report import CorrectionReport, array, ordered
from mlscorr.report.settings import SETTINGS

WORDS = {
    "control": "Control point: misclosure before, 1 sigma",
    "check": "Check point: misclosure before, 1 sigma",
    "unused": "Not used (triangle: beyond the axis)",
}


@style.styled
def correction_figure(correction: Correction, report: CorrectionReport) -> Figure:
    """Correction of the position in three panels, with misclosures before as marks.

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


@style.styled
def attitude_figure(correction: Correction, report: CorrectionReport) -> Figure:
    """Correction of roll, pitch and heading in three panels.

    Parameters
    ----------
    correction : Correction
    report : CorrectionReport
    """
    sigma = np.degrees(correction.corrected.attitude_sigma)
    words = "roll, pitch and heading", ("Roll (deg)", "Pitch (deg)", "Heading (deg)")
    return _figure(
        4.4, correction, report, np.degrees(correction.attitude_change), sigma, [], words
    )


def _figure(height, correction, report, change, sigma, rows, words):
    """Curves (n, 3) with sigma (n, 3), over them the marks of rows of targets.

    Words name what is corrected, and its three parts.
    """
    figure = style.new_figure(height)
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
    style.legend_above(figure, handles, columns=2)
    return figure


def _start(trajectory):
    """Time zero of the axis, a whole second."""
    return np.floor(trajectory.gps_time[0])


def _curve(panel, trajectory, change, sigma, span):
    """Draw a curve with its 1-sigma band; returns the values that the axis must show."""
    time = trajectory.gps_time
    gaps = trajectory.gaps
    curves = np.column_stack([change - sigma, change, change + sigma])
    rows = style.thin(curves, time, gaps)
    at, broken = style.break_at_gaps(time[rows], gaps, curves[rows])
    at = at - _start(trajectory)
    panel.axhline(0.0, color=style.GREY, linewidth=0.8)
    panel.fill_between(at, broken[:, 0], broken[:, 2], **style.BAND)
    panel.plot(at, broken[:, 1], color=style.BLUE)
    inside = (time >= span[0]) & (time <= span[1])
    inside |= not inside.any()
    return [0.0, curves[inside, 0].min(), curves[inside, 2].max()]


def _marks(panel, trajectory, rows, axis, group):
    """Draw misclosures of a group with sigma; returns the values to show."""
    time = np.array([row.gps_time for row in rows]) - _start(trajectory)
    value = array(rows, "before")[:, axis]
    sigma = np.nan_to_num(array(rows, "sigma")[:, axis])
    symbol = {"linestyle": "none", "elinewidth": 0.9, "capsize": 2.0, **style.MARKS[group]}
    panel.errorbar(time, value, sigma, **symbol)
    return [*(value - sigma), *(value + sigma)]


def _unused(panel, trajectory, rows, axis):
    """Draw what was not used; on the panel's edge, as a triangle, where it lies beyond."""
    low, high = panel.get_ylim()
    for row in rows:
        value = row.before[axis]
        if value < low:
            marker = "v"
        else:
            marker = "^" if value > high else "x"
        symbol = {**style.MARKS["unused"], "marker": marker, "clip_on": False, "zorder": 4}
        panel.plot(row.gps_time - _start(trajectory), np.clip(value, low, high), **symbol)


def _set_range(panel, values, change):
    """Limits that hold the values asked for; beyond the control span only as much again."""
    low = np.nanmin(values)
    high = np.nanmax(values)
    room = max(high - low, SETTINGS.difference)  # of an axis in m or in deg
    low = max(low - room, min(low, change.min()))
    high = min(high + room, max(high, change.max()))
    panel.set_ylim(low - 0.07 * room, high + 0.07 * room)


def _shade(panels, trajectory, span, support):
    """Shade gaps, outages and what is extrapolated, mark steps and span; name the time axis."""
    start = _start(trajectory)
    first = trajectory.gps_time[0]
    last = trajectory.gps_time[-1]
    for panel in panels:
        panel.set_xlim(first - start, last - start)
        for gap in trajectory.gaps - start:
            panel.axvspan(*gap, zorder=0.6, linewidth=0, **style.GAP)
        for stretch in support.weak:
            panel.axvspan(stretch.start - start, stretch.end - start, zorder=0.5, **style.OUTSIDE)
        low = panel.get_xaxis_transform()
        for begin, end in support.outages:  # a strip, as an outage may be extrapolated as well
            outage = np.array([begin, end]) - start
            panel.fill_between(outage, 0.0, 0.06, transform=low, zorder=0.55, **style.OUTAGE)
        for step in support.steps:
            panel.axvline(step - start, **style.STEP)
        for edge in span:
            panel.axvline(edge - start, **style.SPAN)
    panels[-1].set_xlabel(f"Time since gps_time {start:.0f} s (s)")


def _legend(trajectory, groups, report):
    """Legend entries of what is really drawn."""
    support = report.support
    handles = [Line2D([], [], color=style.BLUE, label="Correction")]
    handles.append(Patch(**style.BAND, label="1 sigma of the corrected value"))
    handles += style.mark_handles(WORDS, groups)
    if support.weak:
        handles.append(Patch(**style.OUTSIDE, label="Extrapolated: no control point holds it"))
    if support.outages:
        handles.append(Patch(**style.OUTAGE, label="GNSS outage: the position drifts"))
    if support.steps:
        words = "GNSS re-acquired: the recorded position jumps"
        handles.append(Line2D([], [], **style.STEP, label=words))
    if report.control.n:
        handles.append(Line2D([], [], **style.SPAN, label="First and last control point"))
    if len(trajectory.gaps):
        handles.append(Patch(linewidth=0, **style.GAP, label="Gap of the trajectory"))
    return handles
