"""Page of a calibration, and its first screen."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from mlscorr.estimate import MOUNTING_COMPONENTS, SETTINGS
from mlscorr.evaluate import PointCounts, TargetRow
from mlscorr.report.headline import (
    StatementRow,
    check_statement,
    control_statement,
    statements_section,
    warning_statements,
)
from mlscorr.report.pages import Page
from mlscorr.survey import Severity, Statement

PARTS = ("lever_arm", "boresight")
SECTIONS = {
    "mounting": "Corrections",
    "misclosures": "Misclosures",
    "targets": "Targets",
    "correlation": "Correlation",
    "notes": "Input",
}


def calibration_screen(content: dict[str, Any], rows: list[TargetRow]) -> dict[str, object]:
    """``rating`` and ``statements`` of calibration.json.

    Parameters
    ----------
    content : dict
        Rest of calibration.json, for one scanner.
    rows : list of TargetRow
        One for each surveyed point and pass.
    """
    return statements_section(calibration_statements(content, rows))


def calibration_statements(content: dict[str, Any], rows: list[TargetRow]) -> list[StatementRow]:
    """Rows of the first screen of a calibration, in order.

    Parameters
    ----------
    content : dict
        Rest of calibration.json, for one scanner.
    rows : list of TargetRow
        One for each surveyed point and pass.
    """
    control = PointCounts.of(rows, "control")
    facts = [
        StatementRow.of("Mounting", _lack(content)),
        StatementRow.of("Determined", _determined(content)),
        StatementRow.of("Result", _remainder(content)),
    ]
    if control.surveyed:
        facts.append(control_statement(control))
    facts.append(check_statement(PointCounts.of(rows, "check")))
    return [
        *facts,
        *_scanner(content),
        *_ties(content),
        *warning_statements(content["warnings"]),
    ]


def scanners_screen(content: dict[str, Any]) -> dict[str, object]:
    """``rating`` and ``statements`` common to several scanners.

    Parameters
    ----------
    content : dict
        Rest of calibration.json, for scanners calibrated together.
    """
    return statements_section(scanners_statements(content))


def scanners_statements(content: dict[str, Any]) -> list[StatementRow]:
    """Rows on scanners that were calibrated together, in order.

    Parameters
    ----------
    content : dict
        Rest of calibration.json.
    """
    return [*_relative(content), *_ties(content), *warning_statements(content["warnings"])]


def _relative(content) -> Iterator[StatementRow]:
    """Yield the accuracy of each further scanner's mounting relative to the first."""
    for name, row in content["relative"].items():
        fit = row["fit_sigma"]
        sigmas = {part: row[part]["sigma"] for part in PARTS}
        values = {"first": row["beside"], "name": name, "fit": fit, **sigmas}
        severity: Severity = "warning"
        if fit is not None and fit < SETTINGS.determined_sigma[0]:
            severity = "note"
        yield StatementRow.of("Together", Statement("scanners together", severity, values))


def component_rows(content: dict[str, Any]) -> list[dict[str, Any]]:
    """Rows of the mounting's components: recorded value, correction, sigma, by both methods.

    Parameters
    ----------
    content : dict
        Of one scanner. Units: m and deg.
    """
    names = iter(MOUNTING_COMPONENTS)
    known = iter(content["determined"])
    known_by = {"lsc": True, "ls": content["ls"]["control"]["n"] > 0}  # LS uses control only
    return [
        {
            "name": next(names),
            "unit": unit,
            "recorded": content["mounting"]["recorded"][part][axis],
            "calibrated": content["mounting"]["calibrated"][part][axis],
            **{
                method + after: content[method][part][kind][axis] if is_known else None
                for method, is_known in known_by.items()
                for after, kind in (("", "correction"), ("_sigma", "sigma"))
            },
            "determined": next(known),
        }
        for part, unit in zip(PARTS, ("m", "deg"), strict=True)
        for axis in range(3)
    ]


