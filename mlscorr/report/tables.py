"""What the report says of a correction in words and in tables."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri

from mlscorr.estimate import SETTINGS as ESTIMATE
from mlscorr.evaluate import Statistics
from mlscorr.report.correction_report import CorrectionReport
from mlscorr.report.settings import SETTINGS
from mlscorr.wording import counted, length_in_words, number

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
        ("Control points, left out in turn", True, control.left_out),
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
        ("Control points, after: left out in turn", control.before, control.left_out),
        ("Control points, after: fit", control.before, control.after),
    ]
    return [
        (title, after.n, list(zip(QUANTITIES, _columns(before), _columns(after), strict=True)))
        for title, before, after in blocks
        if after is not None and after.n
    ]


def _columns(statistics: Statistics):
    return statistics.table[:, [1, 2, 0, 3, 4]]  # the mean first


def count(report: CorrectionReport, role: str) -> str:
    """How many points in words: '8 points', or '12 observations of 8 points'.

    Parameters
    ----------
    report : CorrectionReport
    role : str
        ``control`` or ``check``.
    """
    points, n = report.count(role)
    words = counted(points, "point")
    if points == n:
        return words
    return f"{n} observations of {words}"


def verdict(report: CorrectionReport) -> tuple[list[str], bool]:
    """The result in sentences, and whether something speaks against it.

    Parameters
    ----------
    report : CorrectionReport

    Returns
    -------
    sentences : list of str
    worse : bool
        It became worse on an axis, by more than the sigmas of targets and correction allow, or
        check points are missing where they should have been seen.
    """
    before, after, kind = report.judgement
    if before is None or after is None:
        if report.targets:
            none = "No target was found"
        else:
            none = "There is no surveyed point"
        return [f"{none} that could tell how good the correction is."], True
    sigma = (report.check if kind == "check" else report.control).sigma
    # as large as this the RMS of n is by chance, as it is known no better there than by its sigma
    ratio = np.sqrt(chdtri(after.n, ESTIMATE.significance) / after.n)
    limit = np.inf if sigma is None else sigma * ratio
    rise = np.where(after.rmse[:3] > limit, (after.rmse - before.rmse)[:3], 0.0)
    axes = dict(zip(AXES, rise, strict=True))
    worse = [f"{a} by {number(by)} m" for a, by in axes.items() if by > SETTINGS.difference]
    sentences = [
        _plainly(before.rmse[4], after.rmse[4], kind, report.holds_everywhere, bool(worse)),
        _result(report, before.rmse[:3], after.rmse[:3], kind),
    ]
    if worse:
        points = count(report, "check" if kind == "check" else "control")
        axes = ", ".join(worse)
        sentences.append(f"After the correction it is worse than before: {axes} (RMS of {points}).")
    return sentences, bool(worse or report.points("check").missing)


def _plainly(before, after, kind, holds_everywhere, is_worse):
    """What the correction did, in plain words; lengths are 3D RMSE in m.

    It boasts of no factor where a part of the cloud may be as far off as it was.
    """
    by = {
        "check": "as independent check points tell",
        "leave-one-out": "as control points tell that were left out in turn",
        "fit": "but only at the points that it was made from: nothing independent can judge it",
    }[kind]
    pair = f"from {length_in_words(before)} to {length_in_words(after)} off the surveyed places"
    if kind != "fit" and abs(before - after) <= SETTINGS.difference:
        return f"The correction changed next to nothing, {by}: {pair}."
    if after > before and not is_worse:
        return f"The correction changed less than these targets tell, {by}: {pair}."
    if after > before:
        return f"The correction made the cloud worse, {by}: {pair}. Don't use it."
    closer = before / max(after, 1e-4)
    if not holds_everywhere:
        if kind == "check":
            where = "at the points that were seen"
        else:
            where = "where control holds it"
        return f"The correction brought the cloud {pair} {where}, {by}."
    if closer >= 1.5 and kind != "fit":
        times = f" ({closer:.0f} times closer)"
    else:
        times = ""
    return f"The correction brought the cloud {pair}{times}, {by}."


def _result(report, before, after, kind):
    """RMSE before and after in one sentence that says what it rests on."""
    low = min(*before, *after)
    if low >= 0.03:
        decimals = 2
    else:
        decimals = 3 if low >= 0.003 else 4
    pair = ["/".join(number(value, decimals) for value in values) for values in (before, after)]
    figures = f"RMSE {pair[0]} m before, {pair[1]} m after (E/N/H)"
    if kind == "check":
        points = count(report, "check")
        return f"Check points: {figures}, {points} that took no part in the estimate."
    points = count(report, "control")
    if kind == "leave-one-out":
        is_surveyed = report.points("check").surveyed > 0
        if is_surveyed:
            none = "No check point was seen."
        else:
            none = "There are no check points."
        return (
            f"{none} Control points, each left out in turn and predicted from "
            f"the others: {figures}, {points}."
        )
    return (
        f"There is no independent check: every target used ({points}) made the correction. The "
        f"fit, {figures}, does not tell how good the correction is elsewhere."
    )
