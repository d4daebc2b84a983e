"""What a scanner's own ranges and encoder lack, found along with its mounting.

An offset of all ranges pushes both sides of the street outward, where a lever arm moves them one
way; a wrong scale of the encoder turns what lies far from the zero beam. (An offset of the encoder
turns all about the scanner's axis, as a boresight does, and is part of that.)
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from mlscorr.estimate.added_unknowns import AddedUnknowns, misclosures_of, with_misclosures
from mlscorr.estimate.calibration import SCANNER_COMPONENTS, Calibration, ScannerErrors
from mlscorr.estimate.mounting import combined_correction, corrected_mounting, georeferenced_anew
from mlscorr.estimate.settings import SETTINGS
from mlscorr.estimate.tie_equations import along_ties
from mlscorr.frames import scanner_partials
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
    equations, parameters = calibration.equations, calibration.parameters[0][0]
    prior, least = np.array(SETTINGS.unmeasured_scanner), np.array(SETTINGS.least_scanner_error)
    lacks = AddedUnknowns.of(equations, parameters, columns, prior)
    is_wrong = lacks.is_wrong(least)
    errors = ScannerErrors(lacks.correction, lacks.sigma, lacks.sigma < least, is_wrong)
    if not is_wrong.any():
        return replace(calibration, scanner=errors)
    columns = columns[:, is_wrong]
    lacks = AddedUnknowns.of(equations, parameters, columns, prior[is_wrong])
    left = misclosures_of(equations) - columns @ lacks.correction
    return replace(
        calibration,
        equations=with_misclosures(equations, left),
        lsc=_without(calibration.recorded, calibration.lsc, lacks),
        scanner=errors,
    )


def _columns(calibration, targets):
    """Partial derivatives of all misclosures by ranges and encoder: of targets, then of ties."""
    equations, mounting = calibration.equations, calibration.lsc.mounting

    def partials(place, gps_time):
        both = calibration.recorded, mounting
        place = georeferenced_anew(equations.trajectory, both, place, gps_time)
        return scanner_partials(equations.trajectory, mounting, place, gps_time)

    control = np.zeros((*equations.misclosure.shape, len(SCANNER_COMPONENTS)))
    control[: len(targets)] = partials(targets.observations.position, targets.gps_time)
    control = control.reshape(-1, len(SCANNER_COMPONENTS))
    if equations.ties is None:
        return control
    ties = calibration.ties.ties[calibration.ties.used]
    views = partials(ties.place.reshape(-1, 3), ties.gps_time.ravel())
    return np.vstack([control, along_ties(ties.direction, views).sum(axis=1)])


def _without(recorded, estimate, lacks):
    """The estimate of a mounting that took a part of what ranges and encoder lack."""
    taken = lacks.response[:6]
    correction = combined_correction(estimate.correction, -taken @ lacks.correction)
    covariance = estimate.covariance + taken @ lacks.covariance @ taken.T
    mounting = replace(corrected_mounting(recorded, correction), covariance=covariance)
    return replace(estimate, mounting=mounting, correction=correction, covariance=covariance)
