"""The page: one HTML file that holds its style, scripts and figures, for reading offline."""

from pathlib import Path

import numpy as np

from mlscorr.report import tables
from mlscorr.report.figures import drawings
from mlscorr.report.shown import shown
from mlscorr.report.skeleton import data_uri, environment, now, versions
from mlscorr.report.target_figures import target_drawings
from mlscorr.report.used import coverage, files, used

SECTIONS = {  # in their order; one without anything to show is left out
    "statistics": "How far off",
    "accuracy": "Accuracy",
    "pictures": "Before and after",
    "turn": "3D view",
    "correction": "Over time",
    "map": "Map",
    "residuals": "Every target",
    "targets": "As found",
    "model": "Model",
    "used": "What was used",
    "conventions": "Conventions",
}
SHOWN_ELSEWHERE = ("outliers", "warnings")
WORDS = {
    "alternatives": "models that were compared",
    "orders": "orders of the trend, side by side",
    "tests": "what the other control points say of each",
    "estimated_by": "estimated by",
    "order": "order of the polynomial trend",
    "sigma0": "sigma0 (1 when the stated sigmas are right)",
    "correlation_time": "correlation time (s)",
}


def write_report(path, survey, correction, document, seen=None, fitted=None):
    """Write the self-contained page of a correction.

    Parameters
    ----------
    path : path
        The HTML file.
    survey : Survey
    correction : Correction
        Its corrected trajectory may hold the sigmas after the estimate.
    document : dict
        The content of report.json; a value that was not determined is None.
    seen : CloudViews, optional
        Pictures of the cloud and the scene of the 3D view; without them both are left out.
    fitted : dict, optional
        FittedTarget by (pass number, gps_time), each of which gets a figure.
    """
    templates = environment()
    templates.filters["norm"] = tables.norm
    templates.globals |= {"group": tables.group, "AXES": tables.AXES}
    missing = {name for name in ("pictures", "turn") if seen is None}
    missing |= {name for name in ("targets",) if not fitted}
    templates.globals["sections"] = {
        name: title for name, title in SECTIONS.items() if name not in missing
    }
    found = content(survey, correction, document)
    found |= shown(seen, document) if seen is not None else {}
    figures = target_drawings(document["targets"], fitted or {})
    found["target_figures"] = [(title, data_uri(picture, "png")) for title, picture in figures]
    page = templates.get_template("report.html").render(found)
    Path(path).write_text(page, encoding="utf-8")


def content(survey, correction, document):
    """Everything that the template shows, except of the cloud."""
    sentences, worse = tables.verdict(document)
    figures = drawings(survey, correction, document).items()
    model = {k: v for k, v in document["model"].items() if k not in SHOWN_ELSEWHERE}
    lists = {key: value for key, value in model.items() if is_table(value)}
    return {
        "survey": survey,
        "document": document,
        "sentences": sentences,
        "worse": worse,
        "facts": key_figures(correction, document),
        "warnings": warnings(document),
        "rmse_rows": tables.rmse_rows(document),
        "statistics": tables.statistics_rows(document),
        "accuracy": document.get("accuracy"),
        "figures": {name: data_uri(picture) for name, picture in figures},
        "groups": [(name, tables.ordered(document["targets"], name)) for name in tables.GROUPS],
        "has_left_out": any(row.get("left_out") for row in document["targets"]),
        "model": flat({k: v for k, v in model.items() if k not in lists}),
        "outliers": document["model"].get("outliers") or [],
        "model_tables": [(title(key), rows) for key, rows in lists.items()],
        "coverage": coverage(correction, document),
        "used": used(survey),
        "files": files(document),
        "zero_time": f"{np.floor(correction.recorded.gps_time[0]):.0f}",
        "has_sigma": correction.corrected.position_sigma is not None,
        "versions": versions(),
        "written": document.get("created") or now(),
    }


def is_table(value):
    """Whether a value of the model is rows of a table."""
    return isinstance(value, list) and bool(value) and all(isinstance(row, dict) for row in value)


def title(key):
    """A key of the model in words."""
    words = WORDS.get(key, key.replace("_", " "))
    return words[:1].upper() + words[1:]


def flat(model):
    """Pairs (name, value) of a document, nested ones one level down, names in words."""
    pairs = []
    for key, value in model.items():
        inner = value.items() if isinstance(value, dict) and value else [(None, value)]
        for below, item in inner:
            name = f"{title(key)}: {title(below)}" if below else title(key)
            pairs.append((name, item))
    return pairs


def key_figures(correction, document):
    """Pairs (number, what it is) that a client reads first."""
    change = np.linalg.norm(correction.corrected.position - correction.recorded.position, axis=1)
    before, after, kind = tables.independent(document)
    facts = []
    if kind != "nothing":
        title = {
            "check": "3D RMSE of check points",
            "leave-one-out": "3D RMSE of control points, each left out in turn",
            "fit": "3D RMSE of control points (fit only)",
        }[kind]
        pair = [tables.number(tables.norm(values)) for values in (before, after)]
        facts.append((f"{pair[0]} → {pair[1]} m", title))
    for role, what in (("control", "made the correction"), ("check", "tested it")):
        points, n = tables.seen(document, role)
        what = what if points else "were there to test it"
        often = "" if n == points else f", seen {n} times"
        facts.append((str(points), f"{role} point{'s' * (points != 1)} {what}{often}"))
    facts.append((f"{tables.number(float(change.max()))} m", "largest correction of the position"))
    sigma = correction.corrected.position_sigma
    if sigma is not None:
        typical = float(np.median(np.linalg.norm(sigma, axis=1)))
        facts.append((f"{tables.number(typical)} m", "3D sigma of the corrected position, median"))
    points = sum(file["points"] or 0 for file in document["files"])
    return [*facts, (tables.thousands(points), "points in the cloud files")]


def warnings(document):
    """Warnings of the document and of its model, each once."""
    found = [*(document.get("warnings") or []), *(document["model"].get("warnings") or [])]
    return list(dict.fromkeys(found))
