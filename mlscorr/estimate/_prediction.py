"""Prediction of the POS error at every epoch, and of the corrected trajectory (Eq. 14-15)."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from mlscorr.collocation import Collocation
from mlscorr.estimate.adjustment import Adjustment
from mlscorr.estimate.posterior import Posterior
from mlscorr.estimate.settings import SETTINGS
from mlscorr.pos import SignalParameters, Steps
from mlscorr.survey import Trajectory


@dataclass(frozen=True)
class GridPredictions:
    """POS errors (k, 6) and their variances (k, 6) at some epochs, by parameters.

    Existing Collocations should be added: each costs a solution of all rows.

    Parameters
    ----------
    adjustment : Adjustment
    poses : dict
    mode : SignalParameters, optional
        Parameters of the Collocation that is kept once it is added, until it is taken.
    kept : dict
    """

    adjustment: Adjustment
    poses: dict[SignalParameters, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)
    mode: SignalParameters | None = None
    kept: dict[SignalParameters, Collocation] = field(default_factory=dict)

    @cached_property
    def rows(self) -> np.ndarray:
        """Indices of epochs: regular ones, those around gaps, steps and restarts, and near control.

        Regular in time: sessions may differ in rate.
        """
        trajectory = self.adjustment.trajectory
        n = len(self.adjustment.trajectory)
        history = self.adjustment.errors.history
        starts = history.edges[1:-1]
        steps = np.concatenate([history.steps.before, history.steps.after, starts])
        edges = np.searchsorted(trajectory.gps_time, [*trajectory.gaps.ravel(), *steps])
        control = np.searchsorted(trajectory.gps_time, self.adjustment.observed)
        time = trajectory.gps_time
        begins = np.isin(trajectory.gps_time, trajectory.gaps[:, 1])
        passed = np.cumsum(np.where(begins, 0.0, np.diff(time, prepend=time[0])))
        shares = np.linspace(0.0, passed[-1], min(n, SETTINGS.prediction_epochs))
        regular = np.interp(shares, passed, np.arange(n)).round().astype(int)
        return np.unique(np.clip(np.concatenate([regular, edges, edges - 1, control]), 0, n - 1))

    def add(self, parameters: SignalParameters, solved: Collocation) -> None:
        """Predict under parameters, by their Collocation.

        Parameters
        ----------
        parameters : SignalParameters
        solved : Collocation
        """
        pose, spread = solved.predict(*pose_rows(self.adjustment, parameters, self.rows))
        self.poses[parameters] = pose, np.einsum("qii->qi", spread)
        if parameters == self.mode:
            self.kept[parameters] = solved

    def take(self, parameters: SignalParameters) -> Collocation:
        """Return the Collocation under parameters, which is not kept any longer.

        Parameters
        ----------
        parameters : SignalParameters
        """
        return self.kept.pop(parameters, None) or self.adjustment.solve(parameters)

    def under(self, parameters: SignalParameters) -> tuple[np.ndarray, np.ndarray]:
        """Return the POS errors and variances under parameters.

        Parameters
        ----------
        parameters : SignalParameters
        """
        if parameters not in self.poses:
            self.add(parameters, self.adjustment.solve(parameters))
        return self.poses[parameters]


def predict_pose_error(
    adjustment: Adjustment,
    posterior: Posterior,
    predictions: GridPredictions | None = None,
    solved: Collocation | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """POS error (n, 6) at every epoch, trend plus signals (Eq. 15), with covariance (n, 6, 6).

    Position in m, rotation about the map axes in rad. The most probable parameters predict every
    epoch. The change by averaging over all parameters, in units of its sigmas, varies slowly and is
    computed at fewer epochs: sigmas may jump when GNSS returns, but these numbers hardly do.

    Parameters
    ----------
    adjustment : Adjustment
    posterior : Posterior
    predictions : GridPredictions, optional
        Known ones by these equations.
    solved : Collocation, optional
        Of these equations under the most probable parameters, if it exists already.
    """
    trajectory = adjustment.trajectory
    mode = posterior.modes[0][0]
    solved = solved or adjustment.solve(mode)
    pose, covariance = solved.predict(*pose_rows(adjustment, mode))
    sigma = np.sqrt(np.maximum(np.einsum("qii->qi", covariance), 0.0))
    predictions = predictions or GridPredictions(adjustment)
    rows = predictions.rows
    mean = 0.0
    square = 0.0
    for parameters, weight in posterior.mixture:
        predicted, variance = predictions.under(parameters)
        mean = mean + weight * predicted
        square = square + weight * (variance + predicted**2)
    # an error of zero variance stays zero
    is_open = sigma[rows] > 0.0
    zeros = np.zeros_like(mean)
    spread = np.sqrt(np.maximum(square - mean**2, 0.0))
    wider = np.divide(spread, sigma[rows], out=zeros.copy(), where=is_open)
    moved = np.divide(mean - pose[rows], sigma[rows], out=zeros, where=is_open)
    pose += sigma * _interpolated(trajectory.gps_time, rows, moved)
    wider = _interpolated(trajectory.gps_time, rows, wider)
    covariance *= wider[:, :, None] * wider[:, None, :]
    return bridge_steps(trajectory, adjustment.errors.history.steps, pose, covariance)


def bridge_steps(
    trajectory: Trajectory, steps: Steps, pose: np.ndarray, covariance: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return pose error and covariance with values inside steps replaced by a bridge across them.

    Filters and resampling spread a re-acquisition over epochs at which the error is neither that
    before nor that after it. There the corrected path is a cubic through the corrected positions
    and velocities at both ends (Hermite). The uncertainty of this motion is added to the
    covariance.

    Parameters
    ----------
    trajectory : Trajectory
        As recorded.
    steps : Steps
    pose : (n, 6) array
        Position in m, rotation in rad, at every epoch.
    covariance : (n, 6, 6) array
    """
    time = trajectory.gps_time
    corrected = trajectory.position + pose[:, :3]
    pose = pose.copy()
    covariance = covariance.copy()
    for before, after, sigma in zip(steps.before, steps.after, steps.sigma, strict=True):
        first, last = np.searchsorted(time, [before, after])
        inside = slice(first + 1, last)
        if last - first < 2:
            continue
        ends = [first, last]
        neighbors = np.clip([first - 1, last + 1], 0, len(time) - 1)
        speed = (corrected[ends] - corrected[neighbors]) / (time[ends] - time[neighbors])[:, None]
        path = CubicHermiteSpline(time[ends], corrected[ends], speed)
        pose[inside, :3] = path(time[inside]) - trajectory.position[inside]
        share = ((time[inside] - before) / (after - before))[:, None]
        pose[inside, 3:] = pose[first, 3:] + share * (pose[last, 3:] - pose[first, 3:])
        share = share[:, :, None]
        covariance[inside] = (1.0 - share) * covariance[first] + share * covariance[last]
        covariance[inside, :3, :3] += (4.0 * share * (1.0 - share) * sigma) ** 2 * np.eye(3)
    return pose, covariance


