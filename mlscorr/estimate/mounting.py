"""From misclosures to the calibrated mounting (Mao et al. 2015, section 2.4.3, Eq. 16-18).

The mounting is the trend and the POS error the signal: 3 of the position and 3 small rotations
about the map axes. Plain least squares, which takes the POS to be free of error, stands beside it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation
from threadpoolctl import threadpool_limits

from mlscorr.collocation.covariance import INTEGRATED
from mlscorr.correction import Correction
from mlscorr.estimate.assembly import mounting_equations, position_equations
from mlscorr.estimate.calibration import Calibration, MountingEstimate
from mlscorr.estimate.equations import Equations
from mlscorr.estimate.guards import find_guards
from mlscorr.estimate.inputs import checked_inputs, filled_sigmas
from mlscorr.estimate.posterior import Objective, Posterior
from mlscorr.estimate.prediction import predict_pose_error
from mlscorr.estimate.prior import mounting_prior
from mlscorr.estimate.screening import Screening, screen
from mlscorr.estimate.settings import SETTINGS
from mlscorr.frames import georeference, to_scanner
from mlscorr.survey import SAME_EPOCH, Matched, Mounting, Pos, Trajectory


# The matrices are small: on a busy machine threads would wait longer than they work
@threadpool_limits.wrap(limits=1, user_api="blas")
def estimate_mounting(
    trajectory: Trajectory, mounting: Mounting, matched: Matched, pos: Pos | None = None
) -> Calibration:
    """Estimate what a recorded mounting lacks from matched targets  (Mao et al. 2015, Eq. 16-18).

    Parameters
    ----------
    trajectory : Trajectory
        As recorded.
    mounting : Mounting
        As recorded: the observations were georeferenced with it.
    matched : Matched
        Observed control points.
    pos : Pos, optional
        Beliefs, used where the trajectory has no sigmas.

    Raises
    ------
    ValueError
        For fewer than 3 targets, where all of them were seen at one time, and for sigmas that
        can't be.
    """
    pos = Pos() if pos is None else pos
    _check(matched)
    filled, notes = checked_inputs(trajectory, matched, pos, 0)
    equations = position_equations(filled, matched, pos, 0, mounting_prior)
    screening = screen(_least_squares(equations, matched, mounting)[0])
    used = ~np.isin(equations.names, [outlier.name for outlier in screening.outliers])
    kept, start, ls = _least_squares(equations.select(used), matched[used], mounting)
    return calibration_by(trajectory, mounting, kept, screening, (start, ls), used, notes)


@threadpool_limits.wrap(limits=1, user_api="blas")
def believed_mounting(
    trajectory: Trajectory, mounting: Mounting, matched: Matched, pos: Pos | None = None
) -> Calibration:
    """What is known of a mounting before ties, where control points can't tell it alone.

    Parameters
    ----------
    trajectory, mounting : Trajectory, Mounting
        As recorded.
    matched : Matched
        Observed control points: any number, none of which can be tested.
    pos : Pos, optional
        Beliefs, used where the trajectory has no sigmas.

    Returns
    -------
    Calibration
        Under the parameters that are believed. Ties can be added to it.
    """
    pos = Pos() if pos is None else pos
    filled, notes = filled_sigmas(trajectory)
    equations = position_equations(filled, matched, pos, 0, mounting_prior)
    kept, start, ls = _least_squares(equations, matched, mounting)
    objective = Objective.of(kept)
    mode = ((objective.parameters(INTEGRATED, objective.initial), 1.0),)
    screening = Screening(Posterior(mode, mode), (), (), (), ())
    used = np.ones(len(matched), dtype=bool)
    return calibration_by(trajectory, mounting, kept, screening, (start, ls), used, notes)


def calibration_by(
    trajectory: Trajectory,
    recorded: Mounting,
    equations: Equations,
    screening: Screening,
    least_squares: tuple[np.ndarray, MountingEstimate],
    used: np.ndarray,
    notes: tuple[str, ...],
) -> Calibration:
    """The Calibration by equations, and the parameters that were chosen for them.

    Parameters
    ----------
    trajectory, recorded : Trajectory, Mounting
    equations : Equations
        About the mounting with a correction.
    screening : Screening
    least_squares : (6,) array and MountingEstimate
        That correction, and the estimate by least squares. Units: m and rad.
    used : (n,) bool array
    notes : tuple of str
    """
    posterior = screening.posterior
    lsc, determined = _collocation(equations, posterior, recorded, least_squares[0])
    parameters = posterior.modes[0][0]
    pose, covariance = predict_pose_error(equations, posterior)
    drift = Correction.by_pose_error(trajectory, pose, covariance, recorded, lsc.mounting)
    return Calibration(
        trajectory=trajectory,
        recorded=recorded,
        lsc=lsc,
        ls=least_squares[1],
        determined=determined,
        screening=screening,
        used=used,
        guards=find_guards(equations, parameters, drift.corrected),
        equations=equations,
        notes=notes,
    )


def _check(matched):
    count = len(set(matched.name))
    if count < SETTINGS.smallest_targets:
        raise ValueError(
            f"{count} control points were found in the cloud; a calibration of lever arm and "
            f"boresight needs {SETTINGS.smallest_targets} at least, and 8 or more on both sides "
            "of the way, near and far, to be of use."
        )
    span = np.ptp(matched.gps_time)
    if span < SAME_EPOCH:
        raise ValueError(
            f"All {count} control points were seen within {span:.2f} s (at least "
            f"{SAME_EPOCH:.0f} s are needed): at one time the error of the POS can't be told from "
            "that of the mounting. Drive past control points in both directions."
        )


def _least_squares(equations, matched, recorded):
    """Equations about the mounting of plain least squares, its correction (6,), and the estimate.

    Iterated, as a rotation is not linear; the targets are georeferenced anew each time.
    """
    correction = np.zeros(6)
    for _ in range(SETTINGS.iterations):
        mounting, about = linearized(equations, matched, recorded, correction)
        solved = about.solve(None)
        step = combined_correction(correction, solved.trend) - correction
        if np.abs(step).max() < SETTINGS.resolution:
            break
        correction = correction + step
    covariance = solved.trend_covariance
    # What the weak hold of the mounting adds to the redundancy is what it adds to the estimate
    observed, sigma0 = 3 * len(matched), 1.0
    redundancy = observed - 6 + np.sum(np.diag(covariance) / prior_sigma(recorded) ** 2)
    if observed:
        sigma0 = solved.sigma0 * np.sqrt(observed / redundancy)
    estimate = MountingEstimate(mounting, correction, sigma0**2 * covariance, float(sigma0))
    return about, correction, estimate


def linearized(
    equations: Equations, matched: Matched, recorded: Mounting, correction: np.ndarray
) -> tuple[Mounting, Equations]:
    """The mounting with a correction, and the equations about it, its targets georeferenced anew.

    Parameters
    ----------
    equations : Equations
        Of the same targets, about any mounting.
    matched : Matched
        As georeferenced with the recorded mounting.
    recorded : Mounting
    correction : (6,) array
        Lever arm and rotation. Units: m and rad.
    """
    mounting = corrected_mounting(recorded, correction)
    position = georeferenced_anew(
        equations.trajectory, (recorded, mounting), matched.observations.position, matched.gps_time
    )
    moved = replace(matched, observations=replace(matched.observations, position=position))
    weak = prior_sigma(recorded)
    return mounting, mounting_equations(equations, moved, mounting, correction, weak)


def prior_sigma(mounting: Mounting) -> np.ndarray:
    """One sigma (6,) of what is known of a mounting without the survey. Units: m, rad.

    That of its measured part, and what is known without any measurement of the other.

    Parameters
    ----------
    mounting : Mounting
    """
    unmeasured = np.repeat(SETTINGS.unmeasured, 3)
    if mounting.measured is None:
        return unmeasured
    return np.where(np.isnan(mounting.measured), unmeasured, mounting.measured)


def georeferenced_anew(
    trajectory: Trajectory,
    mountings: tuple[Mounting, Mounting],
    position: np.ndarray,
    gps_time: np.ndarray,
) -> np.ndarray:
    """Places (n, 3) that one mounting gave, as another gives them  (Eq. 1). Units: m.

    Parameters
    ----------
    trajectory : Trajectory
    mountings : pair of Mounting
        That of the places, and the other.
    position : (n, 3) array
        Units: m.
    gps_time : (n,) array
        Units: s.
    """
    in_scanner = to_scanner(trajectory, mountings[0], position, gps_time)
    return georeference(trajectory, mountings[1], in_scanner, gps_time)


def corrected_mounting(mounting: Mounting, correction: np.ndarray) -> Mounting:
    """The mounting that lacked a correction  (Eq. 2).

    Parameters
    ----------
    mounting : Mounting
    correction : (6,) array
        Lever arm and rotation. Units: m and rad.
    """
    turn = Rotation.from_rotvec(correction[3:])
    return Mounting(mounting.lever_arm + correction[:3], turn * mounting.boresight)


def combined_correction(correction: np.ndarray, more: np.ndarray) -> np.ndarray:
    """The correction (6,) of one after another: Exp(more) Exp(correction).

    Parameters
    ----------
    correction, more : (6,) array
        Lever arm and rotation. Units: m and rad.
    """
    turn = Rotation.from_rotvec(more[3:]) * Rotation.from_rotvec(correction[3:])
    return np.append(correction[:3] + more[:3], turn.as_rotvec())


def _collocation(equations, posterior, recorded, start):
    """The estimate by collocation, averaged over the parameters, and what is determined (6,)."""
    constant = np.tile(np.eye(3), (len(equations.mounting), 1, 1))
    constant[-2:] = 0.0  # the rows that hold the mounting
    with_shift = np.concatenate([equations.mounting, constant], axis=2)
    if len(equations.names) == 0:  # nothing sees a constant difference
        with_shift = equations.mounting
    mean, square, shifted, sigma0 = 0.0, 0.0, 0.0, 0.0
    for parameters, probability in posterior.points:
        solved = equations.solve(parameters)
        mean += probability * solved.trend
        square += probability * (solved.trend_covariance + np.outer(solved.trend, solved.trend))
        sigma0 += probability * solved.sigma0
        free = replace(equations, mounting=with_shift).solve(parameters)
        shifted += probability * np.diag(free.trend_covariance)[:6]
    correction = combined_correction(start, mean)
    covariance = square - np.outer(mean, mean)
    mounting = replace(corrected_mounting(recorded, correction), covariance=covariance)
    estimate = MountingEstimate(mounting, correction, covariance, float(sigma0))
    return estimate, np.sqrt(shifted) < np.repeat(SETTINGS.determined_sigma, 3)
