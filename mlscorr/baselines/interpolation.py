"""Corrections that vary with time, without a model of the POS.

As used in practice: straight lines or monotone cubics between control points, the same within each
segment between re-acquisitions, and a Gaussian process with a stationary covariance. As in the
paper: polynomials (LS-n), and LSC-n as printed.
"""

import warnings
from collections.abc import Callable

import numpy as np
from scipy.interpolate import PchipInterpolator

from mlscorr.baselines._settings import SETTINGS
from mlscorr.baselines.pairs import Undetermined
from mlscorr.collocation import CHUNK, LiteralSignal, Noise, collocate_literal, polynomial_design
from mlscorr.correction import Correction
from mlscorr.frames import pose_partials
from mlscorr.pos import PosErrors, drift_history
from mlscorr.survey import SAME_EPOCH, Matched, Pos, Trajectory, control_epochs

Curve = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


def fit_linear(trajectory: Trajectory, matched: Matched, cut: bool = False) -> Correction:
    """Fit straight lines between control epochs, and constants before the first and after the last.

    Parameters
    ----------
    trajectory : Trajectory
        Recorded trajectory.
    matched : Matched
        Observed control points.
    cut : bool
        True for separate lines in each segment between steps of the path.

    Raises
    ------
    Undetermined
        If there are no control points.
    """
    return _fit(trajectory, matched, _linear, cut)


def fit_pchip(trajectory: Trajectory, matched: Matched) -> Correction:
    """Fit monotone cubics between control epochs (Fritsch and Butland 1984), constants outside.

    Parameters
    ----------
    trajectory : Trajectory
        Recorded trajectory.
    matched : Matched
        Observed control points.

    Raises
    ------
    Undetermined
        If there are no control points.
    """
    return _fit(trajectory, matched, _pchip, cut=False)


def _fit(trajectory, matched, curve: Curve, cut):
    """Position error of each segment, from a curve through its control epochs."""
    epochs, misclosure = _by_epoch(matched)
    if cut:
        restarts = drift_history(trajectory).steps.middle
    else:
        restarts = np.empty(0)
    of_epoch = np.searchsorted(restarts, epochs)
    of_time = np.searchsorted(restarts, trajectory.gps_time)
    error = curve(epochs, misclosure, trajectory.gps_time)  # for segments without control
    for segment in np.unique(of_epoch):
        inside = of_epoch == segment
        rows = of_time == segment
        error[rows] = curve(epochs[inside], misclosure[inside], trajectory.gps_time[rows])
    return _correction(trajectory, error)


def _by_epoch(matched):
    """Control epochs (k,), and the mean misclosure (k, 3) of the targets observed at each."""
    if len(matched) == 0:
        raise Undetermined("No control point was found in the cloud to interpolate between.")
    starts = control_epochs(matched.gps_time)
    number = np.searchsorted(starts, matched.gps_time, side="right") - 1
    count = np.bincount(number)
    times = np.bincount(number, matched.gps_time - starts[0]) / count + starts[0]
    sums = [np.bincount(number, values) for values in matched.misclosure.T]
    return times, np.column_stack(sums) / count[:, None]


def _linear(epochs, misclosure, gps_time):
    return np.column_stack([np.interp(gps_time, epochs, values) for values in misclosure.T])


def _pchip(epochs, misclosure, gps_time):
    if len(epochs) < 2:
        return _linear(epochs, misclosure, gps_time)
    return PchipInterpolator(epochs, misclosure)(np.clip(gps_time, epochs[0], epochs[-1]))


def _correction(trajectory, error):
    """Correction of the trajectory by minus a position error (n, 3)."""
    return Correction.by_pose_error(trajectory, np.hstack([error, np.zeros_like(error)]))


