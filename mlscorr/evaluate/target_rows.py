"""Rows of every surveyed point and pass, as report.json has them."""

from collections.abc import Container, Iterable, Sequence

import numpy as np

from mlscorr.estimate import TargetTest
from mlscorr.evaluate.rows import CHECK_REASON, TargetRow
from mlscorr.evaluate.scores import misclosures
from mlscorr.matching import Refusal
from mlscorr.survey import ControlPoints, Correcting, Matched, Survey
from mlscorr.targets import Candidates, search_radius


def surveyed_rows(
    control: Matched,
    check: Matched,
    correction: Correcting,
    outliers: Iterable[TargetTest],
    left_out: np.ndarray | None = None,
) -> list[TargetRow]:
    """Rows of all observed points, control before check.

    Parameters
    ----------
    control, check : Matched
    correction : anything with ``apply(cloud) -> cloud``
    outliers : iterable of TargetTest
        Control points that took no part.
    left_out : (n, 3) array, optional
        Of the control points, as for ``target_rows``.
    """
    reason = {
        outlier.name: f"outlier: statistic {outlier.statistic:.1f} against {outlier.critical:.1f}"
        for outlier in outliers
    }
    reasons = [reason.get(name) for name in control.name]
    rows = target_rows(control, correction, "control", reasons, left_out)
    return rows + target_rows(check, correction, "check", [CHECK_REASON] * len(check))


def target_rows(
    matched: Matched,
    correction: Correcting,
    role: str,
    reasons: Sequence[str | None],
    left_out: np.ndarray | None = None,
) -> list[TargetRow]:
    """One row for each observation of some surveyed points.

    Parameters
    ----------
    matched : Matched
    correction : anything with ``apply(cloud) -> cloud``
    role : str
        ``control`` or ``check``.
    reasons : sequence of n (str or None)
        Why an observation took no part in the estimate; None where it did.
    left_out : (n, 3) array, optional
        What remains once the other points alone have corrected it; NaN where that isn't known.
        Units: m.
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
        TargetRow(name, number, time, role, *row, reason is None, reason)
        for name, number, time, *row, reason in zip(*origins, *vectors, reasons, strict=True)
    ]


def unseen_rows(
    survey: Survey, refusals: Iterable[Refusal], candidates: Candidates, scanned: Container[str]
) -> list[TargetRow]:
    """One TargetRow for each surveyed point without an observation, with the reason.

    Parameters
    ----------
    survey : Survey
    refusals : iterable of Refusal
        What the matching gave as reasons.
    candidates : Candidates
        Their points without a pose are a better reason.
    scanned : container of str
        Names of the points that have points of the cloud about them.
    """
    rows = []
    for refusal in refusals:
        if refusal.name in survey.control.name:
            role = "control"
        else:
            role = "check"
        point = survey.surveyed[survey.surveyed.rows([refusal.name])]
        no_pose = _no_pose(point, survey, candidates)
        named = refusal.name, refusal.pass_number, role, point.position[0]
        is_scanned = no_pose is not None or refusal.name in scanned
        why = no_pose or refusal.reason, is_scanned, None if no_pose else refusal.gps_time
        rows.append(TargetRow.unobserved(*named, *why))
    return rows


def _no_pose(point: ControlPoints, survey, candidates):
    """Why a target was not seen, when points near it have no pose; else None."""
    distance = np.linalg.norm(candidates.unplaced.xyz - point.position, axis=1)
    times = candidates.unplaced.gps_time[distance <= search_radius(survey, point)[0]]
    if len(times) == 0:
        return None
    return (
        f"{len(times)} points near it, at {times.min():.1f} to {times.max():.1f} s, were measured "
        "in a gap of the trajectory or outside it, and nothing is interpolated there."
    )
