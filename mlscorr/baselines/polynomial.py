"""Corrections of the trajectory as in the paper: LS-n, and LSC-n as it is printed."""

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.baselines.geometry import Undetermined
from mlscorr.collocation import LiteralSignal, Noise, collocate_literal
from mlscorr.georeference import Correction, pose_partials
from mlscorr.survey import Trajectory

SAME_EPOCH = 1.0  # s; closer together, two targets say the same of the POS
RATIO = 4.0  # correlation time over mean control interval: 3 to 5, section 3.1.4
CHUNK = 1 << 16  # epochs predicted at once


def fit_polynomial(trajectory, observations, control, order):
    """LS-n: the position error as a polynomial of time per axis, and no signal  (Eq. 11).

    Outside the control span the polynomial runs on, as in the paper.

    Parameters
    ----------
    trajectory : Trajectory
        As recorded.
    observations : TargetObservations
        Each with the name of a control point.
    control : ControlPoints
    order : int

    Returns a Correction. Raises Undetermined unless more than order + 1 epochs see control.
    """
    solved = _solve(observations, control, order, [])
    return _correction(trajectory, _predict(solved, trajectory, observations, order))


def fit_literal(trajectory, observations, control, pos, order):
    """LSC-n as it is printed: Eq. 13-15, a diagonal D_Lambda, C0 as a gain of the signal.

    D_Lambda holds the variances that the POS states (section 2.5), C0 is the same (section
    3.1.3: what it is started with), and the correlation time is four times the control interval
    (section 3.1.4). One C0 for all epochs presumes that the variance hardly changes, so it is
    the mean over the control epochs; otherwise C0 over variance, the gain, would reach hundreds.
    The paper then tuned both on what it was scored on; here nothing is.

    Parameters
    ----------
    trajectory, observations, control, order
        As for fit_polynomial.
    pos : Pos
        Beliefs, used where the trajectory has no sigmas.

    Returns a Correction and {"correlation_time": s, "c0": six variances, m^2 and rad^2}. Raises
    Undetermined unless more than order + 1 epochs see control.
    """
    gps_time = observations.gps_time
    _require(gps_time, order)
    c0 = _stated_variance(trajectory.at(gps_time), pos)
    partials = pose_partials(trajectory, observations.position, gps_time)  # B
    correlation_time = RATIO * _interval(trajectory, gps_time)
    signal = LiteralSignal(partials, c0, c0, correlation_time)
    solved = _solve(observations, control, order, [signal])
    found = {"correlation_time": correlation_time, "c0": c0.tolist()}
    return _correction(trajectory, _predict(solved, trajectory, observations, order)), found


def _solve(observations, control, order, signals):
    """Literal collocation of the misclosures; without signals least squares."""
    gps_time = observations.gps_time
    _require(gps_time, order)
    rows = [control.name.index(name) for name in observations.name]
    noise = observations.covariance + control.sigma[rows][:, :, None] ** 2 * np.eye(3)  # Eq. 19
    misclosure = control.position[rows] - observations.position
    design = _design(gps_time, gps_time, order)
    return collocate_literal(gps_time, misclosure, Noise(noise), design, signals)


def _predict(solved, trajectory, observations, order):
    """Pose error (n, 6) at every epoch: position in m, rotation about the map axes in rad."""
    parts = []
    for i in range(0, len(trajectory), CHUNK):
        gps_time = trajectory.gps_time[i : i + CHUNK]
        design = np.zeros((len(gps_time), 6, 3 * (order + 1)))
        design[:, :3] = _design(gps_time, observations.gps_time, order)
        partials = [np.broadcast_to(np.eye(6), (len(gps_time), 6, 6)) for _ in solved.signals]
        parts.append(solved.predict(gps_time, design, partials)[0])
    return np.concatenate(parts)


def _require(gps_time, order):
    """Refuse fewer control epochs than the polynomial needs."""
    epochs = len(_epochs(gps_time))
    if epochs <= order + 1:
        raise Undetermined(
            f"A polynomial of order {order} needs control points at {order + 2} epochs at least "
            f"(section 2.4.2 of the paper); here are {epochs}, {SAME_EPOCH:.0f} s or more apart."
        )


def _epochs(gps_time):
    """Control epochs: the times in order, without those within a second of the one before."""
    kept = []
    for time in np.sort(gps_time):
        if not kept or time - kept[-1] > SAME_EPOCH:
            kept.append(time)
    return np.array(kept)


def _design(gps_time, control_time, order):
    """Legendre trend per axis on the control span, (q, 3, 3 (order + 1))."""
    first, last = control_time.min(), control_time.max()
    argument = (gps_time - (first + last) / 2) / ((last - first) / 2)
    basis = np.polynomial.legendre.legvander(argument, order)
    return np.einsum("qi,jk->qjik", basis, np.eye(3)).reshape(len(basis), 3, -1)


def _stated_variance(pose, pos):
    """Mean variance (6,) that the POS states: position, and small rotations about the map axes."""
    position = np.full(3, pos.position_sigma**2)
    if pose.position_sigma is not None:
        position = np.mean(pose.position_sigma**2, axis=0)
    angles = pose.attitude_sigma
    if angles is None:
        angles = np.broadcast_to(pos.attitude_sigma, (len(pose.gps_time), 3))
    # roll turns about Y, pitch about X, heading about -Z; the diagonal of R diag(s^2) R^T
    about_map = np.einsum("nij,nj->ni", pose.attitude.as_matrix() ** 2, angles[:, [1, 0, 2]] ** 2)
    return np.append(position, about_map.mean(axis=0))


def _interval(trajectory, gps_time):
    """Mean interval of the control epochs, without the trajectory's gaps between them. Units: s."""
    epochs = _epochs(gps_time)
    starts, ends = trajectory.gaps.T
    lost = (ends - starts)[(starts >= epochs[0]) & (ends <= epochs[-1])].sum()
    return float(epochs[-1] - epochs[0] - lost) / (len(epochs) - 1)


def _correction(trajectory, pose):
    """The trajectory corrected by pose errors (n, 6), as a Correction."""
    attitude = Rotation.from_rotvec(pose[:, 3:]) * trajectory.attitude
    corrected = Trajectory(trajectory.gps_time, trajectory.position + pose[:, :3], attitude)
    return Correction(trajectory, corrected)
