"""Mountings by control points and by what two passes, or two scanners, both saw (Eq. 16-18).

A tie compares two views of one thing. What is wrong with the mounting turns and moves both with the
body, so that views in opposite directions, or far and near, tell it; its rows of A are the
differences of the partial derivatives at both. Two scanners that saw it a second apart share nearly
all of the POS error: what is left between them is the one mounting beside the other.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from mlscorr.correction import Correction
from mlscorr.estimate._prediction import pose_rows
from mlscorr.estimate._tie_equations import TieEquations
from mlscorr.estimate._tie_weights import WeighedTies, graduated
from mlscorr.estimate.calibration import Calibration, mounted_corrections
from mlscorr.estimate.equations import Equations
from mlscorr.estimate.mounting import calibration_by, linearized
from mlscorr.estimate.mounting_estimate import combined_correction, corrected_mountings
from mlscorr.estimate.settings import SETTINGS
from mlscorr.estimate.tied import screen_with_ties
from mlscorr.frames import georeferenced_anew
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
        These, as georeferenced with the recorded mountings.
    ties : Ties
        The places likewise; the directions are those of the things themselves.
    """
    tied, correction = _converged(calibration, matched, ties)
    rows = replace(tied.ties, weight=np.ones(len(ties)))  # without those of robust estimation
    bare = replace(tied.equations, ties=None)
    predictions, screening, is_used = screen_with_ties(bare, calibration.screening, rows)
    if not is_used.any():
        return calibration.with_residuals(ties, is_used)
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
    return changed.with_residuals(ties, is_used)


@threadpool_limits.wrap(limits=1, user_api="blas")
def previewed_mounting(
    calibration: Calibration, matched: Matched, ties: Ties
) -> tuple[Correction, ...]:
    """The corrections by each mounting and the POS error with ties that were paired so far.

    Under the parameters of the control points alone, and without sigmas.

    Parameters
    ----------
    calibration : Calibration
        By control points alone.
    matched, ties : Matched, Ties
        As of calibration_with_ties.
    """
    tied, correction = _converged(calibration, matched, ties)
    recorded = calibration.recorded
    mountings = corrected_mountings(recorded, correction)
    pose = tied.solved.predict_mean(*pose_rows(tied.equations, tied.parameters))
    drift = Correction.by_pose_error(calibration.trajectory, pose)
    return mounted_corrections(drift, recorded, mountings)


def _converged(calibration, matched, ties) -> tuple[WeighedTies, np.ndarray]:
    """Equations with robust weights about the mountings that they give, and these' correction."""
    recorded = calibration.recorded
    targets = matched[calibration.used]
    step = 0.0
    correction = calibration.lsc.correction
    equations = calibration.equations
    for _ in range(SETTINGS.mounting_iterations):
        correction = correction + step  # here, so that the last equations are about the last one
        mountings, about = linearized(equations, targets, recorded, correction)
        moved = georeferenced_ties(about, recorded, mountings, ties)
        tied = graduated(about, calibration.parameters[0][0], moved)
        step = combined_correction(correction, tied.solved.trend) - correction
        if np.abs(step).max() < SETTINGS.resolution:
            break
    return tied, correction


def georeferenced_ties(
    equations: Equations, recorded: Sequence[Mounting], mountings: Sequence[Mounting], ties: Ties
) -> TieEquations:
    """The equations of ties that mountings georeferenced, about other ones.

    Parameters
    ----------
    equations : Equations
    recorded, mountings : sequence of Mounting
        Of each scanner: the recorded one, and that about which the equations are.
    ties : Ties
    """
    trajectory = equations.trajectory
    views = (ties.place, ties.gps_time, ties.scanner)
    place = georeferenced_anew(trajectory, recorded, mountings, *views)
    misclosure = np.einsum("ni,ni->n", ties.direction, place[:, 1] - place[:, 0])
    moved = replace(ties, place=place, misclosure=misclosure)
    numbered = dict(enumerate(mountings))
    return TieEquations.of(trajectory, equations.pos, moved, equations.stated, numbered)
