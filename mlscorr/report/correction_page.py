"""Page of a correction: figures, tables, and inputs.

Sections on files, coordinate and time systems, assumptions and coverage are at the end.
"""

from pathlib import Path

import numpy as np

from mlscorr.correction import Correction
from mlscorr.estimate import TieResiduals
from mlscorr.evaluate import CheckSigmas
from mlscorr.report import tables
from mlscorr.report.cloud import CloudViews, cloud_content
from mlscorr.report.correction_report import GROUPS, CorrectionReport, FileRow, ordered
from mlscorr.report.figures import correction_figures
from mlscorr.report.first_figures import locator_map, sigma_figure
from mlscorr.report.first_look import facts, three_numbers, worst_target
from mlscorr.report.headline import sigmas_statement, statements, statements_section
from mlscorr.report.model_rows import model_rows
from mlscorr.report.pages import Page, data_uri, drawn
from mlscorr.report.settings import SETTINGS
from mlscorr.report.style import Figures, svg
from mlscorr.report.target_figures import target_drawings
from mlscorr.report.wording import in_words
from mlscorr.survey import WEEK, Survey
from mlscorr.targets import FittedTarget
from mlscorr.wording import number, percent, thousands

SECTIONS = {  # in order; empty ones are omitted
    "statistics": "Misclosures",
    "sigmas": "Stated sigmas",
    "accuracy": "Accuracy",
    "pictures": "Before and after",
    "turn": "3D view",
    "correction": "Over time",
    "map": "Map",
    "ties": "Tie features",
    "residuals": "Residuals",
    "targets": "Extracted targets",
    "model": "Model",
    "used": "Input",
    "conventions": "Conventions",
}
TABLES = {  # of the model: title, and meaning of columns
    "alternatives": (
        "Covariance functions compared",
        "The correction is their average, weighted by probability. Correlation times in s; "
        "scales are factors on the stated sigmas.",
    ),
    "orders": (
        "Orders of the trend compared",
        "Leave-one-out RMSE of the control points in E, N, H in m.",
    ),
    "tests": (
        "Leave-one-out test of each control point",
        "w: residual over its sigma, predicted from the other points. Redundancy: share of an "
        "error that shows in the residual, 0 to 1. Detectable: smallest error that the test "
        "finds, in m. A point is rejected if its statistic exceeds the critical value.",
    ),
}


def write_report(
    path: str | Path,
    survey: Survey,
    correction: Correction,
    report: CorrectionReport,
    views: CloudViews | None = None,
    fitted: dict[tuple[int, float], FittedTarget] | None = None,
    ties: TieResiduals | None = None,
    drawings: Figures | None = None,
) -> None:
    """Write the self-contained page of a correction.

    Parameters
    ----------
    path : path
        HTML file.
    survey : Survey
    correction : Correction
        Its corrected trajectory may have sigmas from the estimate.
    report : CorrectionReport
    views : CloudViews, optional
        Pictures of the cloud and data of the 3D view, both omitted by default.
    fitted : dict, optional
        FittedTarget by (pass number, gps_time), each of which gets a figure.
    ties : TieResiduals, optional
        Residuals of tie features; without any, the section is omitted.
    drawings : dict of functions, optional
        From ``correction_figures``, if files of them are also written.
    """
    figures = target_drawings(report.targets, fitted or {})
    there = {"pictures": views is not None, "turn": views is not None, "targets": bool(figures)}
    there |= {"ties": ties is not None, "residuals": bool(report.targets)}
    there["sigmas"] = report.check_sigmas is not None
    if drawings is None:
        drawings = correction_figures(correction, report, ties)
    content = _content(survey, correction, report, drawings) | _model(report.model)
    content["target_figures"] = [(title, data_uri(picture, "png")) for title, picture in figures]
    content |= {"close_ups": [], "close_up_of": {}, "scene": None}
    scripts: tuple[str, ...] = ()
    if views is not None:
        content |= cloud_content(views, report.targets)
        scripts = ("slide.js", "view.js", "turn.js")
    worst = worst_target(report.targets)
    name = None if worst is None else worst.name
    content["hero"] = next((pair for pair in content["close_ups"] if pair["name"] == name), None)
    marked = worst if content["hero"] else None
    content["locator"] = data_uri(svg(locator_map(correction, report, marked)))
    Page(
        title=f"{survey.project.title or survey.name}: correction of a mobile laser scan",
        summary="summary.html",
        sections={name: title for name, title in SECTIONS.items() if there.get(name, True)},
        content=content,
        styles=("correction.css",),
        scripts=scripts,
    ).write(path)


