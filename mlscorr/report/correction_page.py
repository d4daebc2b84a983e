"""The page of a correction."""

from pathlib import Path

import numpy as np

from mlscorr.correction import Correction
from mlscorr.estimate import TieResiduals
from mlscorr.report import tables
from mlscorr.report._provenance import coverage, files, systems
from mlscorr.report.cloud import CloudViews, cloud_content
from mlscorr.report.correction_report import GROUPS, CorrectionReport, ordered
from mlscorr.report.figures import correction_figures
from mlscorr.report.headline import statements, statements_section
from mlscorr.report.pages import Page, data_uri, drawn
from mlscorr.report.settings import SETTINGS
from mlscorr.report.target_figures import target_drawings
from mlscorr.survey import Survey
from mlscorr.targets import FittedTarget
from mlscorr.wording import number, thousands

SECTIONS = {  # in their order; one without anything to show is left out
    "statistics": "How far off",
    "accuracy": "Accuracy",
    "pictures": "Before and after",
    "turn": "3D view",
    "correction": "Over time",
    "map": "Map",
    "ties": "Two passes",
    "residuals": "Every target",
    "targets": "As found",
    "model": "Model",
    "used": "What was used",
    "conventions": "Conventions",
}
WORDS = {
    "alternatives": "models that were compared",
    "orders": "orders of the trend, side by side",
    "tests": "what the other control points say of each",
    "estimated_by": "estimated by",
    "order": "order of the polynomial trend",
    "sigma0": "sigma0 (1 when the stated sigmas are right)",
    "correlation_time": "correlation time (s)",
}


def write_report(
    path: str | Path,
    survey: Survey,
    correction: Correction,
    report: CorrectionReport,
    views: CloudViews | None = None,
    fitted: dict[tuple[int, float], FittedTarget] | None = None,
    ties: TieResiduals | None = None,
) -> None:
    """Write the self-contained page of a correction.

    Parameters
    ----------
    path : path
        The HTML file.
    survey : Survey
    correction : Correction
        Its corrected trajectory may hold the sigmas after the estimate.
    report : CorrectionReport
    views : CloudViews, optional
        Pictures of the cloud and the data of the 3D view; without them both are left out.
    fitted : dict, optional
        FittedTarget by (pass number, gps_time), each of which gets a figure.
    ties : TieResiduals, optional
        What two passes both saw; without any the section is left out.
    """
    figures = target_drawings(report.targets, fitted or {})
    there = {"pictures": views is not None, "turn": views is not None, "targets": bool(figures)}
    there |= {"ties": ties is not None, "residuals": bool(report.targets)}
    content = _content(survey, correction, report, ties) | _model(report.model)
    content["target_figures"] = [(title, data_uri(picture, "png")) for title, picture in figures]
    if views is not None:
        content |= cloud_content(views, report.targets)
    Page(
        title=f"{survey.name}: correction of a mobile laser scan",
        summary="summary.html",
        sections={name: title for name, title in SECTIONS.items() if there.get(name, True)},
        content=content,
        scripts=() if views is None else ("slide.js", "turn.js"),
    ).write(path)


def _content(survey, correction, report, ties):
    """Everything that the templates show, except of cloud and model."""
    return {
        "survey": survey,
        "report": report,
        **statements_section(statements(report)),
        "facts": key_figures(correction, report),
        "tie_sentences": tables.tie_sentences(report.ties, report.points("control").scored),
        "tie_pairs": _largest(report.ties),
        "rmse_rows": tables.rmse_rows(report),
        "statistics": tables.statistics_rows(report),
        "figures": drawn(correction_figures(correction, report, ties)),
        "groups": [(name, ordered(report.targets, name)) for name in GROUPS],
        "has_left_out": any(np.isfinite(row.left_out).all() for row in report.targets),
        "coverage": coverage(correction, report),
        "systems": systems(survey),
        "notes": list(dict.fromkeys([*survey.notes, *report.notes])),
        "files": files(report),
        "zero_time": f"{np.floor(correction.recorded.gps_time[0]):.0f}",
    }


def _largest(ties):
    """Rows of the pairs of passes with the most ties."""
    rows = ties["pairs"] if ties and ties["n"] else []
    return sorted(rows, key=lambda row: -row["n"])[: SETTINGS.axis_names]


def _model(model):
    """What the templates show of the model: pairs, tables and outliers."""
    rest = {key: value for key, value in model.items() if key not in ("outliers", "warnings")}
    if rest["order"] < 0:
        rest["order"] = "none"
    lists = {key: rest.pop(key) for key in list(rest) if _is_table(rest[key])}
    return {
        "model": [pair for key, value in rest.items() for pair in _pairs(key, value)],
        "outliers": model.get("outliers") or [],
        "model_tables": [(_title(key), rows) for key, rows in lists.items()],
    }


def _is_table(value):
    return isinstance(value, list) and bool(value) and all(isinstance(row, dict) for row in value)


def _title(key):
    """A key of the model in words."""
    words = WORDS.get(key, key.replace("_", " "))
    return words[:1].upper() + words[1:]


def _pairs(key, value):
    """Pairs (name, value) of an entry of the model, a nested one level by level."""
    if not isinstance(value, dict) or not value:
        return [(_title(key), value)]
    return [(f"{_title(key)}: {_title(below)}", item) for below, item in value.items()]


def key_figures(correction: Correction, report: CorrectionReport) -> list[tuple[str, str]]:
    """Pairs (number, what it is) that a client reads first.

    Parameters
    ----------
    correction : Correction
    report : CorrectionReport
    """
    change = np.linalg.norm(correction.corrected.position - correction.recorded.position, axis=1)
    before, after, kind = report.judgement
    facts = []
    if before is not None and after is not None:
        title = {
            "check": "3D RMSE of check points",
            "leave-one-out": "3D RMSE of control points, each left out in turn",
            "fit": "3D RMSE of control points (fit only)",
        }[kind]
        pair = [number(statistics.rmse[4]) for statistics in (before, after)]
        facts.append((f"{pair[0]} → {pair[1]} m", title))
    deeds = {
        "control": ("made the correction", "took part"),
        "check": ("tested it", "were there to test it"),
    }
    for role, (what, nothing) in deeds.items():
        points, n = report.count(role)
        deed = what if points else nothing
        often = "" if n == points else f", seen {n} times"
        surveyed = report.points(role).surveyed
        if points < surveyed:
            share = f"{points} of {surveyed}"
        else:
            share = str(points)
        facts.append((share, f"{role} point{'s' * (points != 1)} {deed}{often}"))
    facts.append((f"{number(float(change.max()))} m", "largest correction of the position"))
    sigma = report.position_sigma
    if sigma is not None:
        median = f"{number(sigma['median'])} m"
        facts.append((median, "3D sigma of the corrected position, median"))
    return [*facts, (thousands(report.cloud_points), "points in the cloud files")]
