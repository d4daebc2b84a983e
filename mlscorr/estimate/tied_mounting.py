"""A mounting by control points and by what two passes both saw (Eq. 16-18).

A tie compares two views of one thing. What is wrong with the mounting turns and moves both with the
body, so that views in opposite directions, or far and near, tell it; its rows of A are the
differences of the partial derivatives at both.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from mlscorr.correction import Correction
from mlscorr.estimate.calibration import Calibration
from mlscorr.estimate.equations import Equations
from mlscorr.estimate.mounting import (
    calibration_by,
    combined_correction,
    corrected_mounting,
    georeferenced_anew,
    linearized,
)
from mlscorr.estimate.prediction import pose_rows
from mlscorr.estimate.settings import SETTINGS
from mlscorr.estimate.tie_equations import TieEquations
from mlscorr.estimate.tie_weights import WeighedTies, graduated
from mlscorr.estimate.tied import TieResiduals, screen_with_ties
from mlscorr.survey import Matched, Mounting, Ties


@threadpool_limits.wrap(limits=1, user_api="blas")
def calibration_with_ties(calibration: Calibration, matched: Matched, ties: Ties) -> Calibration:
    """The calibration by control points and by what two passes both saw.

    Least squares stays that of the control points.

    Parameters
    ----------
    calibration : Calibration
        By control points alone.
    matched : Matched
        These, as georeferenced with the recorded mounting.
    ties : Ties
        The places likewise; the directions are those of the things themselves.
    """
    parameters = calibration.parameters[0][0]
    tied, correction = _converged(calibration, matched, ties, parameters)
    rows = replace(tied.ties, weight=np.ones(len(ties)))  # without those of robust estimation
    bare = replace(tied.equations, ties=None)
    predictions, screening, is_used = screen_with_ties(bare, calibration.screening, rows)
    if not is_used.any():
        residuals = TieResiduals.of(ties, is_used, calibration.correction_with_drift)
        return replace(calibration, ties=residuals)
    used = calibration.used & ~np.isin(matched.name, [o.name for o in screening.outliers])
    changed = calibration_by(
        calibration.trajectory,
        calibration.recorded,
        predictions.equations,
        screening,
        (correction, calibration.ls),
        used,
        calibration.notes,
    )
    residuals = TieResiduals.of(ties, is_used, changed.correction_with_drift)
    return replace(changed, ties=residuals)


@threadpool_limits.wrap(limits=1, user_api="blas")
def previewed_mounting(calibration: Calibration, matched: Matched, ties: Ties) -> Correction:
    """The correction by mounting and POS error with ties that were paired so far.

    Under the parameters of the control points alone, and without sigmas.

    Parameters
    ----------
    calibration : Calibration
        By control points alone.
    matched, ties : Matched, Ties
        As of calibration_with_ties.
    """
    parameters = calibration.parameters[0][0]
    tied, correction = _converged(calibration, matched, ties, parameters)
    mounting = corrected_mounting(calibration.recorded, correction)
    pose = tied.solved.predict_mean(*pose_rows(tied.equations, parameters))
    trajectory, recorded = calibration.trajectory, calibration.recorded
    return Correction.by_pose_error(trajectory, pose, None, recorded, mounting)


def _converged(calibration, matched, ties, parameters) -> tuple[WeighedTies, np.ndarray]:
    """Equations with robust weights about the mounting that they give, and its correction (6,)."""
    recorded, targets = calibration.recorded, matched[calibration.used]
    correction, equations = calibration.lsc.correction, calibration.equations
    for _ in range(SETTINGS.iterations):
        mounting, about = linearized(equations, targets, recorded, correction)
        moved = georeferenced_ties(about, (recorded, mounting), ties)
        tied = graduated(about, parameters, moved)
        step = combined_correction(correction, tied.solved.trend) - correction
        if np.abs(step).max() < SETTINGS.resolution:
            break
        correction = correction + step
    return tied, correction


def georeferenced_ties(
    equations: Equations, mountings: tuple[Mounting, Mounting], ties: Ties
) -> TieEquations:
    """The equations of ties that a mounting georeferenced, about another one.

    Parameters
    ----------
    equations : Equations
    mountings : pair of Mounting
        The recorded one, and that about which the equations are.
    ties : Ties
    """
    trajectory, times = equations.trajectory, ties.gps_time.ravel()
    place = georeferenced_anew(trajectory, mountings, ties.place.reshape(-1, 3), times)
    place = place.reshape(-1, 2, 3)
    misclosure = np.einsum("ni,ni->n", ties.direction, place[:, 1] - place[:, 0])
    moved = replace(ties, place=place, misclosure=misclosure)
    return TieEquations.of(trajectory, equations.pos, moved, equations.stated, {0: mountings[1]})
