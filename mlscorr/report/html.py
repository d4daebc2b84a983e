"""The page: one HTML file that holds its style and its figures, for reading without a network."""

import base64
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from mlscorr.report import tables
from mlscorr.report.figures import drawings
from mlscorr.report.target_figures import target_drawings

LIBRARIES = ("numpy", "scipy", "laspy", "lazrs", "numba", "pyproj", "matplotlib")
SHOWN_ELSEWHERE = ("outliers", "alternatives", "orders", "tests", "warnings")
WORDS = {
    "estimated_by": "estimated by",
    "order": "order of the polynomial trend",
    "sigma0": "sigma0 (1 when the stated sigmas are right)",
    "correlation_time": "correlation time (s)",
}


def write_report(path, survey, correction, document, fitted=None):
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
    fitted : dict, optional
        FittedTarget by (pass number, gps_time), each of which gets a figure.
    """
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"number": tables.number, "show": show, "norm": tables.norm}
    environment.globals |= {"group": tables.group, "AXES": tables.AXES}
    page = environment.get_template("report.html").render(
        content(survey, correction, document, fitted or {})
    )
    Path(path).write_text(page, encoding="utf-8")


def content(survey, correction, document, fitted):
    """Everything that the template shows."""
    sentences, worse = tables.verdict(document)
    figures = drawings(survey, correction, document).items()
    return {
        "survey": survey,
        "document": document,
        "sentences": sentences,
        "worse": worse,
        "facts": key_figures(correction, document),
        "warnings": warnings(document),
        "rmse_rows": tables.rmse_rows(document),
        "figures": {name: data_uri(picture) for name, picture in figures},
        "target_figures": [
            (title, data_uri(picture, "image/png"))
            for title, picture in target_drawings(document["targets"], fitted)
        ],
        "groups": [(name, tables.ordered(document["targets"], name)) for name in tables.GROUPS],
        "model": flat({k: v for k, v in document["model"].items() if k not in SHOWN_ELSEWHERE}),
        "outliers": document["model"].get("outliers") or [],
        "comparisons": [
            (title, document["model"].get(key) or [])
            for key, title in (
                ("alternatives", "Models that were compared"),
                ("orders", "Orders of the trend, side by side"),
                ("tests", "What the other control points say of each"),
            )
        ],
        "coverage": coverage(correction, document),
        "zero_time": f"{np.floor(correction.recorded.gps_time[0]):.0f}",
        "gaps": len(correction.recorded.gaps),
        "has_sigma": correction.corrected.position_sigma is not None,
        "versions": versions(),
        "written": document.get("created") or f"{datetime.now(UTC):%Y-%m-%d %H:%M:%S} UTC",
    }


def data_uri(picture, form="image/svg+xml"):
    """A picture (bytes) as the address of an image that lies in the page itself."""
    return f"data:{form};base64," + base64.b64encode(picture).decode()


def show(value):
    """Any value of the model in words, numbers with four figures.

    >>> show([0.25, None]), show(True), show({"E": 12.0})
    ('0.25, not determined', 'yes', 'E: 12')
    """
    if value is None:
        return "not determined"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int | float):
        return f"{value:d}" if isinstance(value, int) else f"{value:.4g}"
    if isinstance(value, dict):
        return "; ".join(f"{key}: {show(item)}" for key, item in value.items())
    if isinstance(value, list | tuple):
        return ", ".join(show(item) for item in value) or "none"
    return str(value)


def flat(model):
    """Pairs (name, value) of a document, nested ones one level down, names in words."""
    pairs = []
    for key, value in model.items():
        inner = value.items() if isinstance(value, dict) and value else [(None, value)]
        for below, item in inner:
            name = WORDS.get(below or key, (below or key).replace("_", " "))
            name = f"{key}: {name}" if below else name
            pairs.append((name[:1].upper() + name[1:], item))
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
        often = "" if n == points else f", seen {n} times"
        facts.append((str(points), f"{role} point{'s' * (points != 1)} {what}{often}"))
    facts.append((f"{tables.number(float(change.max()))} m", "largest correction of the position"))
    sigma = correction.corrected.position_sigma
    if sigma is not None:
        typical = float(np.median(np.linalg.norm(sigma, axis=1)))
        facts.append((f"{tables.number(typical)} m", "3D sigma of the corrected position, median"))
    points = sum(file["points"] or 0 for file in document["files"])
    return [*facts, (f"{points:,}".replace(",", " "), "points in the cloud files")]


def warnings(document):
    """Warnings of the document and of its model, each once."""
    found = [*(document.get("warnings") or []), *(document["model"].get("warnings") or [])]
    return list(dict.fromkeys(found))


def coverage(correction, document):
    """Pairs (what, value) on what the control points and the trajectory cover."""
    given, time = document["coverage"], correction.recorded.gps_time
    span = given.get("control_span")
    pairs = [("Trajectory", f"{time[0]:.3f} to {time[-1]:.3f} s ({time[-1] - time[0]:.1f} s)")]
    if span:
        text = f"{span[0]:.3f} to {span[1]:.3f} s ({span[1] - span[0]:.1f} s)"
        pairs.append(("Control span (first to last control epoch)", text))
    else:
        pairs.append(("Control span (first to last control epoch)", "not determined"))
    longest = given.get("longest_gap_s")
    pairs.append(
        ("Longest gap", "not determined" if longest is None else f"{tables.number(longest)} s")
    )
    total = sum(file["points"] or 0 for file in document["files"])
    for key, words in (
        ("points_outside_trajectory", "Points outside the trajectory (left as they were)"),
        ("points_outside_control", "Points outside the control span (correction extrapolated)"),
    ):
        n = given.get(key)
        share = f" ({100 * n / total:.2f} %)" if n and total else ""
        text = "not determined" if n is None else f"{n:,}".replace(",", " ") + share
        pairs.append((words, text))
    return pairs


def versions():
    """Pairs (name, version) of mlscorr and the libraries that made the numbers."""
    pairs = []
    for name in ("mlscorr", *LIBRARIES):
        try:
            pairs.append((name, version(name)))
        except PackageNotFoundError:
            continue
    return pairs
