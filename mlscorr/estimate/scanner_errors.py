"""What the scanners' own ranges and encoders lack, found along with the mountings.

An offset of all ranges pushes both sides of the street outward, where a lever arm moves them one
way; a wrong scale of the encoder turns what lies far from the zero beam. (An offset of the encoder
turns all about the scanner's axis, as a boresight does, and is part of that.)
"""

from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from mlscorr.correction import Correction
from mlscorr.estimate._added_unknowns import AddedUnknowns, with_added
from mlscorr.estimate._prediction import predict_pose_error
from mlscorr.estimate._tie_equations import along_ties
from mlscorr.estimate.calibration import SCANNER_COMPONENTS, Calibration, ScannerErrors
from mlscorr.estimate.mounting import is_determined, with_shift
from mlscorr.estimate.mounting_estimate import MountingEstimate, combined_correction
from mlscorr.estimate.settings import SETTINGS
from mlscorr.frames import georeferenced_anew, partials_by_scanner, scanner_partials
from mlscorr.survey import Matched


@threadpool_limits.wrap(limits=1, user_api="blas")
def with_scanner_errors(calibration: Calibration, matched: Matched) -> Calibration:
    """The calibration with what ranges and encoder lack, and free of it where that is significant.

    Parameters
    ----------
    calibration : Calibration
        With ties or without.
    matched : Matched
        Its control points, as georeferenced with the recorded mounting.
    """
    columns = _columns(calibration, matched[calibration.used])
    equations = calibration.equations
    parameters = calibration.parameters[0][0]
    known = SETTINGS.unmeasured_scanner, SETTINGS.least_scanner_error
    prior, least = (np.tile(sigma, len(calibration.recorded)) for sigma in known)
    lacks = AddedUnknowns.of(equations, parameters, columns, prior)
    is_wrong = lacks.is_wrong(least)
    correction = lacks.correction
    sigma = lacks.sigma
    if not is_wrong.any():
        errors = ScannerErrors(correction, sigma, sigma < least, is_wrong)
        return replace(calibration, scanner=errors)
    columns = columns[:, is_wrong]
    # An error that data sheets rule out is no draw from what they state: it is not held to that
    free = np.full(is_wrong.sum(), np.inf)
    lacks = AddedUnknowns.of(equations, parameters, columns, free)
    shifted = AddedUnknowns.of(with_shift(equations), parameters, columns, free).trend_variance
    determined = calibration.determined & is_determined(shifted[: len(calibration.determined)])
    correction[is_wrong] = lacks.correction
    sigma[is_wrong] = lacks.sigma
    equations = with_added(equations, -columns @ lacks.correction)
    pose_error = predict_pose_error(equations, calibration.posterior)
    freed = replace(
        calibration,
        equations=equations,
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
    equations = calibration.equations
    mountings = calibration.lsc.mountings
    trajectory = equations.trajectory
    numbered = dict(enumerate(mountings))

    def partials(place, *sighting):
        place = georeferenced_anew(trajectory, calibration.recorded, mountings, place, *sighting)
        return partials_by_scanner(scanner_partials, trajectory, numbered, place, *sighting)

    number = len(SCANNER_COMPONENTS) * len(mountings)
    control = np.zeros((*equations.misclosure.shape, number))
    sightings = targets.observations.position, targets.gps_time, targets.scanner
    control[: len(targets)] = partials(*sightings)
    control = control.reshape(-1, number)
    if equations.ties is None:
        return control
    ties = calibration.ties.ties[calibration.ties.used]
    views = partials(ties.place.reshape(-1, 3), ties.gps_time.ravel(), ties.scanner.ravel())
    return np.vstack([control, along_ties(ties.direction, views).sum(axis=1)])


def _without(recorded, estimate, lacks):
    """The estimate of mountings that took a part of what ranges and encoders lack."""
    taken = lacks.response[: len(estimate.correction)]
    correction = combined_correction(estimate.correction, -taken @ lacks.correction)
    covariance = estimate.covariance + taken @ lacks.covariance @ taken.T
    return MountingEstimate.about(recorded, correction, covariance, estimate.sigma0)
