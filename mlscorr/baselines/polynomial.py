"""Corrections of the trajectory as in the paper: LS-n, and LSC-n as it is printed."""

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.baselines.geometry import Undetermined
from mlscorr.georeference import Correction, pose_partials
from mlscorr.survey import Trajectory

SAME_EPOCH = 1.0  # s; closer together, two targets say the same of the POS
RATIO = 4.0  # correlation time over mean control interval: 3 to 5, section 3.1.4


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
    basis = _basis(observations.gps_time, order)
    misclosure, noise = _misclosures(observations, control)
    trend, _ = _solve_trend(basis, misclosure, noise)
    return _correction(trajectory, _basis_at(trajectory, observations, order) @ trend)


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
    basis = _basis(gps_time, order)
    misclosure, noise = _misclosures(observations, control)
    c0 = _stated_variance(trajectory.at(gps_time), pos)
    partials = pose_partials(trajectory, observations.position, gps_time)  # B
    total = (partials * c0) @ partials.swapaxes(1, 2) + noise
    trend, weights = _solve_trend(basis, misclosure, total)
    correlation_time = RATIO * _interval(trajectory, gps_time)
    sources = c0 * np.einsum("nij,ni->nj", partials, weights)  # C0 B^T V^-1 (l - A y)
    signal = _decaying_sums(gps_time, sources, trajectory.gps_time, correlation_time)  # Eq. 15
    signal[:, :3] += _basis_at(trajectory, observations, order) @ trend
    found = {"correlation_time": correlation_time, "c0": c0.tolist()}
    return _correction(trajectory, signal[:, :3], signal[:, 3:]), found


def _basis(gps_time, order):
    """Legendre polynomials (n, order + 1) on the control span, where they are well conditioned."""
    epochs = len(_epochs(gps_time))
    if epochs <= order + 1:
        raise Undetermined(
            f"A polynomial of order {order} needs control points at {order + 2} epochs at least "
            f"(section 2.4.2 of the paper); here are {epochs}, {SAME_EPOCH:.0f} s or more apart."
        )
    return _legendre(gps_time, gps_time, order)


def _epochs(gps_time):
    """Control epochs: the times in order, without those within a second of the one before."""
    kept = []
    for time in np.sort(gps_time):
        if not kept or time - kept[-1] > SAME_EPOCH:
            kept.append(time)
    return np.array(kept)


def _basis_at(trajectory, observations, order):
    return _legendre(trajectory.gps_time, observations.gps_time, order)


def _legendre(gps_time, control_time, order):
    first, last = control_time.min(), control_time.max()
    argument = (gps_time - (first + last) / 2) / ((last - first) / 2)
    return np.polynomial.legendre.legvander(argument, order)


def _misclosures(observations, control):
    """Misclosures (n, 3) in m and D_omega (n, 3, 3) in m^2  (Eq. 19)."""
    rows = [control.name.index(name) for name in observations.name]
    noise = observations.covariance + control.sigma[rows][:, :, None] ** 2 * np.eye(3)
    return control.position[rows] - observations.position, noise


def _solve_trend(basis, misclosure, covariance):
    """Coefficients (order + 1, 3) by Eq. 13, and V^-1 (l - A y) (n, 3); V is block diagonal."""
    terms = basis.shape[1]
    design = np.einsum("ni,jk->njik", basis, np.eye(3)).reshape(-1, 3 * terms)
    half = np.linalg.inv(np.linalg.cholesky(covariance))  # whitens each observation's three rows
    whitened = np.einsum("nij,njk->nik", half, design.reshape(-1, 3, 3 * terms))
    wanted = np.einsum("nij,nj->ni", half, misclosure)
    flat = whitened.reshape(-1, 3 * terms)
    trend = np.linalg.lstsq(flat, wanted.ravel(), rcond=None)[0].reshape(terms, 3)
    residual = misclosure - basis @ trend
    return trend, np.linalg.solve(covariance, residual[:, :, None])[:, :, 0]


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


def _decaying_sums(gps_time, sources, epochs, correlation_time):
    """Sums (q, k) over sources (n, k) of source * exp(-|lag| / correlation time)  (Eq. 20).

    The exponential forgets as it goes, so one sweep each way does what q times n terms would.
    """
    order = np.argsort(gps_time, kind="stable")
    past = _sweep(gps_time[order], sources[order], epochs, correlation_time, "right")
    back = order[::-1]
    future = _sweep(-gps_time[back], sources[back], -epochs[::-1], correlation_time, "left")
    return past + future[::-1]


def _sweep(gps_time, sources, epochs, correlation_time, side):
    """The part of the sources up to each epoch; side says whether one at it counts."""
    sums = np.zeros((len(gps_time) + 1, sources.shape[1]))
    fade = np.exp(-np.diff(gps_time, prepend=gps_time[0]) / correlation_time)
    for i, source in enumerate(sources):
        sums[i + 1] = sums[i] * fade[i] + source
    last = np.searchsorted(gps_time, epochs, side=side)
    age = epochs - gps_time[np.maximum(last - 1, 0)]
    return sums[last] * np.exp(-np.maximum(age, 0.0) / correlation_time)[:, None]


def _correction(trajectory, shift, turn=None):
    """The corrected trajectory, as a Correction: shift (n, 3) in m, turn (n, 3) in rad."""
    attitude = trajectory.attitude
    if turn is not None:
        attitude = Rotation.from_rotvec(turn) * attitude
    corrected = Trajectory(trajectory.gps_time, trajectory.position + shift, attitude)
    return Correction(trajectory, corrected)