def _lacking(content):
    """Components whose correction exceeds its sigma."""
    return [
        row
        for row in component_rows(content)
        if abs(row["lsc"]) > SETTINGS.setup_sigmas * row["lsc_sigma"]
    ]


def _lack(content):
    """Statement on whether the recorded mounting is correct."""
    lacking = _lacking(content)
    if lacking:
        return Statement("mounting lacks", "warning", {"components": lacking})
    if not any(content["determined"]):
        return Statement("mounting not told", "warning")
    values = {"sigmas": SETTINGS.setup_sigmas}
    if all(content["determined"]):
        return Statement("mounting holds", values=values)
    return Statement("determined parts hold", values=values)


def _determined(content):
    """Statement on the components determined by this geometry."""
    undetermined = [row for row in component_rows(content) if not row["determined"]]
    count = len(MOUNTING_COMPONENTS)
    if not undetermined:
        return Statement("all parts determined", values={"count": count})
    values = {"components": undetermined, "count": count}
    return Statement("parts not determined", "warning", values)


def _remainder(content):
    """Statement on the residuals of targets before and after, at check points if there are any."""
    role = "control"
    if content["lsc"]["check"]["n"]:
        role = "check"
    group = content["lsc"][role]
    if group["n"] == 0:
        return Statement("no target", "warning")
    before, after = (group[state]["rmse_3d"] for state in ("before", "after"))
    values = {"role": role, "before": before, "after": after}
    if role == "control":
        return Statement("fit of a calibration", "warning", values)
    if after <= before:
        return Statement("calibration tested", values=values)
    if _is_off(content["scanner_errors"]):
        return Statement("worse by the scanner", "warning", values)
    if not _lacking(content):
        return Statement("worse by chance", "warning", values)
    return Statement("calibration tested", "fault", values)


def _is_off(errors):
    """True if the scanner itself is wrong; False without a test."""
    return any(row["significant"] for row in (errors or {}).values())


def _scanner(content) -> Iterator[StatementRow]:
    """Yield statements on errors of the scanner's ranges and encoder."""
    errors = content["scanner_errors"]
    if errors is None:
        return
    values = {part: errors[part] for part in ("range_offset", "encoder_scale")}
    if _is_off(errors):
        fact = Statement("scanner is off", "warning", values)
    elif all(row["determined"] for row in errors.values()):
        fact = Statement("scanner is right", values=values)
    else:
        fact = Statement("scanner hardly told", values=values)
    yield StatementRow.of("Scanner", fact)


def _ties(content) -> Iterator[StatementRow]:
    """Yield statements on the differences between passes in overlaps."""
    ties = content["ties"]
    if ties is None or not ties["used"]:
        return
    without_drift = None
    if "with_drift" in content:
        without_drift = content["with_drift"]["ties"]["after"]["median"]
    values = {
        "used": ties["used"],
        "n": ties["n"],
        "is_between_scanners": any(len(set(row["scanners"])) > 1 for row in ties["pairs"]),
        "before": ties["before"]["median"],
        "after": ties["after"]["median"],
        "without_drift": without_drift,
    }
    yield StatementRow.of("Tie features", Statement("two passes", values=values))


def calibration_page(content: dict[str, Any]) -> Page:
    """Make the page of calibration.json.

    Parameters
    ----------
    content : dict
        Complete document, of one scanner or of several.
    """
    scanners = content.get("scanners") or {"": content}
    shared = content if "scanners" in content else None
    parts = {name: part | {"components": component_rows(part)} for name, part in scanners.items()}
    return Page(
        title=f"{content['name']}: calibration of the mounting",
        summary="calibration-summary.html",
        sections=SECTIONS,
        content={
            "name": content["name"],
            "scanners": parts,
            "shared": shared,
            "components": MOUNTING_COMPONENTS,
            "norm3": _norm,
            "files": content.get("files"),
        },
        prefix="calibration-",
    )


def _norm(values):
    """Length of a vector in a document; NaN without one."""
    if values and None not in values:
        return float(np.linalg.norm(values))
    return np.nan
