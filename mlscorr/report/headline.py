"""The first line of a report: what was tested, by what, and which part rests on extrapolation."""

from __future__ import annotations

from mlscorr.evaluate.rows import PointCounts
from mlscorr.report.correction_report import CorrectionReport
from mlscorr.report.tables import length_in_words

NAMED = 6  # points that a sentence names; the others stand in the list below it


def headline(report: CorrectionReport) -> str:
    """Check points, control points and extrapolated parts in one line.

    Where no control takes part this comes first: the result may then lie elsewhere as a whole.

    Parameters
    ----------
    report : CorrectionReport
    """
    check, control = report.points("check"), report.points("control")
    if control.surveyed == 0:
        return " ".join([_uncontrolled(report), *_check(check)])
    return " ".join([*_check(check), _control(control), _extrapolated(report)])


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
        length = length_in_words(sigma)
        result += f" An error of up to {length} is to be expected (one sigma)."
    return result


def _check(points: PointCounts):
    """Sentences on the check points that were seen, and on those that were not."""
    if points.surveyed == 0:
        yield "No check point was surveyed, so nothing independent tests this result."
        return
    scored = f"{points.scored} of {points.surveyed} surveyed check points"
    yield f"{scored} {'was' if points.scored == 1 else 'were'} seen and scored."
    missing, n = points.missing, len(points.missing)
    if n:
        them = "1 check point was" if n == 1 else f"{n} check points were"
        yield (
            f"{them} not seen although the cloud covers {'its' if n == 1 else 'their'} "
            f"surroundings ({_names(missing)}): the error there is unknown, and counts against "
            "this result."
        )
    outside = points.surveyed - points.observed - n
    if outside:
        yield f"{outside} {'stands' if outside == 1 else 'stand'} where nothing was scanned."


def _control(points: PointCounts):
    """A sentence on the control points that were used, refused and not seen."""
    parts = [f"Control: {points.scored} of {points.surveyed} surveyed points used"]
    if points.refused:
        parts.append(f"{len(points.refused)} refused ({_names(points.refused)})")
    if points.missing:
        parts.append(f"{len(points.missing)} not seen ({_names(points.missing)})")
    outside = points.surveyed - points.observed - len(points.missing)
    if outside:
        parts.append(f"{outside} where nothing was scanned")
    return ", ".join(parts) + "."


def _extrapolated(report: CorrectionReport):
    """A sentence on the part of the drive that no control point holds."""
    weak = report.support.weak
    if not weak:
        return "Control points hold the whole drive."
    share = 100 * report.coverage.share_extrapolated
    percent = "less than 1" if 0 < share < 1 else f"{share:.0f}"
    return (
        f"No control holds {report.seconds_extrapolated:.1f} s "
        f"({report.metres_extrapolated:.0f} m) of the drive, {percent} % of the points: "
        "the correction is extrapolated there, and an error of up to "
        f"{length_in_words(max(stretch.sigma for stretch in weak))} is to be expected (one sigma)."
    )


def _names(points):
    """Names of points in a sentence."""
    names = [name for name, _ in points[:NAMED]]
    more = len(points) - len(names)
    return ", ".join(names) + (f" and {more} more" if more else "")
