"""First screen of a correction's page: three numbers, names, date, and worst target."""

from datetime import timedelta

import numpy as np

from mlscorr.correction import Correction
from mlscorr.evaluate import TargetRow
from mlscorr.io.trajectories import DAY, gps_epoch
from mlscorr.report import tables
from mlscorr.report.correction_report import CorrectionReport
from mlscorr.survey import Survey
from mlscorr.wording import number, percent

DAYS = ("Sunday", "Monday", "Tuesday", "Wednesday", "Thursday", "Friday", "Saturday")  # of a week
RESULTS = {
    "check": "3D RMSE at check points, before → after",
    "leave-one-out": "3D RMSE at control points, before → leave-one-out",
    "fit": "3D RMSE at control points, before → after (fit only)",
}


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
        text = f"{DAYS[int(day) % 7]}, {_clock(start)} to {_clock(last % DAY)} GPS time"
        return {"start": None, "end": None, "text": f"{text} (the files state no date)"}
    start, end = (epoch + timedelta(seconds=round(time)) for time in (first, last))
    text = f"{start:%Y-%m-%d}, {start:%H:%M:%S} to {end:%H:%M:%S} GPS time"
    return {"start": start.isoformat(), "end": end.isoformat(), "text": text}


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
    accuracy = ("–", "no residual judges the result")
    if before is not None and after is not None:
        change = f"{number(before.rmse[4])} → {number(after.rmse[4])} m"
        accuracy = (change, RESULTS[kind])
    points, _ = report.count("control")
    surveyed = report.points("control").surveyed
    control = (f"{points} of {surveyed}", "surveyed control points used")
    share = well_determined(correction, report)
    return [accuracy, control, (percent(share), "of the drive is well determined by control")]


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
    pairs.append(("Coordinate reference system", survey.crs or "not stated in survey.toml"))
    pairs.append(("Recorded", str(recorded_time(survey)["text"])))
    pairs.append(("Cloud files", listed(clouds)))
    if report.inputs:
        others = [row.name for row in report.inputs if row.name not in clouds]
        pairs.append(("Other input files", listed(others)))
    return pairs


def listed(names: list[str], limit: int = 4) -> str:
    """Join names with commas; of many, the first ones and the number of the others.

    >>> listed(["a.laz", "b.laz", "c.laz"], 2)
    'a.laz, b.laz and 1 more'
    """
    if len(names) <= limit:
        return ", ".join(names)
    return f"{', '.join(names[:limit])} and {len(names) - limit} more"
