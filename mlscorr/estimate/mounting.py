"""Estimation of calibrated mountings from misclosures (Mao et al. 2015, section 2.4.3, Eq. 16-18).

The mountings of all scanners are the trend, six columns each, and their common POS error is the
signal: 3 of the position and 3 small rotations about the map axes. Plain least squares, which
assumes an error-free POS, is computed too.

A tie compares two views of one object. An error of the mounting rotates and moves both with the
body, so that views in opposite directions, or at different distances, reveal it; its rows of A are
the differences of the partial derivatives at both. Two scanners that observed it within a second
share nearly all of the POS error: the remaining difference is that between their mountings.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from mlscorr.correction import Correction
from mlscorr.estimate._prediction import pose_rows, predict_pose_error
from mlscorr.estimate.adjustment import Adjustment, mounting_adjustment, position_adjustment
from mlscorr.estimate.calibration import (
    Calibration,
    MountingEstimate,
    combined_correction,
    corrected_mountings,
    mounted_corrections,
)
from mlscorr.estimate.factors import TARGET, Factor, tie_factor
from mlscorr.estimate.guards import find_guards
from mlscorr.estimate.inputs import checked_inputs, filled_sigmas
from mlscorr.estimate.posterior import mounting_prior
from mlscorr.estimate.settings import SETTINGS
from mlscorr.estimate.target_tests import Screening, screen
from mlscorr.estimate.tied import WeighedTies, graduated, screen_with_ties
from mlscorr.frames import georeferenced_anew
from mlscorr.pos import PosErrors
from mlscorr.survey import SAME_EPOCH, Matched, Mounting, Pos, Statement, Ties, Trajectory


# The matrices are small: on a busy machine synchronizing threads takes longer than the work
@threadpool_limits.wrap(limits=1, user_api="blas")
def estimate_mounting(
    trajectory: Trajectory, mountings: Sequence[Mounting], matched: Matched, pos: Pos | None = None
) -> Calibration:
    """Estimate errors of recorded mountings from matched targets  (Mao et al. 2015, Eq. 16-18).

    Parameters
    ----------
    trajectory : Trajectory
        As recorded.
    mountings : sequence of Mounting
        Of each scanner as recorded, used to georeference the observations.
    matched : Matched
        Observed control points; the survey error of one is the same for all scanners.
    pos : Pos, optional
        Assumptions, used if the trajectory has no sigmas.

    Raises
    ------
    ValueError
        If no scanner saw 3 targets at different times, and for invalid sigmas.
    """
    pos = pos or Pos()
    faults = [control_fault(matched, number) for number in range(len(mountings))]
    if all(faults):
        raise ValueError(faults[0])
    filled, notes = checked_inputs(trajectory, matched, pos, 0)
    adjustment = position_adjustment(filled, matched, pos, 0, mounting_prior)
    screening = screen(_least_squares(adjustment, matched, mountings)[0])
    used = ~np.isin(adjustment.names, [outlier.name for outlier in screening.outliers])
    kept, start, ls = _least_squares(adjustment.select(used), matched[used], mountings)
    return calibration_by(trajectory, mountings, kept, screening, (start, ls), used, notes)


@threadpool_limits.wrap(limits=1, user_api="blas")
def prior_mounting(
    trajectory: Trajectory, mountings: Sequence[Mounting], matched: Matched, pos: Pos | None = None
) -> Calibration:
    """Prior calibration before ties, for control points that do not determine the mountings alone.

    Parameters
    ----------
    trajectory, mountings : Trajectory, sequence of Mounting
        As recorded.
    matched : Matched
        Any number of observed control points, which cannot be tested.
    pos : Pos, optional
        Assumptions, used if the trajectory has no sigmas.

    Returns
    -------
    Calibration
        Under the prior parameters. Ties can be added to it.
    """
    pos = pos or Pos()
    filled, notes = filled_sigmas(trajectory)
    adjustment = position_adjustment(filled, matched, pos, 0, mounting_prior)
    kept, start, ls = _least_squares(adjustment, matched, mountings)
    screening = Screening.untested(kept)
    used = np.ones(len(matched), dtype=bool)
    return calibration_by(trajectory, mountings, kept, screening, (start, ls), used, notes)


@threadpool_limits.wrap(limits=1, user_api="blas")
def calibration_with_ties(calibration: Calibration, matched: Matched, ties: Ties) -> Calibration:
    """Return the calibration by control points and by ties between passes.

    Least squares remains that of the control points.

    Parameters
    ----------
    calibration : Calibration
        By control points alone.
    matched : Matched
        These, as georeferenced with the recorded mountings.
    ties : Ties
        Their positions likewise; the directions are those of the objects themselves.
    """
    weighed, correction = _converged(calibration, matched, ties)
    tied = weighed.adjustment.with_factor(weighed.ties.scaled(1.0))  # without robust weights
    predictions, screening, is_used = screen_with_ties(tied, calibration.screening)
    if not is_used.any():
        return calibration.with_residuals(ties, is_used)
    used = calibration.used & ~np.isin(matched.name, [o.name for o in screening.outliers])
    changed = calibration_by(
        calibration.trajectory,
        calibration.recorded,
        predictions.adjustment,
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
    """Return corrections by each mounting and the POS error, with the ties paired so far.

    Under the parameters of the control points alone, and without sigmas.

    Parameters
    ----------
    calibration : Calibration
        By control points alone.
    matched, ties : Matched, Ties
        See ``calibration_with_ties``.
    """
    tied, correction = _converged(calibration, matched, ties)
    recorded = calibration.recorded
    mountings = corrected_mountings(recorded, correction)
    pose = tied.solved.predict_mean(*pose_rows(tied.adjustment, tied.parameters))
    drift = Correction.by_pose_error(calibration.trajectory, pose)
    return mounted_corrections(drift, recorded, mountings)


def control_fault(matched: Matched, number: int) -> str:
    """Reason that control points alone don't determine a scanner's mounting; empty if they do.

    Parameters
    ----------
    matched : Matched
    number : int
        Of the scanner, from 0.
    """
    matched = matched[matched.scanner == number]
    count = len(set(matched.name))
    if count < SETTINGS.smallest_targets:
        return (
            f"{count} control points were found in the cloud; a calibration of lever arm and "
            f"boresight needs at least {SETTINGS.smallest_targets}. For useful results, survey 8 "
            "or more on both sides of the road, near and far."
        )
    span = np.ptp(matched.gps_time)
    if span < SAME_EPOCH:
        return (
            f"All {count} control points were observed within {span:.2f} s (at least "
            f"{SAME_EPOCH:.0f} s are needed), so POS error and mounting error are not separable. "
            "Drive past control points in both directions."
        )
    return ""


def calibration_by(
    trajectory: Trajectory,
    recorded: Sequence[Mounting],
    adjustment: Adjustment,
    screening: Screening,
    least_squares: tuple[np.ndarray, MountingEstimate],
    used: np.ndarray,
    notes: tuple[Statement, ...],
) -> Calibration:
    """Return the Calibration by equations, and the parameters that were chosen for them.

    Parameters
    ----------
    trajectory, recorded : Trajectory, sequence of Mounting
    adjustment : Adjustment
        About the mountings with a correction.
    screening : Screening
    least_squares : (6 k,) array and MountingEstimate
        That correction, and the estimate by least squares. Units: m and rad.
    used : (n,) bool array
    notes : tuple of Statement
    """
    posterior = screening.posterior
    lsc, determined = _collocation(adjustment, posterior, recorded, least_squares[0])
    parameters = posterior.modes[0][0]
    drift = Correction.by_pose_error(trajectory, *predict_pose_error(adjustment, posterior))
    return Calibration(
        trajectory=trajectory,
        recorded=tuple(recorded),
        lsc=lsc,
        ls=least_squares[1],
        determined=determined,
        screening=screening,
        used=used,
        guards=find_guards(adjustment, parameters, drift.corrected),
        adjustment=adjustment,
        drift=drift,
        notes=notes,
    )


def _least_squares(adjustment, matched, recorded):
    """Equations about the mountings of plain least squares, their correction, and the estimate.

    Iterated, because a rotation is not linear; the targets are georeferenced anew each time.
    """
    correction = np.zeros(6 * len(recorded))
    step = 0.0
    for _ in range(SETTINGS.mounting_iterations):
        correction = correction + step  # here, so that the last equations are about the last one
        mountings, about = linearized(adjustment, matched, recorded, correction)
        solved = about.solve(None)
        step = combined_correction(correction, solved.trend) - correction
        if np.abs(step).max() < SETTINGS.resolution:
            break
    # A weak constraint adds the same amount to the redundancy as to the estimate
    prior_share = solved.trend_covariance / _weak(recorded) ** 2
    observed = 3 * len(matched)
    sigma0 = 1.0
    redundancy = observed - len(correction) + np.trace(prior_share)
    if round(redundancy) > 0:  # a redundancy below one contains no information on the noise
        sigma0 = solved.sigma0 * np.sqrt(observed / redundancy)
    # Larger noise makes the targets worse, but not the constraint: s^2 (C^-1 + (s^2 - 1) W)^-1
    shared = np.eye(len(correction)) + (sigma0**2 - 1.0) * prior_share
    covariance = np.linalg.solve(shared, sigma0**2 * solved.trend_covariance)
    return about, correction, MountingEstimate(mountings, correction, covariance, float(sigma0))


def linearized(
    adjustment: Adjustment, matched: Matched, recorded: Sequence[Mounting], correction: np.ndarray
) -> tuple[tuple[Mounting, ...], Adjustment]:
    """Return mountings with a correction, and the equations about them, targets georeferenced anew.

    Parameters
    ----------
    adjustment : Adjustment
        Of the same targets, about any mountings.
    matched : Matched
        As georeferenced with the recorded mountings.
    recorded : sequence of Mounting
    correction : (6 k,) array
        Lever arm and rotation of each. Units: m and rad.
    """
    mountings = corrected_mountings(recorded, correction)
    observed = matched.observations
    place = observed.position, matched.gps_time, matched.scanner
    position = georeferenced_anew(adjustment.trajectory, recorded, mountings, *place)
    moved = replace(matched, observations=replace(observed, position=position))
    return mountings, mounting_adjustment(adjustment, moved, mountings, correction, _weak(recorded))


def _converged(calibration, matched, ties) -> tuple[WeighedTies, np.ndarray]:
    """Equations with robust weights about the resulting mountings, and their correction."""
    recorded = calibration.recorded
    targets = matched[calibration.used]
    step = 0.0
    correction = calibration.lsc.correction
    adjustment = calibration.adjustment
    for _ in range(SETTINGS.mounting_iterations):
        correction = correction + step  # here, so that the last equations are about the last one
        mountings, about = linearized(adjustment, targets, recorded, correction)
        factor = georeferenced_ties(about.errors, recorded, mountings, ties)
        tied = graduated(about.with_factor(factor), calibration.parameters[0][0])
        step = combined_correction(correction, tied.solved.trend) - correction
        if np.abs(step).max() < SETTINGS.resolution:
            break
    return tied, correction


def georeferenced_ties(
    errors: PosErrors, recorded: Sequence[Mounting], mountings: Sequence[Mounting], ties: Ties
) -> Factor:
    """Return the factor of ties that mountings georeferenced, linearized about other mountings.

    Parameters
    ----------
    errors : PosErrors
    recorded, mountings : sequence of Mounting
        Of each scanner: the recorded one, and that of the linearization.
    ties : Ties
    """
    trajectory = errors.trajectory
    views = (ties.place, ties.gps_time, ties.scanner)
    place = georeferenced_anew(trajectory, recorded, mountings, *views)
    misclosure = np.einsum("ni,ni->n", ties.direction, place[:, 1] - place[:, 0])
    moved = replace(ties, place=place, misclosure=misclosure)
    numbered = dict(enumerate(mountings))
    return tie_factor(errors, moved, numbered)


def _weak(mountings):
    """One sigma (6 k,) of prior knowledge of mountings. Units: m, rad."""
    return np.concatenate([prior_sigma(mounting) for mounting in mountings])


def prior_sigma(mounting: Mounting) -> np.ndarray:
    """One sigma (6,) of prior knowledge of a mounting. Units: m, rad.

    The stated sigma of its measured part, and a general prior for the other.

    Parameters
    ----------
    mounting : Mounting
    """
    unmeasured = np.repeat(SETTINGS.unmeasured, 3)
    if mounting.measured is None:
        return unmeasured
    return np.where(np.isnan(mounting.measured), unmeasured, mounting.measured)


def _collocation(adjustment, posterior, recorded, start):
    """Estimate by collocation, averaged over the parameters, and mask of determined parts."""
    shifting = with_shift(adjustment)
    mean = 0.0
    square = 0.0
    shifted = 0.0
    sigma0 = 0.0
    for parameters, probability in posterior.points:
        solved = adjustment.solve(parameters)
        mean += probability * solved.trend
        square += probability * (solved.trend_covariance + np.outer(solved.trend, solved.trend))
        sigma0 += probability * solved.sigma0
        free = shifting.solve(parameters)
        shifted += probability * np.diag(free.trend_covariance)[: len(start)]
    correction = combined_correction(start, mean)
    covariance = square - np.outer(mean, mean)
    estimate = MountingEstimate.about(recorded, correction, covariance, float(sigma0))
    return estimate, is_determined(shifted)


def with_shift(adjustment: Adjustment) -> Adjustment:
    """The same with a constant difference between the coordinates of control and trajectory."""
    n = len(adjustment.names)
    if n == 0:  # nothing depends on it
        return adjustment
    constant = {TARGET: np.tile(np.eye(3), (n, 1, 1))}
    return adjustment.with_unknowns(constant, np.zeros(3), np.full(3, np.inf))


def is_determined(variance: np.ndarray) -> np.ndarray:
    """Mask (6 k,) of mounting components that a geometry determines, with any shift."""
    limit = np.tile(np.repeat(SETTINGS.determined_sigma, 3), len(variance) // 6)
    return np.sqrt(variance) < limit
