"""From misclosures to the corrected trajectory."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation
from threadpoolctl import threadpool_limits

from mlscorr.correction.guards import Guards, few_warnings, look_at, warnings_of
from mlscorr.correction.inputs import checked
from mlscorr.correction.model import Model, Parameters, pose_signals
from mlscorr.correction.orders import (
    Alternative,
    affordable_order,
    compare_orders,
    leave_targets_out,
)
from mlscorr.correction.outliers import Outlier, TargetTest, screen
from mlscorr.georeference import Correction
from mlscorr.survey import Pos, Trajectory

ORDER = 1  # of the trend: a datum difference and its slow change; the signal carries the rest
NEGLIGIBLE = 1e-3  # weight of parameters below which their prediction isn't worth the work
TINY = 1e-12  # m, rad: in place of the sigma of what the POS claims to know perfectly
GRID = 300  # epochs at which the parameters' spread is worked out; it changes as slowly as sigmas


@dataclass(frozen=True)
class Estimate:
    """The estimated POS error.

    ``correction`` moves points; ``used`` (n,) says which observations took part; ``left_out``
    (n, 3) are the misclosures that remain at each used one when its target takes no part (m).
    ``parameters`` are the most probable ones, ``families`` those of each covariance family with
    their probabilities; the correction is an average over all. ``tests`` are the used targets'
    own; ``model`` holds the used targets' observation equations.
    """

    correction: Correction
    order: int
    parameters: Parameters
    families: tuple[tuple[Parameters, float], ...]
    log_likelihood: float
    sigma0: float
    outliers: tuple[Outlier, ...]
    tests: tuple[TargetTest, ...]
    used: np.ndarray
    left_out: np.ndarray
    span: tuple[float, float]
    guards: Guards
    warnings: tuple[str, ...]
    model: Model

    @cached_property
    def alternatives(self) -> tuple[Alternative, ...]:
        """Other orders of the trend beside the one in use."""
        with threadpool_limits(limits=1, user_api="blas"):
            return compare_orders(self.model, self.order, self.families)


# The matrices are small: on a busy machine threads would wait longer than they work
@threadpool_limits.wrap(limits=1, user_api="blas")
def estimate_correction(trajectory, observations, control, pos=None, order=ORDER):
    """Estimate the POS error from matched targets.

    Parameters
    ----------
    trajectory : Trajectory
        As recorded.
    observations : TargetObservations
        Each with the name of a control point.
    control : ControlPoints
    pos : Pos, optional
        Beliefs, used where the trajectory has no sigmas.
    order : int
        Of the polynomial trend; lowered where there are too few control points.

    Returns an Estimate. Raises ValueError without any observation, and for sigmas that can't be.
    """
    pos = Pos() if pos is None else pos
    stated, notes = checked(trajectory, observations, control, pos, order)
    model = Model.build(stated, observations, control, pos)
    fitted_order = affordable_order(order, model)
    screening = screen(model, fitted_order)
    names = {outlier.name for outlier in screening.outliers}
    kept, used = model.without(names), ~np.isin(model.names, list(names))
    posterior, parameters = screening.posterior, screening.posterior.modes[0][0]
    solved = kept.solve(parameters, fitted_order)
    left_out = np.full((len(observations), 3), np.nan)
    left_out[used] = leave_targets_out(kept, solved)
    correction = _correction(trajectory, *_predict(kept, posterior, fitted_order))
    guards = look_at(kept, solved, parameters, correction.corrected)
    return Estimate(
        correction=correction,
        order=fitted_order,
        parameters=parameters,
        families=posterior.modes,
        log_likelihood=solved.log_likelihood,
        sigma0=solved.sigma0,
        outliers=screening.outliers,
        tests=screening.tests,
        used=used,
        left_out=left_out,
        span=kept.span,
        guards=guards,
        warnings=(
            *notes,
            *few_warnings(kept, order, fitted_order),
            *warnings_of(guards, kept, parameters),
            *screening.warnings,
        ),
        model=kept,
    )


def _predict(model, posterior, order):
    """Pose error (n, 6) at every epoch, trend plus signals (Eq. 15), with covariance (n, 6, 6).

    The most probable parameters predict every epoch. What the average over all parameters makes
    of that, in units of its sigmas, changes slowly and is worked out at fewer epochs: sigmas may
    jump where GNSS comes back, these numbers hardly do.
    """
    trajectory = model.trajectory
    first = posterior.modes[0][0]
    pose, covariance = _predict_at(model, first, order, np.arange(len(trajectory)))
    sigma = np.sqrt(np.maximum(np.einsum("qii->qi", covariance), TINY**2))
    rows = _grid(model)
    mean, square = 0.0, 0.0
    points = [point for point in posterior.points if point[1] > NEGLIGIBLE]
    total = sum(weight for _, weight in points)
    for parameters, weight in points:
        one, its = _predict_at(model, parameters, order, rows)
        mean = mean + weight / total * one
        variance = np.einsum("qii->qi", its)
        square = square + weight / total * (variance + one**2)
    wider = np.sqrt(np.maximum(square - mean**2, 0.0)) / sigma[rows]
    moved = (mean - pose[rows]) / sigma[rows]
    pose += sigma * _between(trajectory.gps_time, rows, moved)
    wider = _between(trajectory.gps_time, rows, wider)
    covariance *= wider[:, :, None] * wider[:, None, :]
    return pose, covariance


def _grid(model):
    """Numbers of even epochs, those before and after gaps, and those nearest to control."""
    trajectory, n = model.trajectory, len(model.trajectory)
    edges = np.searchsorted(trajectory.gps_time, trajectory.gaps.ravel())
    control = np.searchsorted(trajectory.gps_time, model.gps_time)
    even = np.linspace(0, n - 1, min(n, GRID)).round().astype(int)
    return np.unique(np.clip(np.concatenate([even, edges, control]), 0, n - 1))


def _between(gps_time, rows, values):
    """Values (k, 6) at some epochs, linear in time at all of them."""
    found = [np.interp(gps_time, gps_time[rows], column) for column in values.T]
    return np.column_stack(found)


def _predict_at(model, parameters, order, rows):
    """Pose error (k, 6) and covariance (k, 6, 6) at some epochs under given parameters."""
    trajectory = model.trajectory
    partials = np.broadcast_to(np.eye(6), (len(rows), 6, 6))
    sigmas = model.stated.at(rows)
    design = np.zeros((len(rows), 6, 3 * (order + 1)))
    design[:, :3] = model.design(trajectory.gps_time[rows], order)
    mixings = [s.mixing for s in pose_signals(sigmas, parameters, partials)]
    solved = model.solve(parameters, order)
    return solved.predict(trajectory.gps_time[rows], design, mixings)


def _correction(trajectory, pose, covariance):
    """The corrected trajectory, with its sigmas, as a Correction."""
    variance = np.maximum(np.einsum("qii->qi", covariance), 0.0)
    to_body = trajectory.attitude.inv().as_matrix()
    about_body = np.einsum("qij,qjk,qik->qi", to_body, covariance[:, 3:, 3:], to_body)
    corrected = Trajectory(
        gps_time=trajectory.gps_time,
        position=trajectory.position + pose[:, :3],
        attitude=Rotation.from_rotvec(pose[:, 3:]) * trajectory.attitude,
        position_sigma=np.sqrt(variance[:, :3]),
        attitude_sigma=np.sqrt(np.maximum(about_body[:, [1, 0, 2]], 0.0)),
    )
    return Correction(trajectory, corrected, covariance=covariance)
