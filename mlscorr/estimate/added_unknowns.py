"""Further unknowns that explain residuals of trend and signals (Baarda's alternative hypothesis).

They are more columns M of A; with P = V^-1 - V^-1 A (A'V^-1 A)^-1 A'V^-1, which the solver applies
to any misclosures, they are (M'PM)^-1 M'Pl (Mao et al. 2015, Eq. 13-18):

- ranges and encoder of scanners in addition to their mountings. An offset of all ranges pushes both
sides of the street outward, whereas a lever arm moves them in one direction; a wrong scale of the
encoder rotates objects far from the zero beam. (An offset of the encoder rotates everything about
the scanner's axis, like a boresight, and is part of that.) - mountings in addition to a correction:
drift depends on time, a boresight's part on the direction of travel, so ties can show that passes
disagree because of a wrong mounting.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import compress

import numpy as np
from scipy.special import chdtri
from threadpoolctl import threadpool_limits

from mlscorr.correction import Correction
from mlscorr.estimate._prediction import predict_pose_error
from mlscorr.estimate.adjustment import Adjustment
from mlscorr.estimate.calibration import (
    MOUNTING_COMPONENTS,
    Calibration,
    MountingEstimate,
    ScannerErrors,
    combined_correction,
)
from mlscorr.estimate.factors import TARGET, TIE, along_ties, mounting_columns, target_columns
from mlscorr.estimate.mounting import is_determined, prior_sigma, with_shift
from mlscorr.estimate.pos_error import Estimate
from mlscorr.estimate.settings import SETTINGS
from mlscorr.frames import (
    georeferenced_anew,
    partials_by_scanner,
    scanner_partials,
)
from mlscorr.pos import SignalParameters
from mlscorr.survey import Matched, Mounting, Statement


@dataclass(frozen=True)
class AddedUnknowns:
    """Estimate of k further unknowns, and a test of its significance.

    Parameters
    ----------
    correction : (k,) array
    covariance : (k, k) array
    response : (p, k) array
        Change of the trend by a unit of each unknown that is omitted.
    trend_variance : (p,) array
        Of the trend estimated with them.
    statistic, critical : float
        Chi-squared of k degrees of freedom, and its critical value.
    """

    correction: np.ndarray
    covariance: np.ndarray
    response: np.ndarray
    trend_variance: np.ndarray
    statistic: float
    critical: float

    @classmethod
    def of(
        cls,
        adjustment: Adjustment,
        parameters: SignalParameters,
        columns: np.ndarray,
        prior_sigma: np.ndarray,
    ) -> AddedUnknowns:
        """Estimate the unknowns.

        Parameters
        ----------
        adjustment : Adjustment
        parameters : SignalParameters
        columns : (m, k) array
            Partial derivatives of the misclosures by the unknowns.
        prior_sigma : (k,) array
            One sigma of prior knowledge of them.
        """
        solved = adjustment.solve(parameters)
        white = solved.solver.whiten(np.column_stack([solved.design, columns]))
        trend, added = np.split(white, [solved.design.shape[1]], axis=1)
        response = solved.trend_covariance @ trend.T @ added  # Eq. 13 of each column
        weights = solved.solver.solve(columns - solved.design @ response)  # P M
        covariance = np.linalg.inv(columns.T @ weights + np.diag(prior_sigma**-2.0))
        right = weights.T @ solved.misclosure
        correction = covariance @ right
        critical = float(chdtri(len(correction), SETTINGS.significance))
        variance = np.diag(solved.trend_covariance + response @ covariance @ response.T)
        return cls(correction, covariance, response, variance, float(right @ correction), critical)

    @property
    def sigma(self) -> np.ndarray:
        """One sigma (k,) of the correction."""
        return np.sqrt(np.diag(self.covariance))

    def is_wrong(self, least: np.ndarray) -> np.ndarray:
        """Mask (k,) of unknowns that are significant and large enough to matter.

        Parameters
        ----------
        least : (k,) array
            Smallest size that matters.
        """
        size = np.abs(self.correction)
        is_large = size > np.maximum(SETTINGS.setup_sigmas * self.sigma, least)
        return is_large & (self.statistic > self.critical)


@threadpool_limits.wrap(limits=1, user_api="blas")
def with_scanner_errors(calibration: Calibration, matched: Matched) -> Calibration:
    """Return the calibration with errors of ranges and encoder, and corrected for significant ones.

    Parameters
    ----------
    calibration : Calibration
        With ties or without.
    matched : Matched
        Its control points, as georeferenced with the recorded mounting.
    """
    columns = _columns(calibration, matched[calibration.used])
    adjustment = calibration.adjustment
    parameters = calibration.parameters[0][0]
    known = SETTINGS.unmeasured_scanner, SETTINGS.least_scanner_error
    prior, least = (np.tile(sigma, len(calibration.recorded)) for sigma in known)
    lacks = AddedUnknowns.of(adjustment, parameters, columns, prior)
    is_wrong = lacks.is_wrong(least)
    correction = lacks.correction
    sigma = lacks.sigma
    if not is_wrong.any():
        errors = ScannerErrors(correction, sigma, sigma < least, is_wrong)
        return replace(calibration, scanner=errors)
    columns = columns[:, is_wrong]
    # An error beyond the data sheet's limits is no draw from its sigmas, so these do not constrain
    # it
    free = np.full(is_wrong.sum(), np.inf)
    lacks = AddedUnknowns.of(adjustment, parameters, columns, free)
    shifted = AddedUnknowns.of(with_shift(adjustment), parameters, columns, free).trend_variance
    determined = calibration.determined & is_determined(shifted[: len(calibration.determined)])
    correction[is_wrong] = lacks.correction
    sigma[is_wrong] = lacks.sigma
    adjustment = adjustment.with_added(-columns @ lacks.correction)
    pose_error = predict_pose_error(adjustment, calibration.posterior)
    freed = replace(
        calibration,
        adjustment=adjustment,
        drift=Correction.by_pose_error(calibration.trajectory, *pose_error),
        determined=determined,
        lsc=_without(calibration.recorded, calibration.lsc, lacks),
        scanner=ScannerErrors(correction, sigma, sigma < least, is_wrong),
    )
    residuals = calibration.ties
    if residuals is None:
        return freed
    return freed.with_residuals(residuals.ties, residuals.used)


def _columns(calibration, targets):
    """Partial derivatives of all misclosures by ranges and encoder: of targets, then of ties."""
    adjustment = calibration.adjustment
    mountings = calibration.lsc.mountings
    trajectory = adjustment.trajectory
    numbered = dict(enumerate(mountings))

    def partials(place, *sighting):
        place = georeferenced_anew(trajectory, calibration.recorded, mountings, place, *sighting)
        return partials_by_scanner(scanner_partials, trajectory, numbered, place, *sighting)

    columns = {TARGET: partials(targets.observations.position, targets.gps_time, targets.scanner)}
    if adjustment.ties is not None:
        ties = calibration.ties.ties[calibration.ties.used]
        views = partials(ties.place.reshape(-1, 3), ties.gps_time.ravel(), ties.scanner.ravel())
        columns[TIE] = along_ties(ties.direction, views).sum(axis=1)[:, None]
    return adjustment.stacked(columns)


def _without(recorded, estimate, lacks):
    """The estimate of mountings that absorbed a part of the errors of ranges and encoders."""
    taken = lacks.response[: len(estimate.correction)]
    correction = combined_correction(estimate.correction, -taken @ lacks.correction)
    covariance = estimate.covariance + taken @ lacks.covariance @ taken.T
    return MountingEstimate.about(recorded, correction, covariance, estimate.sigma0)


@threadpool_limits.wrap(limits=1, user_api="blas")
def find_mounting_error(
    estimate: Estimate, matched: Matched, mountings: Sequence[Mounting]
) -> AddedUnknowns | None:
    """Test the recorded mountings by the ties of a correction; None without any.

    Lever arm (m) and boresight (rad) about right, forward, up are the unknowns, common to all
    scanners: differences between scanners are part of the estimate.

    Parameters
    ----------
    estimate : Estimate
        With ties.
    matched : Matched
        Its control points.
    mountings : sequence of Mounting
        Of all scanners, as recorded.
    """
    adjustment = estimate.adjustment
    residuals = estimate.ties
    if adjustment.ties is None or residuals is None:
        return None
    used = residuals.ties[residuals.used]
    targets = matched[estimate.used]
    trajectory = adjustment.trajectory
    numbered = dict(enumerate(mountings))
    columns = adjustment.stacked(
        {
            TARGET: target_columns(trajectory, mountings, targets),
            TIE: mounting_columns(trajectory, numbered, used)[:, None],
        }
    )
    sums = columns.reshape(len(columns), len(mountings), 6).sum(axis=1)
    return AddedUnknowns.of(adjustment, estimate.parameters, sums, prior_sigma(mountings[0]))


def mounting_warnings(check: AddedUnknowns | None, scanners: int = 1) -> tuple[Statement, ...]:
    """Return a Statement if a wrong mounting is significant, and large enough to matter.

    Parameters
    ----------
    check : AddedUnknowns, optional
        Result of ``find_mounting_error``.
    scanners : int
        Number of scanners.
    """
    if check is None:
        return ()
    is_wrong = check.is_wrong(np.repeat(SETTINGS.determined_sigma, 3))
    if not is_wrong.any():
        return ()
    values = {
        "components": tuple(compress(MOUNTING_COMPONENTS, is_wrong)),
        "corrections": tuple(check.correction[is_wrong].tolist()),
        "sigmas": tuple(check.sigma[is_wrong].tolist()),
        "statistic": check.statistic,
        "critical": check.critical,
        "scanners": scanners,
    }
    return (Statement("wrong mounting", "warning", values),)


def scanner_warnings(estimate: Estimate, names: Sequence[str]) -> Iterator[Statement]:
    """Yield Statements on scanners that disagree with the first, or with themselves, by ties.

    Parameters
    ----------
    estimate : Estimate
        With ties between scanners, or between views of one at a visit.
    names : sequence of str
        Of all scanners.
    """
    solved = estimate.adjustment.solve(estimate.parameters)
    least = np.repeat(SETTINGS.determined_sigma, 3)
    for number, name in enumerate(names[1:] or names):
        of_it = slice(6 * number, 6 * number + 6)
        lacks = solved.trend[of_it]
        covariance = solved.trend_covariance[of_it, of_it]
        sigma = np.sqrt(np.diag(covariance))
        statistic = lacks @ np.linalg.solve(covariance, lacks)
        is_large = np.abs(lacks) > np.maximum(SETTINGS.setup_sigmas * sigma, least)
        if statistic > chdtri(len(lacks), SETTINGS.significance) and is_large.any():
            values = {
                "name": name,
                "first": names[0],
                "corrections": tuple(lacks.tolist()),
                "sigmas": tuple(sigma.tolist()),
            }
            yield Statement("wrong scanner", "warning", values)
