"""Residuals at surveyed points before and after a correction: scores, accuracy, rows."""

from collections.abc import Container, Iterable, Sequence

import numpy as np

from mlscorr.estimate import TargetTest
from mlscorr.evaluate._accuracy import positional_accuracy
from mlscorr.evaluate.rows import CHECK_POINT, Score, Statistics, TargetRow
from mlscorr.matching import Refusal
from mlscorr.survey import ControlPoints, Correcting, Matched, PointCloud, Statement, Survey
from mlscorr.targets import Candidates, search_radius


def misclosures(matched: Matched, correction: Correcting | None = None) -> np.ndarray:
    """Return surveyed - observed (n, 3), after a correction if one is given. Units: m.

    Parameters
    ----------
    matched : Matched
    correction : anything with ``apply(cloud) -> cloud``, optional
    """
    if correction is None:
        return matched.misclosure
    centres = PointCloud(matched.observations.position, matched.gps_time, np.zeros(len(matched)))
    return matched.surveyed.position - correction.apply(centres).xyz


def score(
    matched: Matched,
    correction: Correcting,
    left_out: np.ndarray | None = None,
    sigma: np.ndarray | None = None,
) -> Score:
    """Score the residuals of observations before and after a correction.

    Parameters
    ----------
    matched : Matched
    correction : anything with ``apply(cloud) -> cloud``
    left_out : (n, 3) array, optional
        Leave-one-out misclosures, NaN if unknown. Units: m.
    sigma : (k, 3) array, optional
        Sigmas of the leave-one-out misclosures, if given, otherwise of the residuals. Units: m.
    """
    before = Statistics.of(matched.misclosure)
    after = Statistics.of(misclosures(matched, correction))
    by_others = None
    if left_out is not None:
        by_others = Statistics.of(left_out[np.isfinite(left_out).all(axis=1)])
    expected = None
    if sigma is not None and len(sigma):
        expected = Statistics.of(sigma).rmse[:3]
    return Score(before, after, by_others, expected)


def accuracy(
    check: Matched, control: Matched, correction: Correcting, left_out: np.ndarray
) -> dict[str, object]:
    """Accuracy from check points, or from leave-one-out residuals of control points without any.

    Parameters
    ----------
    check, control : Matched
    correction : anything with ``apply(cloud) -> cloud``
    left_out : (n, 3) array
        Leave-one-out misclosures of the control points, NaN if unknown. Units: m.
    """
    if len(check):
        residuals = misclosures(check, correction)
        kind = "check"
        matched = check
    else:
        known = np.isfinite(left_out).all(axis=1)
        residuals = left_out[known]
        kind = "leave_one_out"
        matched = control[known]
    return positional_accuracy(residuals, matched.surveyed.sigma, len(set(matched.name)), kind)


def surveyed_rows(
    control: Matched,
    check: Matched,
    correction: Correcting,
    outliers: Iterable[TargetTest],
    left_out: np.ndarray | None = None,
) -> list[TargetRow]:
    """Make rows of all observed points, control before check.

    Parameters
    ----------
    control, check : Matched
    correction : anything with ``apply(cloud) -> cloud``
    outliers : iterable of TargetTest
        Control points that were not used.
    left_out : (n, 3) array, optional
        For the control points; see ``target_rows``.
    """
    reason = {
        test.name: Statement(
            "outlier", "warning", {"statistic": test.statistic, "critical": test.critical}
        )
        for test in outliers
    }
    reasons = [reason.get(name) for name in control.name]
    rows = target_rows(control, correction, "control", reasons, left_out)
    return rows + target_rows(check, correction, "check", [CHECK_POINT] * len(check))


def target_rows(
    matched: Matched,
    correction: Correcting,
    role: str,
    reasons: Sequence[Statement | None],
    left_out: np.ndarray | None = None,
) -> list[TargetRow]:
    """Make one row for each observation of some surveyed points.

    Parameters
    ----------
    matched : Matched
    correction : anything with ``apply(cloud) -> cloud``
    role : str
        ``control`` or ``check``.
    reasons : sequence of n (Statement or None)
        Reason why an observation was not used; None if it was used.
    left_out : (n, 3) array, optional
        Leave-one-out residuals, NaN if unknown. Units: m.
    """
    observations = matched.observations
    before = matched.misclosure
    # Eq. 19
    after = misclosures(matched, correction)
    sigma = np.sqrt(matched.variance)
    if left_out is None:
        left_out = np.full_like(before, np.nan)
    vectors = matched.surveyed.position, observations.position, sigma, before, after, left_out
    origins = matched.name, observations.pass_number.tolist(), observations.gps_time.tolist()
    return [
        TargetRow(name, number, time, role, *row, why is None, why)
        for name, number, time, *row, why in zip(*origins, *vectors, reasons, strict=True)
    ]


def unseen_rows(
    survey: Survey, refusals: Iterable[Refusal], candidates: Candidates, scanned: Container[str]
) -> list[TargetRow]:
    """Make one TargetRow for each surveyed point without an observation, with the reason.

    Parameters
    ----------
    survey : Survey
    refusals : iterable of Refusal
        Reasons from the matching.
    candidates : Candidates
        Points without a pose are a better reason.
    scanned : container of str
        Names of the points with surrounding points of the cloud.
    """
    rows = []
    for refusal in refusals:
        if refusal.name in (*survey.control.name, *survey.excluded.name):
            role = "control"
        else:
            role = "check"
        point = survey.surveyed[survey.surveyed.rows([refusal.name])]
        why = _no_pose(point, survey, candidates)
        is_scanned = True
        gps_time = None
        if why is None:
            why = refusal.why
            is_scanned = refusal.name in scanned
            gps_time = refusal.gps_time
        named = refusal.name, refusal.pass_number, role, point.position[0]
        rows.append(TargetRow.unobserved(*named, why, is_scanned, gps_time))
    return rows


def _no_pose(point: ControlPoints, survey, candidates):
    """Reason if nearby points of an unobserved target have no pose, otherwise None."""
    distance = np.linalg.norm(candidates.unplaced.xyz - point.position, axis=1)
    times = candidates.unplaced.gps_time[distance <= search_radius(survey, point)[0]]
    if len(times) == 0:
        return None
    values = {"points": len(times), "start": times.min(), "end": times.max()}
    return Statement("no pose", values=values)
