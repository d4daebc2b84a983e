"""Misclosures carried on in time without a model of the POS, as practitioners do it.

Straight lines or monotone cubics between control points, the same within each stretch between the
fall-backs of the POS, and a Gaussian process with a stationary covariance.
"""

import warnings
from collections.abc import Callable

import numpy as np
from scipy.interpolate import PchipInterpolator

from mlscorr.baselines.pairs import Undetermined
from mlscorr.correction import Correction
from mlscorr.pos import drift_history
from mlscorr.survey import SAME_EPOCH, Matched, Trajectory, control_epochs

Curve = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


def fit_linear(trajectory: Trajectory, matched: Matched, cut: bool = False) -> Correction:
    """Straight lines between control epochs, and constants beyond the first and the last one.

    Parameters
    ----------
    trajectory : Trajectory
        As recorded.
    matched : Matched
        Observed control points.
    cut : bool
        Whether each stretch between steps of the path has lines of its own.

    Raises
    ------
    Undetermined
        Without any control point.
    """
    return _fit(trajectory, matched, _linear, cut)


def fit_pchip(trajectory: Trajectory, matched: Matched) -> Correction:
    """Monotone cubics between control epochs (Fritsch and Butland 1984), constants beyond them.

    Parameters
    ----------
    trajectory : Trajectory
        As recorded.
    matched : Matched
        Observed control points.

    Raises
    ------
    Undetermined
        Without any control point.
    """
    return _fit(trajectory, matched, _pchip, cut=False)


def fit_gaussian_process(trajectory: Trajectory, matched: Matched) -> Correction:
    """scikit-learn's Gaussian process per axis: Matern 3/2 and white noise, by likelihood.

    Parameters
    ----------
    trajectory : Trajectory
        As recorded.
    matched : Matched
        Observed control points.

    Raises
    ------
    Undetermined
        For control points at fewer than 3 epochs.
    """
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

    epochs, misclosure = _by_epoch(matched)
    if len(epochs) < 3:
        raise Undetermined(
            "Scale, correlation time and noise of a Gaussian process need control points at 3 "
            f"epochs at least; here are {len(epochs)}, {SAME_EPOCH:.0f} s or more apart."
        )
    span = float(np.ptp(epochs))
    first = epochs[0]
    error = np.zeros((len(trajectory), 3))
    for axis, values in enumerate(misclosure.T):
        size = max(float(np.var(values)), 1e-6)  # m^2; a millimetre where all are the same
        kernel = ConstantKernel(size, (1e-4 * size, 1e4 * size)) * Matern(
            span / len(epochs), (span / 1e3, 1e2 * span), nu=1.5
        ) + WhiteKernel(0.01 * size, (1e-6 * size, 1e2 * size))
        process = GaussianProcessRegressor(kernel, random_state=0)
        mean = values.mean()
        with warnings.catch_warnings(action="ignore", category=ConvergenceWarning):
            process.fit((epochs - first)[:, None], values - mean)
        error[:, axis] = mean + process.predict((trajectory.gps_time - first)[:, None])
    return _correction(trajectory, error)


def _fit(trajectory, matched, curve: Curve, cut):
    """The position error of each stretch by a curve through its control epochs."""
    epochs, misclosure = _by_epoch(matched)
    if cut:
        restarts = drift_history(trajectory).steps.middle
    else:
        restarts = np.empty(0)
    of_epoch = np.searchsorted(restarts, epochs)
    of_time = np.searchsorted(restarts, trajectory.gps_time)
    error = curve(epochs, misclosure, trajectory.gps_time)  # for stretches without control
    for stretch in np.unique(of_epoch):
        inside = of_epoch == stretch
        rows = of_time == stretch
        error[rows] = curve(epochs[inside], misclosure[inside], trajectory.gps_time[rows])
    return _correction(trajectory, error)


def _by_epoch(matched):
    """Control epochs (k,), and the mean misclosure (k, 3) of the targets seen at each."""
    if len(matched) == 0:
        raise Undetermined("There is no control point in the cloud to interpolate between.")
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
    """The trajectory less a position error (n, 3), as a Correction."""
    return Correction.by_pose_error(trajectory, np.hstack([error, np.zeros_like(error)]))
