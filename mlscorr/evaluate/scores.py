"""What remains at surveyed points before and after a correction, and what it tells of it."""

import numpy as np

from mlscorr.evaluate._accuracy import positional_accuracy
from mlscorr.evaluate.rows import Score, Statistics
from mlscorr.survey import Correcting, Matched, PointCloud


def misclosures(matched: Matched, correction: Correcting | None = None) -> np.ndarray:
    """Surveyed - observed (n, 3), after a correction if one is given. Units: m.

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
    """What remains of observations before and after a correction.

    Parameters
    ----------
    matched : Matched
    correction : anything with ``apply(cloud) -> cloud``
    left_out : (n, 3) array, optional
        Misclosures once the other points alone have corrected them, NaN where not known. Units: m.
    sigma : (k, 3) array, optional
        Of what a verdict rests on: of those left out, else of those after. Units: m.
    """
    return Score(
        Statistics.of(matched.misclosure),
        Statistics.of(misclosures(matched, correction)),
        None if left_out is None else Statistics.of(left_out[np.isfinite(left_out).all(axis=1)]),
        None if sigma is None or not len(sigma) else Statistics.of(sigma).rmse[:3],
    )


def accuracy(
    check: Matched, control: Matched, correction: Correcting, left_out: np.ndarray
) -> dict[str, object]:
    """Accuracy by the check points; without any, by the control points left out in turn.

    Parameters
    ----------
    check, control : Matched
    correction : anything with ``apply(cloud) -> cloud``
    left_out : (n, 3) array
        Misclosures of the control points once the others alone have corrected them, NaN where
        that isn't known. Units: m.
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
