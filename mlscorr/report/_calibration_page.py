"""The page of a calibration, and what it says first."""

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
from mlscorr.wording import length_in_words, millimetres

PARTS = ("lever_arm", "boresight")
SECTIONS = {
    "mounting": "What it lacks",
    "misclosures": "How far off",
    "targets": "Every target",
    "correlation": "What looks alike",
    "notes": "What was used",
}


def calibration_screen(content: dict[str, Any], rows: list[TargetRow]) -> dict[str, object]:
    """``rating`` and ``statements`` of calibration.json.

    Parameters
    ----------
    content : dict
        The other content of calibration.json, of one scanner.
    rows : list of TargetRow
        One for each surveyed point and pass.
    """
    control = PointCounts.of(rows, "control")
    facts = [_lack(content), _determined(content), _remainder(content)]
    if control.surveyed:
        facts.append(control_statement(control))
    facts.append(check_statement(PointCounts.of(rows, "check")))
    facts += [*_scanner(content), *_ties(content)]
    return statements_section([*facts, *warning_statements(content["warnings"])])


def scanners_screen(content: dict[str, Any]) -> dict[str, object]:
    """``rating`` and ``statements`` on what the scanners share.

    Parameters
    ----------
    content : dict
        The other content of calibration.json, of scanners that were calibrated together.
    """
    facts = [*_relative(content), *_ties(content), *warning_statements(content["warnings"])]
    return statements_section(facts)


def _relative(content) -> Iterator[StatementRow]:
    """How well it is known how each further scanner stands beside the first."""
    for name, row in content["relative"].items():
        first = row["beside"]
        fit = row["fit_sigma"]
        arm, turn = (row[part]["sigma"] for part in PARTS)
        both = f"No wall that scanners {first} and {name} both saw holds them."
        if fit is not None:
            both = (
                f"Scanners {first} and {name} put a wall that both saw in one place to "
                f"{millimetres(fit)} mm."
            )
        sentence = (
            f"{both} Scanner {name} beside scanner {first}: lever arm to "
            f"{'/'.join(map(millimetres, arm))} mm right/forward/up, boresight to "
            f"{'/'.join(f'{sigma:.3f}' for sigma in turn)} deg about them (one sigma)."
        )
        is_held = fit is not None and fit < SETTINGS.determined_sigma[0]
        yield StatementRow("Together", "green" if is_held else "amber", sentence)


def component_rows(content: dict[str, Any]) -> list[dict[str, Any]]:
    """A row for each part of the mounting: recorded, what it lacks, sigma, by both methods.

    Parameters
    ----------
    content : dict
        Of one scanner. Units: m and deg.
    """
    names = iter(MOUNTING_COMPONENTS)
    known = iter(content["determined"])
    known_by = {"lsc": True, "ls": content["ls"]["control"]["n"] > 0}  # LS takes control alone
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


def _lacks(content):
    """What the recorded mounting lacks beyond its sigma, in words of each part."""
    return [
        f"{row['name']} {_size(row['lsc'], row['lsc_sigma'], row['unit'])}"
        f"{'' if row['determined'] else ' (not determined)'}"
        for row in component_rows(content)
        if abs(row["lsc"]) > SETTINGS.setup_sigmas * row["lsc_sigma"]
    ]


def _lack(content):
    """Whether the recorded mounting holds."""
    lacks = _lacks(content)
    if not lacks and not any(content["determined"]):
        sentence = "This geometry does not tell whether the recorded mounting holds."
        return StatementRow("Mounting", "amber", sentence)
    if not lacks:
        sigmas = f"it lacks nothing beyond {SETTINGS.setup_sigmas:g} sigmas"
        if all(content["determined"]):
            return StatementRow("Mounting", "green", f"The recorded mounting holds: {sigmas}.")
        sentence = f"The recorded mounting holds in the parts that are determined: {sigmas}."
        return StatementRow("Mounting", "green", sentence)
    return StatementRow("Mounting", "amber", f"The recorded mounting lacks {', '.join(lacks)}.")


def _size(value, sigma, unit):
    """A value with its sigma in mm or deg."""
    if unit == "m":
        return f"{millimetres(value)} ± {millimetres(sigma)} mm"
    return f"{value:.3f} ± {sigma:.3f} deg"


