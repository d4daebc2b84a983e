"""The correction over time: position with the misclosures it rests on, and attitude."""

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from mlscorr.report.look import (
    BLUE,
    GREY,
    MARKS,
    SKY,
    break_at_gaps,
    legend_above,
    new_figure,
    styled,
    thin,
)
from mlscorr.report.tables import array, ordered
from mlscorr.survey import angles_from_attitude

SMALLEST_RANGE = 0.002  # of an axis; m or deg
OUTSIDE = {"facecolor": "#f3e9c9", "edgecolor": "none"}
GAP = {"facecolor": "#e3e3e3", "edgecolor": "#9a9a9a", "hatch": "////", "linewidth": 0}


def attitude_change(correction):
    """Corrected - recorded roll, pitch and heading. Units: deg."""
    recorded = np.column_stack(angles_from_attitude(correction.recorded.attitude))
    corrected = np.column_stack(angles_from_attitude(correction.corrected.attitude))
    return np.degrees((corrected - recorded + np.pi) % (2 * np.pi) - np.pi)


@styled
def correction_figure(survey, correction, document):
    """Correction of the position in three panels, with misclosures before as marks."""
    figure = new_figure(6.6)
    panels = figure.subplots(3, 1, sharex=True)
    new = correction.corrected
    change = new.position - correction.recorded.position
    span = _control_span(document)
    for axis, panel in enumerate(panels):
        reach = _curve(panel, new, change[:, axis], _column(new.position_sigma, axis), span)
        reach += _marks(panel, new, document["targets"], axis)
        _set_range(panel, reach, change[:, axis])
        _unused(panel, new, document["targets"], axis)
        panel.set_ylabel(f"{('Easting', 'Northing', 'Height')[axis]} (m)")
    _shade(panels, new, span)
    panels[0].set_title("Correction of the position: corrected − recorded")
    legend_above(figure, _legend(new, document, span, new.position_sigma is not None), 2)
    return figure


@styled
def attitude_figure(survey, correction, document):
    """Correction of roll, pitch and heading in three panels."""
    figure = new_figure(4.4)
    panels = figure.subplots(3, 1, sharex=True)
    new = correction.corrected
    change = attitude_change(correction)
    sigma = None if new.attitude_sigma is None else np.degrees(new.attitude_sigma)
    span = _control_span(document)
    for axis, panel in enumerate(panels):
        reach = _curve(panel, new, change[:, axis], _column(sigma, axis), span)
        _set_range(panel, reach, change[:, axis])
        panel.set_ylabel(f"{('Roll', 'Pitch', 'Heading')[axis]} (deg)")
    _shade(panels, new, span)
    panels[0].set_title("Correction of roll, pitch and heading: corrected − recorded")
    legend_above(figure, _legend(new, {"targets": []}, span, sigma is not None), 2)
    return figure


def _control_span(document):
    return (document.get("coverage") or {}).get("control_span")


def _column(values, axis):
    return None if values is None else values[:, axis]


def _start(trajectory):
    """Time zero of the axis, a whole second."""
    return np.floor(trajectory.gps_time[0])


def _curve(panel, trajectory, change, sigma, span):
    """Draw a curve with its 1-sigma band; returns the values that the axis must show."""
    time, gaps = trajectory.gps_time, trajectory.gaps
    band = np.zeros_like(change) if sigma is None else sigma
    rows = thin(np.column_stack([change - band, change, change + band]), time, gaps)
    at, line, low, high = break_at_gaps(
        time[rows], gaps, change[rows], (change - band)[rows], (change + band)[rows]
    )
    at = at - _start(trajectory)
    panel.axhline(0.0, color=GREY, linewidth=0.8)
    if sigma is not None:
        panel.fill_between(at, low, high, color=SKY, alpha=0.35, linewidth=0)
    panel.plot(at, line, color=BLUE)
    inside = np.ones(len(time), bool) if not span else (time >= span[0]) & (time <= span[1])
    if not inside.any():
        inside[:] = True
    return [0.0, (change - band)[inside].min(), (change + band)[inside].max()]


def _marks(panel, trajectory, targets, axis):
    """Draw misclosures of control and check points with sigma; returns the values to show."""
    reach = []
    for role in ("control", "check"):
        rows = _observed(targets, role)
        time = np.array([row["gps_time"] for row in rows], float) - _start(trajectory)
        value, sigma = array(rows, "before")[:, axis], array(rows, "sigma")[:, axis]
        sigma = np.nan_to_num(sigma)
        panel.errorbar(
            time, value, sigma, linestyle="none", elinewidth=0.9, capsize=2.0, **MARKS[role]
        )
        reach += [*(value - sigma), *(value + sigma)]
    return reach


def _unused(panel, trajectory, targets, axis):
    """Draw what was not used; on the panel's edge, as a triangle, where it lies beyond."""
    low, high = panel.get_ylim()
    for row in _observed(targets, "unused"):
        value = row["before"][axis]
        marker = "v" if value < low else "^" if value > high else "x"
        panel.plot(
            row["gps_time"] - _start(trajectory),
            np.clip(value, low, high),
            **MARKS["unused"] | {"marker": marker},
            clip_on=False,
            zorder=4,
        )


def _observed(targets, role):
    """Rows of a group that hold an epoch and a whole misclosure."""
    return [
        row
        for row in ordered(targets, role)
        if row.get("gps_time") is not None and row.get("before") and None not in row["before"]
    ]


def _set_range(panel, reach, change):
    """Limits that hold the values asked for; beyond the control span only as much again."""
    low, high = np.nanmin(reach), np.nanmax(reach)
    room = max(high - low, SMALLEST_RANGE)
    low, high = (max(low - room, min(low, change.min())), min(high + room, max(high, change.max())))
    panel.set_ylim(low - 0.07 * room, high + 0.07 * room)


def _shade(panels, trajectory, span):
    """Shade gaps and what lies outside the control span; name the time axis."""
    start, first, last = _start(trajectory), trajectory.gps_time[0], trajectory.gps_time[-1]
    for panel in panels:
        panel.set_xlim(first - start, last - start)
        for gap in trajectory.gaps - start:
            panel.axvspan(*gap, zorder=0.6, **GAP)
        if span:
            for a, b in ((first, span[0]), (span[1], last)):
                if b > a:
                    panel.axvspan(a - start, b - start, zorder=0.5, **OUTSIDE)
            for edge in span:
                panel.axvline(edge - start, color="#8a6d00", linewidth=0.8, linestyle=(0, (4, 3)))
    panels[-1].set_xlabel(f"Time since gps_time {start:.0f} s (s)")


def _legend(trajectory, document, span, has_sigma):
    """Legend entries of what is really drawn."""
    handles = [Line2D([], [], color=BLUE, label="Correction")]
    if has_sigma:
        handles.append(Patch(color=SKY, alpha=0.35, label="1 sigma of the corrected value"))
    words = {
        "control": "Control point: misclosure before, 1 sigma",
        "check": "Check point: misclosure before, 1 sigma",
        "unused": "Not used (triangle: beyond the axis)",
    }
    for role, text in words.items():
        if _observed(document["targets"], role):
            handles.append(Line2D([], [], linestyle="none", label=text, **MARKS[role]))
    if span and (span[0] > trajectory.gps_time[0] or span[1] < trajectory.gps_time[-1]):
        handles.append(Patch(**OUTSIDE, label="Outside the control span: extrapolated"))
    if len(trajectory.gaps):
        handles.append(Patch(**GAP, label="Gap of the trajectory"))
    return handles
