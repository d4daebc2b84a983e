"""What a correction says first, wherever it is read: terminal, report.json and page."""

from collections import Counter
from collections.abc import Iterable, Iterator

import numpy as np

from mlscorr.evaluate import SEEN_BY_OTHERS, PointCounts
from mlscorr.report._statement import RATINGS, StatementRow
from mlscorr.report.assumed import assumed_statement
from mlscorr.report.correction_report import CorrectionReport
from mlscorr.report.settings import SETTINGS
from mlscorr.report.tables import verdict
from mlscorr.wording import counted, length_in_words, percent

NAMED = 6  # points or stretches that stand on the first screen; the tables have all of them


def first_screen(report: CorrectionReport) -> dict[str, object]:
    """What report.json begins with: ``headline``, ``rating`` and ``statements``.

    Parameters
    ----------
    report : CorrectionReport
    """
    return {"headline": headline(report), **statements_section(statements(report))}


def statements_section(facts: list[StatementRow]) -> dict[str, object]:
    """``statements`` of a document, and ``rating``: the worst of them.

    Parameters
    ----------
    facts : list of StatementRow
    """
    rating = max((statement.rating for statement in facts), key=RATINGS.index)
    return {"rating": rating, "statements": [statement.document() for statement in facts]}


def statements(report: CorrectionReport) -> list[StatementRow]:
    """All that stands on the first screen, in its order.

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
        *assumed_statement(assumed, " until control points show better", "green"),
        *warning_statements(report.model.get("warnings") or ()),
    ]


def headline(report: CorrectionReport) -> str:
    """Check points, control points and extrapolated parts in one line.

    Where no control takes part this comes first: the result may then lie elsewhere as a whole.

    Parameters
    ----------
    report : CorrectionReport
    """
    check = check_statement(report.points("check")).sentence
    control = _control(report).sentence
    if report.points("control").surveyed == 0 and not report.is_held_by_others:
        return f"{control} {check}"
    return f"{check} Control: {control} {_extrapolated(report).sentence}"


def _result(report):
    """How far off the cloud was and is."""
    sentences, is_worse = verdict(report)
    before, after, kind = report.judgement
    is_tested = kind == "check" and after.rmse[4] <= before.rmse[4] + SETTINGS.difference
    is_tested &= not report.datum  # which check points of the same survey share
    if is_worse:
        rating = "red"
    else:
        rating = "green" if is_tested else "amber"
    return StatementRow("Result", rating, sentences[0], tuple(("", text) for text in sentences[1:]))


def _points_moved(report):
    """Which share of the points was corrected, and on which grounds."""
    coverage = report.coverage
    left = coverage.points_outside_trajectory
    total = max(coverage.points_corrected + left, 1)
    held = coverage.points_corrected - coverage.points_extrapolated
    sentence = (
        f"{percent(held / total)} of the points corrected where control holds them, "
        f"{percent(coverage.points_extrapolated / total)} by extrapolation, "
        f"{percent(left / total)} left as they were."
    )
    if left:
        sentence += f" {left} of {total} points lie outside the trajectory or in its gaps."
    return StatementRow("Points", "red" if left or not held else "green", sentence)


def check_statement(points: PointCounts) -> StatementRow:
    """The check points that were scored, and those that were not.

    Parameters
    ----------
    points : PointCounts
        Of the check points.
    """
    if points.surveyed == 0:
        sentence = "No check point was surveyed, so nothing independent tests this result."
        return StatementRow("Check points", "amber", sentence)
    if points.missing:
        rating = "red"
    else:
        rating = "green" if points.scored else "amber"
    return StatementRow("Check points", rating, " ".join(_scored(points)), _named(points))


def _scored(points):
    """Sentences on the check points that were seen, and on those that were not."""
    scored = f"{points.scored} of {points.surveyed} surveyed check points"
    yield f"{scored} {'was' if points.scored == 1 else 'were'} seen and scored."
    hidden = "not seen although the cloud covers the surroundings"
    unfit = "found, but refused, as place, kind or size does not fit"
    for words, some in ((hidden, points.hidden), (unfit, points.misplaced)):
        if n := len(some):
            them = f"{n} check point{' was' if n == 1 else 's were'} {words} ({_names(some)})"
            yield f"{them}: the error there is unknown, and counts against this result."
    for where, number in _away(points):
        yield f"{number} {'stands' if number == 1 else 'stand'} where {where}."


def _away(points):
    """What was scanned where points without points of the cloud stand, and their number."""
    there = {SEEN_BY_OTHERS: "only another scanner saw the target"}
    return Counter(there.get(why, "nothing was scanned") for _, why in points.outside).items()


def _control(report):
    """The control points, or what a result without any is relative to."""
    points = report.points("control")
    if points.surveyed:
        return control_statement(points)
    if report.is_held_by_others:
        sentence = "No point of its own takes part: those of other drives hold it, through ties."
        return StatementRow("Control points", "amber", sentence)
    return StatementRow("Control points", "red", _uncontrolled(report))


def control_statement(points: PointCounts) -> StatementRow:
    """The control points that were used, refused and not seen.

    Parameters
    ----------
    points : PointCounts
        Of the control points.
    """
    parts = [f"{points.scored} of {points.surveyed} surveyed points used"]
    lost = {"refused": points.refused + points.misplaced, "not seen": points.hidden}
    parts += [f"{len(some)} {words} ({_names(some)})" for words, some in lost.items() if some]
    parts += [f"{number} where {where}" for where, number in _away(points)]
    if points.refused or points.missing:
        rating = "amber"
    else:
        rating = "green"
    return StatementRow("Control points", rating, ", ".join(parts) + ".", _named(points))


def _datum(report) -> Iterator[StatementRow]:
    """What the control as a whole differs by from the cloud."""
    if report.datum:
        terms = ", ".join(f"{each.term} {length_in_words(each.length)}" for each in report.datum)
        sentence = (
            f"Control and cloud differ by one linear term each ({terms}), which check points of "
            "the same survey cannot show."
        )
        items = tuple((each.term, each.sentence) for each in report.datum)
        yield StatementRow("Datum", "amber", sentence, items)


def _uncontrolled(report):
    """A sentence on a result without control points: what it is relative to."""
    result = "No control point takes part: nothing but the POS says where the cloud lies."
    if report.ties is not None and report.ties["used"]:
        result += (
            " Passes are fitted to one another by what two of them both saw: accuracy is relative "
            "only, and an error that all of them share stays in the cloud."
        )
    sigma = max((stretch.sigma for stretch in report.support.weak), default=0.0)
    if sigma > 0:
        result += f" An error of up to {length_in_words(sigma)} is to be expected (one sigma)."
    return result


def _extrapolated(report):
    """The parts that no control point holds: green where they are as good as what is judged."""
    weak = report.support.weak
    if not weak and report.is_held_by_others:
        sentence = "Control points of other drives hold the whole drive, through ties."
        return StatementRow("Extrapolated", "amber", sentence)
    if not weak:
        return StatementRow("Extrapolated", "green", "Control points hold the whole drive.")
    largest = max(stretch.sigma for stretch in weak)
    after = report.judgement[1]
    sentence = (
        f"No control holds {report.seconds_extrapolated:.1f} s "
        f"({report.metres_extrapolated:.0f} m) of the drive, "
        f"{percent(report.coverage.share_extrapolated)} of the points: "
        "the correction is extrapolated there, and an error of up to "
        f"{length_in_words(largest)} is to be expected (one sigma)."
    )
    sigma = report.position_sigma
    if sigma is not None and not report.support.contains(np.array(sigma["time"])):
        sentence += f" Between control points it is up to {length_in_words(sigma['largest'])}."
    is_small = after is not None and largest <= after.maximum[4]
    if is_small and report.coverage.share_extrapolated < 1:
        rating = "green"
    else:
        rating = "amber"
    return StatementRow("Extrapolated", rating, sentence, capped(_stretches(weak)))


def _stretches(weak):
    """Items of the weak stretches, the worst first."""
    for stretch in sorted(weak, key=lambda stretch: -stretch.sigma):
        yield (
            f"{stretch.start:.1f} to {stretch.end:.1f} s, "
            f"{stretch.chainage:.0f} to {stretch.chainage + stretch.length_m:.0f} m of the way",
            f"{stretch.why}; sigma up to {length_in_words(stretch.sigma)}",
        )


def _left_out(report) -> Iterator[StatementRow]:
    """What remains at control points that the others alone correct."""
    left_out = report.control.left_out
    if left_out is not None and left_out.n and report.judgement[2] == "check":
        axes = ", ".join(length_in_words(value) for value in left_out.rmse[:3])
        sentence = (
            f"RMSE {length_in_words(left_out.rmse[4])} in 3D ({axes} in E, N, H) at control points "
            "that the others alone correct."
        )
        yield StatementRow("Left out in turn", "green", sentence)
    elif left_out is not None and not left_out.n and report.points("control").scored == 1:
        sentence = "A single control point has no others: the POS's own sigmas alone check it."
        yield StatementRow("Left out in turn", "amber", sentence)


def _sigma(report) -> Iterator[StatementRow]:
    """What the estimate itself believes of its result."""
    sigma = report.position_sigma
    if sigma is not None:
        sentence = (
            f"Up to {length_in_words(sigma['largest'])} (at {sigma['time']:.1f} s), "
            f"{length_in_words(sigma['median'])} at half of the epochs: one sigma in 3D of the "
            "corrected position."
        )
        stated = sigma.get("stated", np.inf)
        is_larger = sigma["median"] > stated
        if is_larger:
            sentence += f" The POS states {length_in_words(stated)} of the recorded one."
        yield StatementRow("Sigma", "amber" if is_larger else "green", sentence)


def warning_statements(warnings: Iterable[str]) -> Iterator[StatementRow]:
    """What was doubtful on the way, if anything was.

    Parameters
    ----------
    warnings : iterable of str
    """
    doubts = dict.fromkeys(warnings)
    if doubts:
        count = counted(len(doubts), "warning")
        yield StatementRow("Warnings", "amber", f"{count}:", tuple(("", text) for text in doubts))


def _named(points):
    """Items of the points that took no part although they were surveyed."""
    return capped([*points.refused, *points.missing, *points.outside])


def capped(items: Iterable[tuple[str, str]]) -> tuple[tuple[str, str], ...]:
    """The first of some items, and how many more there are.

    Parameters
    ----------
    items : iterable of (str, str)
        As of a StatementRow.
    """
    items = tuple(items)
    more = len(items) - NAMED
    if more <= 0:
        return items
    return (*items[:NAMED], ("", f"and {more} more"))


def _names(points):
    """Names of points in a sentence."""
    names = [name for name, _ in points[:NAMED]]
    more = len(points) - len(names)
    return ", ".join(names) + (f" and {more} more" if more else "")