def _interpolated(gps_time, rows, values):
    """Interpolate values (k, 6) at some epochs to all epochs, linearly in time."""
    return np.column_stack([np.interp(gps_time, gps_time[rows], column) for column in values.T])


def predict_under(
    adjustment: Adjustment, parameters: SignalParameters, rows: slice | np.ndarray = slice(None)
) -> tuple[np.ndarray, np.ndarray]:
    """Pose error (k, 6) and covariance (k, 6, 6) at some epochs under given parameters.

    Parameters
    ----------
    adjustment : Adjustment
    parameters : SignalParameters
    rows : slice or (k,) int array
        Of the trajectory's epochs; all by default.
    """
    return adjustment.solve(parameters).predict(*pose_rows(adjustment, parameters, rows))


def pose_rows(
    adjustment: Adjustment, parameters: SignalParameters, rows: slice | np.ndarray = slice(None)
) -> tuple:
    """Input of a Collocation for the pose at some epochs: times, design, mixings, clocks.

    Parameters
    ----------
    adjustment, parameters, rows
        See ``predict_under``.
    """
    gps_time = adjustment.trajectory.gps_time[rows]
    signals = adjustment.errors.pose_signals(parameters, rows)
    mixings = [signal.mixing for signal in signals]
    return gps_time, adjustment.pose_design(gps_time), mixings, [s.clock for s in signals]