def _content(survey, correction, report, drawings):
    """Content of the templates, except cloud and model."""
    return {
        "survey": survey,
        "report": report,
        **statements_section(statements(report)),
        "title": survey.project.title or survey.name,
        "numbers": three_numbers(correction, report),
        "heading": facts(survey, report),
        "facts": key_figures(correction, report),
        "check_sigmas": sigmas_section(report.check_sigmas),
        "weak": list(zip(report.support.weak, weak_places(correction, report), strict=True)),
        "next_places": next_places(correction, report),
        "tie_sentences": tables.tie_sentences(report.ties, report.points("control").scored),
        "tie_pairs": _largest(report.ties),
        "rmse_rows": tables.rmse_rows(report),
        "statistics": tables.statistics_rows(report),
        "figures": drawn(drawings),
        "groups": [(name, ordered(report.targets, name)) for name in GROUPS],
        "has_left_out": any(np.isfinite(row.left_out).all() for row in report.targets),
        "coverage": coverage(correction, report),
        "systems": systems(survey),
        "notes": list(dict.fromkeys([*survey.notes, *report.notes])),
        "files": files(report),
        "zero_time": f"{np.floor(correction.recorded.gps_time[0]):.0f}",
    }


def sigmas_section(sigmas: CheckSigmas | None) -> dict[str, str] | None:
    """Sentence and figure on the stated sigmas; None without check points.

    Parameters
    ----------
    sigmas : CheckSigmas or None
    """
    if sigmas is None:
        return None
    (sentence,) = in_words([sigmas_statement(sigmas)])
    return {"sentence": sentence, "figure": data_uri(svg(sigma_figure(sigmas.z)))}


def weak_places(correction: Correction, report: CorrectionReport) -> list[list[float]]:
    """Middle of each poorly constrained interval on the corrected drive: E, N, H in m.

    Parameters
    ----------
    correction : Correction
    report : CorrectionReport
    """
    middles = [(interval.start + interval.end) / 2 for interval in report.support.weak]
    return _places(correction, middles)


def next_places(correction: Correction, report: CorrectionReport) -> list[list[float]]:
    """Positions along the drive for further control points: E, N, H in m.

    Parameters
    ----------
    correction : Correction
    report : CorrectionReport
    """
    return _places(correction, [place.gps_time for place in report.next_control])


def _places(correction, times):
    """Positions of the corrected drive at the epochs next to some times."""
    corrected = correction.corrected
    rows = np.searchsorted(corrected.gps_time, times).clip(0, len(corrected) - 1)
    return np.round(corrected.position[rows], 2).tolist()


def _largest(ties):
    """Rows of the pairs of passes with the most ties."""
    rows = ties["pairs"] if ties and ties["n"] else []
    return sorted(rows, key=lambda row: -row["n"])[: SETTINGS.axis_names]


def _model(model):
    """Template content of the model: pairs, tables and outliers."""
    rest = {key: value for key, value in model.items() if key not in ("outliers", "warnings")}
    if rest["order"] < 0:
        rest["order"] = "none"
    lists = {key: rest.pop(key) for key in list(rest) if _is_table(rest[key])}
    return {
        "model": model_rows(rest),
        "outliers": model.get("outliers") or [],
        "model_tables": [(*TABLES.get(key, (key.capitalize(), "")), r) for key, r in lists.items()],
    }


def _is_table(value):
    return isinstance(value, list) and bool(value) and all(isinstance(row, dict) for row in value)


def key_figures(correction: Correction, report: CorrectionReport) -> list[tuple[str, str]]:
    """Pairs (number, meaning) that follow the three on top.

    Parameters
    ----------
    correction : Correction
    report : CorrectionReport
    """
    change = np.linalg.norm(correction.corrected.position - correction.recorded.position, axis=1)
    figures = []
    deeds = {
        "control": ("used for the correction", "used"),
        "check": ("used to test it", "available to test it"),
    }
    for role, (what, nothing) in deeds.items():
        points, n = report.count(role)
        deed = what if points else nothing
        often = "" if n == points else f", {n} observations"
        surveyed = report.points(role).surveyed
        if points < surveyed:
            share = f"{points} of {surveyed}"
        else:
            share = str(points)
        figures.append((share, f"{role} point{'s' * (points != 1)} {deed}{often}"))
    figures.append((f"{number(float(change.max()))} m", "largest correction of the position"))
    sigma = report.position_sigma
    if sigma is not None:
        median = f"{number(sigma['median'])} m"
        figures.append((median, "3D sigma of the corrected position, median"))
    return [*figures, (thousands(report.cloud_points), "points in the cloud files")]


