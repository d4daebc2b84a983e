"""The tables of a correction's page, and what is said of its ties."""

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
    """A row of the table of RMSE.

    Parameters
    ----------
    label : str
    strong : bool
        Whether a verdict may rest on it.
    n : int
    rmse : (5,) array
        E, N, H, horizontal and 3D. Units: m.
    """

    label: str
    strong: bool
    n: int
    rmse: np.ndarray


def norm(vector: Sequence[float] | np.ndarray, axes: int = 3) -> float:
    """Length of the first axes of a vector, NaN when one is missing.

    Parameters
    ----------
    vector : (3,) array
    axes : int
        2 is horizontal, 3 is 3D.
    """
    return float(np.linalg.norm(vector[:axes]))


def rmse_rows(report: CorrectionReport) -> list[RmseRow]:
    """Rows of the table of RMSE, the independent ones first.

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
    """Blocks (title, n, rows) of all statistics, a row (name, before, after) for each quantity.

    Parameters
    ----------
    report : CorrectionReport

    Returns
    -------
    list of tuple
        before and after are mean, std, RMSE, least and largest (5,), NaN where not determined.
        Units: m.
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
    """What ties between passes did: how far apart these are, and what control that spares.

    Parameters
    ----------
    section : dict or None
        ``ties`` of report.json.
    control : int
        Number of control points that took part.

    Returns
    -------
    list of Statement
        Why there are none in one of them; none where nobody looked for any.
    """
    if section is None:
        return []
    if section["n"] == 0:
        return [Statement("no ties", values={"reason": section["reason"]})]
    if section["used"] == 0:
        values = {"n": section["n"], "has_control": control > 0}
        return [Statement("unused ties", "warning", values)]
    apart = {state: section[state]["median"] for state in ("before", "after")}
    facts = [Statement("ties", values={"n": section["n"], **apart})]
    wrong = section["n"] - section["used"]
    if wrong:
        facts.append(Statement("contradicting ties", values={"wrong": wrong}))
    if control == 0:
        return [*facts, Statement("relative ties", "warning")]
    if "share" not in section:  # an area's, of which the drive is a piece
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
    """What ties between passes did, in sentences for a reader who never heard of them.

    Parameters
    ----------
    section : dict or None
        ``ties`` of report.json.
    control : int
        Number of control points that took part.
    """
    return in_words(tie_statements(section, control))
