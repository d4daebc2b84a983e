"""What a correction was made of: files, coordinate and time systems, beliefs, coverage."""

import numpy as np

from mlscorr.correction import Correction
from mlscorr.report.correction_report import CorrectionReport, FileRow
from mlscorr.survey import WEEK, Survey
from mlscorr.wording import number, percent, thousands

FRAMES = {
    "Frame: map": "easting, northing, height in m, as the files have them",
    "Frame: body": "X right, Y forward, Z up, at the trajectory's navigation centre",
    "Frame: attitude": "heading clockwise from grid north, pitch nose up, roll right side down; "
    "R = Rz(−heading) Rx(pitch) Ry(roll)",
}

TIMES = {"week": "GPS seconds of week", "standard": "adjusted standard GPS time"}


def systems(survey: Survey) -> list[tuple[str, str]]:
    """Pairs (what, value) on systems, frames, and what was believed of the instruments."""
    trajectory = survey.trajectory
    time = survey.trajectory.gps_time
    crs = survey.crs or "not stated in survey.toml; coordinates are taken as E, N, H in m"
    pairs = [("Coordinate reference system", crs), *FRAMES.items()]
    if trajectory.weeks is None:
        week_end = ""
    else:
        week_end = ", counted on over the end of the GPS week"
    span = f"gps_time {time[0]:.3f} to {time[-1]:.3f} s{week_end}"
    pairs.append(("Time of the trajectory", span))
    pairs += dict.fromkeys((f"Time of {cloud.path.name}", _time(cloud)) for cloud in survey.clouds)
    rate = 1 / np.median(np.diff(time))
    pairs.append(("Epochs of the trajectory", f"{thousands(len(time))} at {rate:.4g} Hz"))
    sigma = "its own at each epoch"
    if trajectory.position_sigma is None:
        if survey.has_assumed_position:
            origin = "a default"
        else:
            origin = "as survey.toml states"
        sigma = f"{survey.pos.position_sigma:g} m at all times, {origin}"
    kind = "Assumed" if survey.has_assumed_position else "Stated"
    pairs.append((f"{kind} sigma of the trajectory's position", sigma))
    for name, part in survey.by_scanner.items():
        text = "not given (not needed: it cancels where only the trajectory is corrected)"
        if part.mounting is not None:
            text = f"right, forward, up {', '.join(f'{v:g}' for v in part.mounting.lever_arm)} m"
        pairs.append((f"Lever arm of {f'scanner {name}' if name else 'the scanner'}", text))
    return pairs


def _time(cloud):
    system = TIMES.get(cloud.time_system, cloud.time_system)
    if cloud.new_week > -np.inf:
        system += f", counted on where they start again (+{WEEK:.0f} s)"
    if not cloud.time_constant:
        return f"{system}, as the trajectory's"
    return f"{system}; {cloud.time_constant:+.3f} s gives the trajectory's"


def files(report: CorrectionReport) -> dict[str, list[tuple[str, str, str, str]]]:
    """Rows (what, name, size in words, SHA-256) of what went in and what came out.

    Parameters
    ----------
    report : CorrectionReport
    """
    groups = {"Read": report.inputs, "Written": report.files + report.outputs}
    return {
        title: [(row.what or "corrected cloud", row.name, _size(row), row.sha256) for row in rows]
        for title, rows in groups.items()
        if rows
    }


def _size(row: FileRow):
    if row.points is not None:
        return f"{thousands(row.points)} points"
    if row.bytes is None:
        return "–"
    return f"{thousands(row.bytes)} bytes"


def coverage(correction: Correction, report: CorrectionReport) -> list[tuple[str, object]]:
    """Pairs (what, value) on what the control points and the trajectory cover.

    Parameters
    ----------
    correction : Correction
    report : CorrectionReport
    """
    covered = report.coverage
    total = report.cloud_points
    time = correction.recorded.gps_time

    def span(first, last):
        return f"{first:.3f} to {last:.3f} s ({last - first:.1f} s)"

    def points(n):
        return thousands(n) + (f" ({percent(n / total, 2)})" if n and total else "")

    if report.control.n:
        control = span(*covered.control_span)
    else:
        control = "no control point takes part"
    seconds = number(report.seconds_extrapolated, 1)
    metres = number(report.metres_extrapolated, 0)
    outside = covered.points_outside_trajectory
    beyond = covered.points_outside_control
    unheld = covered.points_extrapolated
    gaps = correction.recorded.gaps
    noise = covered.points_noise
    values = {
        "Trajectory": span(time[0], time[-1]),
        "Control span (first to last control epoch)": control,
        "Longest time without control inside a pass": f"{number(covered.longest_gap_s)} s",
        "Points outside the trajectory (left as they were)": points(outside),
        "Points before the first or past the last control point": points(beyond),
        "Points whose correction is extrapolated: no control point holds them": points(unheld),
        "Points flagged as noise (not measured, corrected like all others)": points(noise),
        "Time and way whose correction is extrapolated": f"{seconds} s, {metres} m",
        "Gaps of the trajectory (nothing is interpolated across them)": len(gaps),
        "Jumps of the correction, where the recorded position jumps": _jumps(report),
    }
    return list(values.items())


def _jumps(report):
    """Number of jumps, and the largest: 3D size and time."""
    if not report.jumps:
        return "none"
    largest = max(report.jumps, key=lambda jump: jump.length)
    return (
        f"{len(report.jumps)} (largest {number(largest.length, 3)} m "
        f"at gps_time {number(largest.time, 3)} s)"
    )