def fit_gaussian_process(trajectory: Trajectory, matched: Matched) -> Correction:
    """Fit scikit-learn's Gaussian process per axis: Matern 3/2 and white noise, by likelihood.

    Parameters
    ----------
    trajectory : Trajectory
        Recorded trajectory.
    matched : Matched
        Observed control points.

    Raises
    ------
    Undetermined
        If control points have fewer than 3 epochs.
    """
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

    epochs, misclosure = _by_epoch(matched)
    if len(epochs) < 3:
        raise Undetermined(
            "A Gaussian process needs control points at 3 or more epochs to estimate scale, "
            f"correlation time and noise; there are {len(epochs)}, {SAME_EPOCH:.0f} s or more "
            "apart."
        )
    span = float(np.ptp(epochs))
    first = epochs[0]
    error = np.zeros((len(trajectory), 3))
    for axis, values in enumerate(misclosure.T):
        size = max(float(np.var(values)), 1e-6)  # m^2; a millimeter if all are equal
        kernel = ConstantKernel(size, (1e-4 * size, 1e4 * size)) * Matern(
            span / len(epochs), (span / 1e3, 1e2 * span), nu=1.5
        ) + WhiteKernel(0.01 * size, (1e-6 * size, 1e2 * size))
        process = GaussianProcessRegressor(kernel, random_state=0)
        mean = values.mean()
        with warnings.catch_warnings(action="ignore", category=ConvergenceWarning):
            process.fit((epochs - first)[:, None], values - mean)
        error[:, axis] = mean + process.predict((trajectory.gps_time - first)[:, None])
    return _correction(trajectory, error)


def fit_polynomial(trajectory: Trajectory, matched: Matched, order: int) -> Correction:
    """Fit LS-n: a polynomial of time per axis as position error, and no signal  (Eq. 11).

    Outside the control span the polynomial is extrapolated, as in the paper.

    Parameters
    ----------
    trajectory : Trajectory
        Recorded trajectory.
    matched : Matched
        Observed control points.
    order : int

    Raises
    ------
    Undetermined
        If there are not more than order + 1 control epochs.
    """
    solved = _solve(matched, order, [])
    return Correction.by_pose_error(trajectory, _predict(solved, trajectory, matched, order))


def fit_literal(
    trajectory: Trajectory, matched: Matched, pos: Pos, order: int
) -> tuple[Correction, dict[str, object]]:
    """Fit LSC-n as printed: Eq. 13-15, a diagonal D_Lambda, C0 as a gain of the signal.

    D_Lambda contains the variances that the POS states (section 2.5), C0 has the same value (the
    initial value of section 3.1.3), and the correlation time is four times the control interval
    (section 3.1.4). A single C0 requires a nearly constant variance, so the mean over the control
    epochs is used; otherwise the gain, C0 over variance, would reach hundreds. The paper then tuned
    both on its check points; here nothing is tuned.

    Parameters
    ----------
    trajectory, matched, order
        See ``fit_polynomial``.
    pos : Pos
        Assumed accuracy, used if the trajectory has no sigmas.

    Returns
    -------
    Correction
    dict
        ``correlation_time`` in s, and ``c0``: six variances, m^2 and rad^2.

    Raises
    ------
    Undetermined
        If there are not more than order + 1 control epochs.
    """
    gps_time = matched.gps_time
    _require_epochs(gps_time, order)
    stated = PosErrors.stated(trajectory, pos).at(gps_time)
    turns = np.einsum("nij,nij->ni", stated.attitude, stated.attitude)  # about the map's axes
    c0 = np.append(np.mean(stated.position**2, axis=0), turns.mean(axis=0))
    partials = pose_partials(trajectory, matched.observations.position, gps_time)  # B
    correlation_time = SETTINGS.interval_ratio * trajectory.control_interval(gps_time)
    solved = _solve(matched, order, [LiteralSignal(partials, c0, c0, correlation_time)])
    details = {"correlation_time": correlation_time, "c0": c0.tolist()}
    pose = _predict(solved, trajectory, matched, order)
    return Correction.by_pose_error(trajectory, pose), details


def _solve(matched, order, signals):
    """Literal collocation of the misclosures, or least squares without signals."""
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
            f"A polynomial of order {order} needs control points at {order + 2} or more epochs "
            f"(section 2.4.2 of the paper); there are {count}, {SAME_EPOCH:.0f} s or more apart."
        )
