"""Corrections of the trajectory as in the paper: LS-n, and LSC-n as it is printed."""

import numpy as np

from mlscorr.baselines._settings import SETTINGS
from mlscorr.baselines.pairs import Undetermined
from mlscorr.collocation import CHUNK, LiteralSignal, Noise, collocate_literal, polynomial_design
from mlscorr.correction import Correction
from mlscorr.frames import pose_partials
from mlscorr.pos import stated_sigma
from mlscorr.survey import SAME_EPOCH, Matched, Pos, Trajectory, control_epochs


def fit_polynomial(trajectory: Trajectory, matched: Matched, order: int) -> Correction:
    """LS-n: the position error as a polynomial of time per axis, and no signal  (Eq. 11).

    Outside the control span the polynomial runs on, as in the paper.

    Parameters
    ----------
    trajectory : Trajectory
        As recorded.
    matched : Matched
        Observed control points.
    order : int

    Raises
    ------
    Undetermined
        Unless more than order + 1 epochs see control.
    """
    solved = _solve(matched, order, [])
    return Correction.by_pose_error(trajectory, _predict(solved, trajectory, matched, order))


def fit_literal(
    trajectory: Trajectory, matched: Matched, pos: Pos, order: int
) -> tuple[Correction, dict[str, object]]:
    """LSC-n as it is printed: Eq. 13-15, a diagonal D_Lambda, C0 as a gain of the signal.

    D_Lambda holds the variances that the POS states (section 2.5), C0 is the same (section
    3.1.3: what it is started with), and the correlation time is four times the control interval
    (section 3.1.4). One C0 for all epochs presumes that the variance hardly changes, so it is
    the mean over the control epochs; otherwise C0 over variance, the gain, would reach hundreds.
    The paper then tuned both on what it was scored on; here nothing is.

    Parameters
    ----------
    trajectory, matched, order
        As for fit_polynomial.
    pos : Pos
        Beliefs, used where the trajectory has no sigmas.

    Returns
    -------
    Correction
    dict
        ``correlation_time`` in s, and ``c0``: six variances, m^2 and rad^2.

    Raises
    ------
    Undetermined
        Unless more than order + 1 epochs see control.
    """
    gps_time = matched.gps_time
    _require_epochs(gps_time, order)
    stated = stated_sigma(trajectory, pos, gps_time)
    turns = np.einsum("nij,nij->ni", stated.attitude, stated.attitude)  # about the map's axes
    c0 = np.append(np.mean(stated.position**2, axis=0), turns.mean(axis=0))
    partials = pose_partials(trajectory, matched.observations.position, gps_time)  # B
    correlation_time = SETTINGS.interval_ratio * trajectory.control_interval(gps_time)
    solved = _solve(matched, order, [LiteralSignal(partials, c0, c0, correlation_time)])
    details = {"correlation_time": correlation_time, "c0": c0.tolist()}
    pose = _predict(solved, trajectory, matched, order)
    return Correction.by_pose_error(trajectory, pose), details


def _solve(matched, order, signals):
    """Literal collocation of the misclosures; without signals least squares."""
    gps_time = matched.gps_time
    _require_epochs(gps_time, order)
    survey = matched.surveyed.sigma[:, :, None] ** 2 * np.eye(3)
    noise = matched.observations.covariance + survey  # Eq. 19
    design = _design(gps_time, matched, order)
    return collocate_literal(gps_time, matched.misclosure, Noise(noise), design, signals)


def _predict(solved, trajectory, matched, order):
    """Pose error (n, 6) at every epoch: position in m, rotation about the map axes in rad."""
    parts = []
    for i in range(0, len(trajectory), CHUNK):
        gps_time = trajectory.gps_time[i : i + CHUNK]
        position = _design(gps_time, matched, order)
        design = np.concatenate([position, np.zeros_like(position)], axis=1)
        partials = [np.broadcast_to(np.eye(6), (len(gps_time), 6, 6)) for _ in solved.signals]
        parts.append(solved.predict(gps_time, design, partials)[0])
    return np.concatenate(parts)


def _design(gps_time, matched, order):
    span = matched.gps_time.min(), matched.gps_time.max()
    return polynomial_design(gps_time, span, order, extrapolate=True)


def _require_epochs(gps_time, order):
    """Refuse fewer control epochs than the polynomial needs."""
    count = len(control_epochs(gps_time))
    if count <= order + 1:
        raise Undetermined(
            f"A polynomial of order {order} needs control points at {order + 2} epochs at least "
            f"(section 2.4.2 of the paper); here are {count}, {SAME_EPOCH:.0f} s or more "
            "apart."
        )
