"""First screen of a correction for terminal, report.json and page.

Each row of that screen is made from statements, whose severity is its rating. Rows shared with a
calibration, a comparison and a diagnosis are also made here.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri

from mlscorr.estimate import SETTINGS as ESTIMATE
from mlscorr.evaluate import SEEN_BY_OTHERS, CheckSigmas, PointCounts, reason_in_words
from mlscorr.report.correction_report import CorrectionReport
from mlscorr.report.settings import SETTINGS
from mlscorr.report.tables import AXES
from mlscorr.report.wording import NAMED, assumed_in_words, in_words, interval_in_words
from mlscorr.survey import Severity, Statement

RATINGS = ("green", "amber", "red")  # good; warning; incomplete, or worse than before
SEVERITIES: tuple[Severity, ...] = ("note", "warning", "fault")  # of statements, in this order
SIGMAS = ("pos.position_sigma", "pos.attitude_sigma")


@dataclass(frozen=True)
class StatementRow:
    """Fact on the first screen.

    Parameters
    ----------
    what : str
        Subject.
    rating : str
        One of RATINGS.
    sentence : str
    items : tuple of (str, str)
        Names of single items, each with a remark.
    statements : tuple of Statement
        Statements behind rating and sentence, if any.
    """

    what: str
    rating: str
    sentence: str
    items: tuple[tuple[str, str], ...] = ()
    statements: tuple[Statement, ...] = ()

    @classmethod
    def of(
        cls, what: str, *statements: Statement, items: Iterable[tuple[str, str]] = ()
    ) -> StatementRow:
        """Make the row of some statements, rated as the worst of them.

        Parameters
        ----------
        what : str
            Subject.
        *statements : Statement
            With sentences in mlscorr.report.wording.
        items : iterable of (str, str)
        """
        worst = max(SEVERITIES.index(statement.severity) for statement in statements)
        sentence = " ".join(in_words(statements))
        return cls(what, RATINGS[worst], sentence, tuple(items), statements)

    def document(self) -> dict[str, object]:
        """Return the row of ``statements[]`` in report.json."""
        items = [{"name": name, "text": text} for name, text in self.items]
        return {
            "what": self.what,
            "rating": self.rating,
            "sentence": self.sentence,
            "items": items,
        }


def first_screen(report: CorrectionReport) -> dict[str, object]:
    """First part of report.json: ``headline``, ``rating`` and ``statements``.

    Parameters
    ----------
    report : CorrectionReport
    """
    return {"headline": headline(report), **statements_section(statements(report))}


def statements_section(facts: list[StatementRow]) -> dict[str, object]:
    """``statements`` of a document, and ``rating``, the worst of them.

    Parameters
    ----------
    facts : list of StatementRow
    """
    rating = max((statement.rating for statement in facts), key=RATINGS.index)
    return {"rating": rating, "statements": [statement.document() for statement in facts]}


def statements(report: CorrectionReport) -> list[StatementRow]:
    """Rows of the first screen, in order.

    Parameters
    ----------
    report : CorrectionReport
    """
    assumed = [vars(row) for row in report.assumed]
    return [
        _result(report),
        _points_moved(report),
        check_statement(report.points("check")),
        _control(report),
        *_datum(report),
        _extrapolated(report),
        *_left_out(report),
        *_sigma(report),
        *assumed_statement(assumed, " until control points give an estimate", "green"),
        *warning_statements(report.model.get("warnings") or ()),
    ]


def sigmas_statement(sigmas: CheckSigmas) -> Statement:
    """Statement on the test of the stated sigmas by check points.

    Parameters
    ----------
    sigmas : CheckSigmas
    """
    names = ("points", "statistic", "degrees_of_freedom", "limits", "significance", "factor")
    document = sigmas.document()
    severity: Severity = "warning" if sigmas.verdict == "too small" else "note"
    values = {name: document[name] for name in names}
    return Statement(f"check sigmas {sigmas.verdict}", severity, values)


def headline(report: CorrectionReport) -> str:
    """Check points, control points and extrapolated parts in one line.

    Without control this is mentioned first, because the result may then be shifted as a whole.

    Parameters
    ----------
    report : CorrectionReport
    """
    check = check_statement(report.points("check")).sentence
    control = _control(report).sentence
    if report.points("control").surveyed == 0 and not report.is_constrained_by_others:
        return f"{control} {check}"
    return f"{check} Control: {control} {_extrapolated(report).sentence}"


def _result(report):
    """First sentence on the accuracy of the cloud before and after, with the others as items."""
    first, *more = verdict(report)
    return StatementRow.of("Result", first, items=[("", text) for text in in_words(more)])


def verdict(report: CorrectionReport) -> list[Statement]:
    """Statements on the result; the severity of the first one shows objections.

    It is a fault if an axis became worse by more than the sigmas of targets and correction allow,
    or if expected check points are missing. It is a note if check points show an improvement, and
    there are no other objections.

    Parameters
    ----------
    report : CorrectionReport
    """
    before, after, kind = report.judgement
    if before is None or after is None:
        if report.targets:
            return [Statement("no target to judge by", "fault")]
        return [Statement("nothing to judge by", "fault")]
    role = "control"
    if kind == "check":
        role = "check"
    rises = _rises(before.rmse, after.rmse, after.n, getattr(report, role).sigma)
    is_tested = kind == "check" and after.rmse[4] <= before.rmse[4] + SETTINGS.difference
    severity: Severity = "warning"
    if rises or report.points("check").missing:
        severity = "fault"
    elif is_tested and not report.datum:  # which check points of the same survey share
        severity = "note"
    points, observations = report.count(role)
    count = {"points": points, "observations": observations}
    values = {"before": before.rmse[:3], "after": after.rmse[:3], **count}
    rmse = {"check": "rmse of check points", "leave-one-out": "rmse left out"}
    if kind == "leave-one-out":
        values["has_checks"] = report.points("check").surveyed > 0
    facts = [
        _change(report, before.rmse[4], after.rmse[4], kind, bool(rises), severity),
        Statement(rmse.get(kind, "rmse of the fit"), values=values),
    ]
    if rises:
        facts.append(Statement("worse axes", "fault", {"rises": rises, **count}))
    return facts


def _rises(before, after, n, sigma):
    """Increase of the RMSE of each axis, if it exceeds chance. Units: m."""
    limit = np.inf
    if sigma is not None:
        # the RMS of n may be as large as this by chance, because its uncertainty is its sigma
        limit = sigma * np.sqrt(chdtri(n, ESTIMATE.significance) / n)
    rise = np.where(after[:3] > limit, (after - before)[:3], 0.0)
    return {axis: by for axis, by in zip(AXES, rise, strict=True) if by > SETTINGS.difference}


def _change(report, before, after, kind, is_worse, severity):
    """Statement on the effect of the correction, by 3D RMSE in m."""
    values = {"before": before, "after": after, "kind": kind}
    if kind != "fit" and abs(before - after) <= SETTINGS.difference:
        return Statement("hardly changed", severity, values)
    if after > before and not is_worse:
        return Statement("changed within sigma", severity, values)
    if after > before:
        return Statement("made worse", severity, values)
    times = before / max(after, 1e-4)
    if times < 1.5 or kind == "fit":
        times = None
    values |= {"times": times, "holds_everywhere": report.holds_everywhere}
    return Statement("improved", severity, values)


def _points_moved(report):
    """Statement on the share of corrected points, and the basis."""
    coverage = report.coverage
    values = {
        "held": coverage.points_corrected - coverage.points_extrapolated,
        "extrapolated": coverage.points_extrapolated,
        "left": coverage.points_outside_trajectory,
    }
    severity = "note"
    if values["left"] or not values["held"]:
        severity = "fault"
    return StatementRow.of("Points", Statement("points", severity, values))


def check_statement(points: PointCounts) -> StatementRow:
    """Make the row of scored and of other check points.

    Parameters
    ----------
    points : PointCounts
        Counts of the check points.
    """
    if points.surveyed == 0:
        return StatementRow.of("Check points", Statement("no check point", "warning"))
    severity: Severity = "warning"
    if points.scored:
        severity = "note"
    values = {"scored": points.scored, "surveyed": points.surveyed}
    facts = [Statement("check points", severity, values)]
    lost = {"hidden check points": points.hidden, "refused check points": points.misplaced}
    facts += [
        Statement(key, "fault", {"names": _names(some)}) for key, some in lost.items() if some
    ]
    for by_others, count in _elsewhere(points).items():
        values = {"count": count, "by_others": by_others}
        facts.append(Statement("check points elsewhere", values=values))
    return StatementRow.of("Check points", *facts, items=_named(points))


def _elsewhere(points):
    """Number of points without points of the cloud, by observation by another scanner."""
    return Counter(why == SEEN_BY_OTHERS for _, why in points.outside)


def _control(report):
    """Row of the control points, or of the reference of a result without any."""
    points = report.points("control")
    if points.surveyed:
        return control_statement(points)
    if report.is_constrained_by_others:
        return StatementRow.of("Control points", Statement("control of other drives", "warning"))
    values = {
        "is_tied": report.ties is not None and report.ties["used"] > 0,
        "sigma": max((interval.sigma for interval in report.support.weak), default=0.0),
    }
    return StatementRow.of("Control points", Statement("no control point", "fault", values))


def control_statement(points: PointCounts) -> StatementRow:
    """Make the row of used, refused and missing control points.

    Parameters
    ----------
    points : PointCounts
        Counts of the control points.
    """
    values = {
        "scored": points.scored,
        "surveyed": points.surveyed,
        "refused": _names(points.refused + points.misplaced),
        "hidden": _names(points.hidden),
        "elsewhere": _elsewhere(points),
    }
    severity: Severity = "note"
    if points.refused or points.missing:
        severity = "warning"
    fact = Statement("control points", severity, values)
    return StatementRow.of("Control points", fact, items=_named(points))


def _datum(report) -> Iterator[StatementRow]:
    """Yield rows on overall differences of control and cloud."""
    if report.datum:
        lengths = {each.term: each.length for each in report.datum}
        items = ((each.term, each.sentence) for each in report.datum)
        fact = Statement("datum", "warning", {"lengths": lengths})
        yield StatementRow.of("Datum", fact, items=items)


def _extrapolated(report):
    """Row of the unconstrained parts: green if they are as good as the rest."""
    weak = report.support.weak
    if not weak and report.is_constrained_by_others:
        return StatementRow.of("Extrapolated", Statement("held by other drives", "warning"))
    if not weak:
        return StatementRow.of("Extrapolated", Statement("held"))
    share = report.coverage.share_extrapolated
    largest = max(interval.sigma for interval in weak)
    after = report.judgement[1]
    severity = "warning"
    if after is not None and largest <= after.maximum[4] and share < 1:
        severity = "note"
    values = {
        "seconds": report.seconds_extrapolated,
        "metres": report.metres_extrapolated,
        "share": share,
        "sigma": largest,
    }
    facts = [Statement("extrapolated", severity, values)]
    sigma = report.position_sigma
    if sigma is not None and not report.support.contains(np.array(sigma["time"])):
        facts.append(Statement("between control points", values={"sigma": sigma["largest"]}))
    items = [
        interval_in_words(
            interval.start,
            interval.end,
            interval.chainage,
            interval.length_m,
            interval.why,
            interval.sigma,
        )
        for interval in sorted(weak, key=lambda interval: -interval.sigma)
    ]
    return StatementRow.of("Extrapolated", *facts, items=capped(items))


def _left_out(report) -> Iterator[StatementRow]:
    """Yield the row of leave-one-out residuals at control points."""
    left_out = report.control.left_out
    if left_out is None:
        return
    if left_out.n and report.judgement[2] == "check":
        values = {"rmse": left_out.rmse[:3], "rmse_3d": left_out.rmse[4]}
        yield StatementRow.of("Leave-one-out", Statement("left out", values=values))
    elif not left_out.n and report.points("control").scored == 1:
        yield StatementRow.of("Leave-one-out", Statement("single control point", "warning"))


def _sigma(report) -> Iterator[StatementRow]:
    """Yield the row of the estimated accuracy."""
    sigma = report.position_sigma
    if sigma is None:
        return
    values = {name: sigma[name] for name in ("largest", "time", "median")}
    facts = [Statement("sigma", values=values)]
    stated = sigma.get("stated", np.inf)
    if sigma["median"] > stated:
        facts.append(Statement("stated sigma", "warning", {"sigma": stated}))
    yield StatementRow.of("Sigma", *facts)


def has_assumed_sigma(rows: Iterable[dict]) -> bool:
    """True if a sigma of the POS is a default.

    Parameters
    ----------
    rows : iterable of dict
        ``assumed`` of a document.
    """
    return any(row["key"] in SIGMAS for row in rows)


def assumed_statement(
    rows: list[dict], purpose: str, rating: str, uses: Mapping[str, str] | None = None
) -> Iterator[StatementRow]:
    """Yield the row of accuracies that nobody stated, with their defaults; nothing without any.

    Parameters
    ----------
    rows : list of dict
        ``assumed`` of a document: key, value, unit and, if available, the estimate.
    purpose : str
        Their use: the end of the sentence.
    rating : str
        One of RATINGS, used if a sigma is among them; otherwise green.
    uses : mapping of str to str, optional
        Use of a default without an estimate, by key.
    """
    if not rows:
        return
    severity: Severity = "note"
    if has_assumed_sigma(rows):
        severity = SEVERITIES[RATINGS.index(rating)]
    values = {
        "count": len(rows),
        "purpose": purpose,
        "sections": list(dict.fromkeys(f"[{row['key'].partition('.')[0]}]" for row in rows)),
        "has_sigma": has_assumed_sigma(rows),
    }
    items = (assumed_in_words(row, (uses or {}).get(row["key"])) for row in rows)
    yield StatementRow.of("Assumed", Statement("assumed", severity, values), items=items)


def warning_statements(warnings: Iterable[str]) -> Iterator[StatementRow]:
    """Yield the row of warnings, if any.

    Parameters
    ----------
    warnings : iterable of str
    """
    doubts = dict.fromkeys(warnings)
    if doubts:
        fact = Statement("warnings", "warning", {"count": len(doubts)})
        yield StatementRow.of("Warnings", fact, items=[("", text) for text in doubts])


def _named(points):
    """Items of the surveyed points that were not used."""
    rows = (*points.refused, *points.missing, *points.outside)
    return capped((name, reason_in_words(why)) for name, why in rows)


def _names(points):
    return [name for name, _ in points]


def capped(items: Iterable[tuple[str, str]]) -> tuple[tuple[str, str], ...]:
    """First of some items, and the number of further ones.

    Parameters
    ----------
    items : iterable of (str, str)
        Items of a StatementRow.
    """
    items = tuple(items)
    more = len(items) - NAMED
    if more <= 0:
        return items
    return (*items[:NAMED], ("", f"and {more} more"))
