"""Tables of a correction's page, and statements on its ties."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mlscorr.evaluate import Statistics
from mlscorr.report.correction_report import CorrectionReport
from mlscorr.report.wording import in_words
from mlscorr.survey import Statement

AXES = ("E", "N", "H")
QUANTITIES = ("Easting", "Northing", "Height (vertical)", "Horizontal distance", "3D distance")


@dataclass(frozen=True)
class RmseRow:
    """Row of the table of RMSE.

    Parameters
    ----------
    label : str
    strong : bool
        True if a verdict may use it.
    n : int
    rmse : (5,) array
        E, N, H, horizontal and 3D. Units: m.
    """

    label: str
    strong: bool
    n: int
    rmse: np.ndarray


def norm(vector: Sequence[float] | np.ndarray, axes: int = 3) -> float:
    """Length of the first axes of a vector, NaN if one is missing.

    Parameters
    ----------
    vector : (3,) array
    axes : int
        2 is horizontal, 3 is 3D.
    """
    return float(np.linalg.norm(vector[:axes]))


def rmse_rows(report: CorrectionReport) -> list[RmseRow]:
    """Make rows of the table of RMSE, independent ones first.

    Parameters
    ----------
    report : CorrectionReport
    """
    check = report.check
    control = report.control
    rows = [
        ("Check points, before", False, check.before),
        ("Check points, after", True, check.after),
        ("Control points, before", False, control.before),
        ("Control points, leave-one-out", True, control.left_out),
        ("Control points, after (fit)", False, control.after),
    ]
    required = control.before, control.after
    return [
        RmseRow(words, strong, statistics.n, statistics.rmse)
        for words, strong, statistics in rows
        if statistics is not None and (statistics.n or any(statistics is part for part in required))
    ]


def statistics_rows(
    report: CorrectionReport,
) -> list[tuple[str, int, list[tuple[str, np.ndarray, np.ndarray]]]]:
    """Blocks (title, n, rows) of all statistics, with a row (name, before, after) per quantity.

    Parameters
    ----------
    report : CorrectionReport

    Returns
    -------
    list of tuple
        before and after are mean, std, RMSE, least and largest (5,), NaN if undetermined. Units: m.
    """
    check = report.check
    control = report.control
    blocks = [
        ("Check points", check.before, check.after),
        ("Control points, after: leave-one-out", control.before, control.left_out),
        ("Control points, after: fit", control.before, control.after),
    ]
    return [
        (title, after.n, list(zip(QUANTITIES, _columns(before), _columns(after), strict=True)))
        for title, before, after in blocks
        if after is not None and after.n
    ]


def _columns(statistics: Statistics):
    return statistics.table[:, [1, 2, 0, 3, 4]]  # the mean first


def tie_statements(section: dict[str, Any] | None, control: int) -> list[Statement]:
    """Statements on the effect of ties between passes: misclosures, and equivalent control.

    Parameters
    ----------
    section : dict or None
        ``ties`` of report.json.
    control : int
        Number of used control points.

    Returns
    -------
    list of Statement
        With the reason if there are no ties; empty without a search.
    """
    if section is None:
        return []
    if section["n"] == 0:
        return [Statement("no ties", values={"reason": section["reason"]})]
    if section["used"] == 0:
        values = {"n": section["n"], "has_control": control > 0}
        return [Statement("unused ties", "warning", values)]
    medians = {state: section[state]["median"] for state in ("before", "after")}
    facts = [Statement("ties", values={"n": section["n"], **medians})]
    wrong = section["n"] - section["used"]
    if wrong:
        facts.append(Statement("contradicting ties", values={"wrong": wrong}))
    if control == 0:
        return [*facts, Statement("relative ties", "warning")]
    if "share" not in section:  # an area's, which includes the drive
        return facts
    facts.append(Statement("share of control", values={"control": section["share"]["control"]}))
    sufficient = section["sufficient_control"]
    if sufficient is None or control < 2:
        return facts
    if sufficient < control:
        values = {"control": control, "sufficient": sufficient}
        return [*facts, Statement("sufficient control", values=values)]
    return [*facts, Statement("all control needed", values={"control": control})]


def tie_sentences(section: dict[str, Any] | None, control: int) -> list[str]:
    """Sentences on the effect of ties between passes, for readers new to them.

    Parameters
    ----------
    section : dict or None
        ``ties`` of report.json.
    control : int
        Number of used control points.
    """
    return in_words(tie_statements(section, control))