FRAMES = {
    "Frame: map": "easting, northing, height in m, as in the files",
    "Frame: body": "X right, Y forward, Z up, at the navigation center of the trajectory",
    "Frame: attitude": "heading clockwise from grid north, pitch nose up, roll right side down; "
    "R = Rz(−heading) Rx(pitch) Ry(roll)",
}
TIMES = {"week": "GPS seconds of week", "standard": "adjusted standard GPS time"}


def systems(survey: Survey) -> list[tuple[str, str]]:
    """Pairs (name, value) on systems, frames, and assumed accuracies of the instruments."""
    trajectory = survey.trajectory
    time = survey.trajectory.gps_time
    crs = survey.crs or "not stated in survey.toml; coordinates are assumed to be E, N, H in m"
    pairs = [("Coordinate reference system", crs), *FRAMES.items()]
    if trajectory.weeks is None:
        week_end = ""
    else:
        week_end = ", continued past the end of the GPS week"
    span = f"gps_time {time[0]:.3f} to {time[-1]:.3f} s{week_end}"
    pairs.append(("Time of the trajectory", span))
    pairs += dict.fromkeys((f"Time of {cloud.path.name}", _time(cloud)) for cloud in survey.clouds)
    rate = 1 / np.median(np.diff(time))
    pairs.append(("Epochs of the trajectory", f"{thousands(len(time))} at {rate:.4g} Hz"))
    sigma = "stated for each epoch"
    if trajectory.position_sigma is None:
        if survey.has_assumed_position:
            origin = "a default"
        else:
            origin = "from survey.toml"
        sigma = f"{survey.pos.position_sigma:g} m at all times, {origin}"
    kind = "Assumed" if survey.has_assumed_position else "Stated"
    pairs.append((f"{kind} sigma of the trajectory's position", sigma))
    for name, part in survey.by_scanner.items():
        text = "not given (not needed when only the trajectory is corrected)"
        if part.mounting is not None:
            text = f"right, forward, up {', '.join(f'{v:g}' for v in part.mounting.lever_arm)} m"
        scanner = "the scanner"
        if name:
            scanner = f"scanner {name}"
        pairs.append((f"Lever arm of {scanner}", text))
    return pairs


def _time(cloud):
    system = TIMES.get(cloud.time_system, cloud.time_system)
    if cloud.new_week > -np.inf:
        system += f", continued where they restart (+{WEEK:.0f} s)"
    if not cloud.time_constant:
        return f"{system}, as in the trajectory"
    return f"{system}; {cloud.time_constant:+.3f} s converts to the trajectory's"


def files(report: CorrectionReport) -> dict[str, list[tuple[str, str, str, str]]]:
    """Rows (role, name, size in words, SHA-256) of inputs and outputs.

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
    """Pairs (name, value) on the coverage by control points and trajectory.

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
        control = "no control point was used"
    seconds = number(report.seconds_extrapolated, 1)
    metres = number(report.metres_extrapolated, 0)
    outside = covered.points_outside_trajectory
    beyond = covered.points_outside_control
    extrapolated = covered.points_extrapolated
    gaps = correction.recorded.gaps
    noise = covered.points_noise
    values = {
        "Trajectory": span(time[0], time[-1]),
        "Control span (first to last control epoch)": control,
        "Longest time without control within a pass": f"{number(covered.longest_gap_s)} s",
        "Points outside the trajectory (not corrected)": points(outside),
        "Points before the first or after the last control point": points(beyond),
        "Points with extrapolated correction (outside the control)": points(extrapolated),
        "Points flagged as noise (not used for measurements, corrected like all others)": points(
            noise
        ),
        "Time and distance with extrapolated correction": f"{seconds} s, {metres} m",
        "Gaps of the trajectory (nothing is interpolated across them)": len(gaps),
        "Jumps of the correction at jumps of the recorded position": _jumps(report),
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