def _determined(content):
    """Which parts this geometry tells."""
    open_parts = [
        f"{row['name']} {_size(row['lsc'], row['lsc_sigma'], row['unit'])}"
        for row in component_rows(content)
        if not row["determined"]
    ]
    count = len(MOUNTING_COMPONENTS)
    if not open_parts:
        return StatementRow("Determined", "green", f"All {count} parts by this geometry.")
    sentence = (
        f"{count - len(open_parts)} of {count} parts by this geometry. Not determined, and changed "
        "only as far as the accuracy of the POS tells it from what looks the same: "
        f"{', '.join(open_parts)}."
    )
    return StatementRow("Determined", "amber", sentence)


def _remainder(content):
    """How far targets were and are off, by check points where there are any."""
    role = "check" if content["lsc"]["check"]["n"] else "control"
    group = content["lsc"][role]
    if group["n"] == 0:
        return StatementRow("Result", "amber", "No target tells how good the calibration is.")
    before, after = (group[state]["rmse_3d"] for state in ("before", "after"))
    sentence = f"3D RMSE of {role} points {length_in_words(before)} → {length_in_words(after)}"
    if role == "control":
        return StatementRow("Result", "amber", f"{sentence}: the fit alone, which proves little.")
    sentence = f"{sentence}; they took no part"
    if after <= before:
        return StatementRow("Result", "green", f"{sentence}.")
    if _is_off(content["scanner_errors"]):
        return StatementRow(
            "Result", "amber", f"{sentence}, and keep what the scanner itself lacks."
        )
    if not _lacks(content):
        return StatementRow("Result", "amber", f"{sentence}. No part changed significantly.")
    return StatementRow("Result", "red", f"{sentence}.")


def _is_off(errors):
    """Whether the scanner itself is; it is not where nobody looked."""
    return any(row["significant"] for row in (errors or {}).values())


def _scanner(content) -> Iterator[StatementRow]:
    """What the scanner's own ranges and encoder lack."""
    errors = content["scanner_errors"]
    if errors is None:
        return
    ranges = errors["range_offset"]
    encoder = errors["encoder_scale"]
    open_ranges, open_encoder = (
        " (not determined)" if row["significant"] and not row["determined"] else ""
        for row in (ranges, encoder)
    )
    sentence = (
        f"Ranges lack {millimetres(ranges['correction'])} ± {millimetres(ranges['sigma'])} mm"
        f"{open_ranges}, scan angles {1e3 * encoder['correction']:.2f} ± "
        f"{1e3 * encoder['sigma']:.2f} mrad per rad{open_encoder}"
    )
    if _is_off(errors):
        yield StatementRow("Scanner", "amber", f"{sentence}; the mounting is free of it.")
    elif all(row["determined"] for row in errors.values()):
        yield StatementRow("Scanner", "green", f"{sentence}: nothing significant.")
    else:
        yield StatementRow("Scanner", "green", f"{sentence}; this geometry hardly tells it.")


def _ties(content) -> Iterator[StatementRow]:
    """How far apart the passes lie where both saw the same."""
    ties = content["ties"]
    if ties is not None and ties["used"]:
        before, after = (length_in_words(ties[state]["median"]) for state in ("before", "after"))
        is_between = any(len(set(row["scanners"])) > 1 for row in ties["pairs"])
        if is_between:
            views = "two passes, or two scanners of one,"
        else:
            views = "two passes"
        sentence = (
            f"{ties['used']} of {ties['n']} places that {views} both saw are used: {before} "
            f"apart before, {after} after (median)"
        )
        if "with_drift" in content:
            median = content["with_drift"]["ties"]["after"]["median"]
            sentence += f", {length_in_words(median)} without the drift"
        yield StatementRow("Two passes", "green", f"{sentence}.")


def calibration_page(content: dict[str, Any]) -> Page:
    """The page of calibration.json.

    Parameters
    ----------
    content : dict
        The whole document, of one scanner or of several.
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
    """Length of a vector of a document; NaN without one."""
    if values and None not in values:
        return float(np.linalg.norm(values))
    return np.nan
