"""First screen of a correction's page: three numbers, names, date, and worst target."""

from datetime import timedelta

import numpy as np

from mlscorr.correction import Correction
from mlscorr.evaluate import TargetRow
from mlscorr.io.trajectories import DAY, gps_epoch
from mlscorr.report import tables
from mlscorr.report.correction_report import CorrectionReport
from mlscorr.report.wording import FIRST_SCREEN
from mlscorr.survey import Statement, Survey
from mlscorr.wording import number, percent

DAYS = ("Sunday", "Monday", "Tuesday", "Wednesday", "Thursday", "Friday", "Saturday")  # of a week


def recorded_time(survey: Survey) -> dict[str, str | None]:
    """Recording time of a drive, as in report.json: ``start``, ``end`` and ``text``.

    Parameters
    ----------
    survey : Survey

    Returns
    -------
    dict
        Start and end in GPS time (ISO 8601), None if no file states the date.
    """
    first, last = survey.trajectory.gps_time[[0, -1]].tolist()
    epoch = gps_epoch(survey.trajectory, survey.clouds)
    if epoch is None:
        day, start = divmod(first, DAY)
        named = {"day": DAYS[int(day) % 7], "start": _clock(start), "end": _clock(last % DAY)}
        return {"start": None, "end": None, "text": _words("recorded on a weekday", **named)}
    start, end = (epoch + timedelta(seconds=round(time)) for time in (first, last))
    text = _words("recorded on a date", start=start, end=end)
    return {"start": start.isoformat(), "end": end.isoformat(), "text": text}


def _words(key, **values):
    """Words of the first screen."""
    return Statement(key, values=values).sentence(FIRST_SCREEN)


def _clock(seconds):
    """Time of day, 00:00:00 to 23:59:59."""
    minutes, second = divmod(int(seconds), 60)
    hour, minute = divmod(minutes, 60)
    return f"{hour:02d}:{minute:02d}:{second:02d}"


def worst_target(rows: list[TargetRow]) -> TargetRow | None:
    """Observed check point with the largest residual, or such a control point if there are none.

    Control points are judged by their leave-one-out residuals, if known.

    Parameters
    ----------
    rows : list of TargetRow
    """
    for group in ("check", "control"):
        observed = [row for row in rows if row.group == group and row.is_observed]
        if observed:
            return max(observed, key=lambda row: tables.norm(independent_residual(row)))
    return None


def independent_residual(row: TargetRow) -> np.ndarray:
    """Leave-one-out residual of a target, if known. Units: m.

    Parameters
    ----------
    row : TargetRow
    """
    if np.isfinite(row.left_out).all():
        return row.left_out
    return row.after


def three_numbers(correction: Correction, report: CorrectionReport) -> list[tuple[str, str]]:
    """Pairs (number, meaning): accuracy, used control, well determined share.

    Parameters
    ----------
    correction : Correction
    report : CorrectionReport
    """
    before, after, kind = report.judgement
    accuracy = ("–", _words("nothing judges"))
    if before is not None and after is not None:
        change = f"{number(before.rmse[4])} → {number(after.rmse[4])} m"
        accuracy = (change, _words(f"rmse at {kind}"))
    points, _ = report.count("control")
    surveyed = report.points("control").surveyed
    control = (f"{points} of {surveyed}", _words("control used"))
    share = (percent(well_determined(correction, report)), _words("well determined"))
    return [accuracy, control, share]


def well_determined(correction: Correction, report: CorrectionReport) -> float:
    """Share of the driven distance outside poorly constrained intervals, 0 to 1.

    Parameters
    ----------
    correction : Correction
    report : CorrectionReport
    """
    corrected = correction.corrected
    steps = np.linalg.norm(np.diff(corrected.position, axis=0), axis=1)
    steps[np.searchsorted(corrected.gps_time, corrected.gaps[:, 1]) - 1] = 0.0
    driven = float(steps.sum())
    if driven == 0:
        return float(not report.support.weak)
    return float(np.clip(1 - report.metres_extrapolated / driven, 0.0, 1.0))


def facts(survey: Survey, report: CorrectionReport) -> list[tuple[str, str]]:
    """Pairs (name, value) at the head of the page: names, reference system, date, files.

    Parameters
    ----------
    survey : Survey
    report : CorrectionReport
    """
    clouds = [row.name for row in report.files] or [file.path.name for file in survey.clouds]
    pairs = list(survey.project.known.items())
    pairs.append((_words("crs"), survey.crs or _words("no crs")))
    pairs.append((_words("recorded"), str(recorded_time(survey)["text"])))
    pairs.append((_words("cloud files"), listed(clouds)))
    if report.inputs:
        others = [row.name for row in report.inputs if row.name not in clouds]
        pairs.append((_words("other files"), listed(others)))
    return pairs


def listed(names: list[str], limit: int = 4) -> str:
    """Join names with commas; of many, the first ones and the number of the others.

    >>> listed(["a.laz", "b.laz", "c.laz"], 2)
    'a.laz, b.laz and 1 more'
    """
    if len(names) <= limit:
        return ", ".join(names)
    return f"{', '.join(names[:limit])} and {len(names) - limit} more"
