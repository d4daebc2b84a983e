"""From misclosures to the corrected trajectory."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation
from threadpoolctl import threadpool_limits

from mlscorr.correction.likelihood import choose_parameters
from mlscorr.correction.model import Model, Parameters, pose_signals, stated_sigmas
from mlscorr.correction.outliers import Outlier, find_outlier
from mlscorr.georeference import Correction
from mlscorr.survey import Pos, Trajectory

ORDER = 1  # of the trend: a datum difference and its slow change; the signal carries the rest
NEGLIGIBLE = 1e-3  # probability of a family below which its prediction isn't worth the work
FADED = 3.0  # correlation times after which a signal has practically fallen to zero


@dataclass(frozen=True)
class Estimate:
    """The estimated POS error.

    ``correction`` moves points; ``used`` (n,) says which observations took part; ``left_out``
    (n, 3) are the misclosures that remain at each used one when its target takes no part (m).
    ``parameters`` are the most probable ones, ``alternatives`` those of each covariance family
    with their probabilities, which weight the correction.
    """

    correction: Correction
    order: int
    parameters: Parameters
    alternatives: tuple[tuple[Parameters, float], ...]
    log_likelihood: float
    sigma0: float
    outliers: tuple[Outlier, ...]
    used: np.ndarray
    left_out: np.ndarray
    span: tuple[float, float]
    warnings: tuple[str, ...]


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

    Returns an Estimate. Raises ValueError without any observation.
    """
    if len(observations) == 0:
        raise ValueError(
            "There is no observation of a control point to estimate a correction from."
        )
    pos = Pos() if pos is None else pos
    model = Model.build(trajectory, observations, control, pos)
    used = np.ones(len(observations), dtype=bool)
    outliers = []
    while True:
        kept = model.select(used)
        fitted_order = _affordable_order(order, kept)
        found = choose_parameters(kept, fitted_order)
        outlier = find_outlier(kept, found[0][0], fitted_order)
        if outlier is None:
            break
        outliers.append(outlier)
        used &= model.names != outlier.name
    parameters = found[0][0]
    solved = kept.solve(parameters, fitted_order)
    left_out = np.full((len(observations), 3), np.nan)
    left_out[used] = _leave_targets_out(kept, solved)
    return Estimate(
        correction=_correction(trajectory, *_predict(kept, found, fitted_order, trajectory)),
        order=fitted_order,
        parameters=parameters,
        alternatives=found,
        log_likelihood=solved.log_likelihood,
        sigma0=solved.sigma0,
        outliers=tuple(outliers),
        used=used,
        left_out=left_out,
        span=kept.span,
        warnings=_warnings(kept, order, fitted_order, parameters),
    )


def _affordable_order(order, model):
    """The order that leaves one control epoch more than the trend needs."""
    return max(min(order, len(model.target_rows) - 2, model.epochs - 2), 0)


def _warnings(model, order, fitted_order, parameters):
    """Sentences about what is doubtful: a lowered order, and signals extrapolated in time."""
    sentences = []
    if fitted_order < order:
        sentences.append(
            f"{len(model.target_rows)} control points at {model.epochs} epochs are too few for a "
            f"trend of order {order}, which needs {order + 2}: order {fitted_order} is used."
        )
    first, last = model.span
    ends = model.trajectory.gps_time[[0, -1]]
    for length, where in ((first - ends[0], "before the first"), (ends[1] - last, "past the last")):
        times = length / parameters.drift_time
        if times > 1.0:
            effect = "only the trend applies" if times >= FADED else "it fades to the trend"
            sentences.append(
                f"Signal extrapolated {length:.0f} s {where} control point ({times:.1f} "
                f"correlation times): {effect} there."
            )
    return tuple(sentences)


def _leave_targets_out(model, solved):
    """Misclosures (n, 3) that remain when each target in turn takes no part; NaN where the
    others don't determine the trend."""
    residuals = np.full(model.misclosure.size, np.nan)
    for rows in model.target_rows.values():
        if solved.determined_without(rows):
            residuals[rows] = solved.leave_out(rows)[0]
    return residuals.reshape(-1, 3)


def _predict(model, found, order, trajectory):
    """Pose error (n, 6) at every epoch, trend plus signals (Eq. 15), with covariance (n, 6, 6).

    The families' predictions are averaged with their probabilities: control points alone seldom
    tell which one it is, and their spread is a part of what is not known.
    """
    sigmas = stated_sigmas(trajectory, model.pos, trajectory)
    partials = np.broadcast_to(np.eye(6), (len(trajectory), 6, 6))
    design = np.zeros((len(trajectory), 6, 3 * (order + 1)))
    design[:, :3] = model.design(trajectory.gps_time, order)
    mean, square = 0.0, 0.0
    for parameters, probability in found:
        if probability < NEGLIGIBLE:
            continue
        mixings = [s.mixing for s in pose_signals(sigmas, parameters, partials)]
        solved = model.solve(parameters, order)
        pose, covariance = solved.predict(trajectory.gps_time, design, mixings)
        mean += probability * pose
        square += probability * (covariance + pose[:, :, None] * pose[:, None, :])
    return mean, square - mean[:, :, None] * mean[:, None, :]


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
    return Correction(trajectory, corrected)
