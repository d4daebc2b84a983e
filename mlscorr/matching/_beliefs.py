"""Prior models of the change of misclosures along a drive.

For each map axis, the misclosure of an observation at time t is

    l(t) = c + g(t) s(t) + noise,   g(t)^2 = (k sigma(t))^2 + b^2 + u^2   (pos.Predictive).

c is the effect of datum and mounting, constant except that part of it turns with the vehicle. s is
a smooth process of unit variance (Matern 3/2: position and rate) that restarts where the drift of
the POS does. sigma(t) is the sigma stated by the POS, k its scale error, b a bias, and u a smaller
and rougher unstated error. The noise comprises survey, extraction, the stated attitude over the
range, and the part of g and u that is not smooth. k, b and u are unknown: several prior models
compete, and the observations decide.
"""

from typing import NamedTuple

import numpy as np

from mlscorr.matching._pairs import CandidatePairs
from mlscorr.matching.settings import SETTINGS
from mlscorr.pos import PosErrors
from mlscorr.survey import ControlPoints, TargetObservations, Trajectory


class Chain(NamedTuple):
    """Observations in order of time (n), under m prior models.

    Parameters
    ----------
    gps_time, pass_number : (n,) array
    forward : (n, 2) array
        Unit vector of the vehicle's heading, E and N.
    gain : (m, n, 3) array
        g(t) per axis. Units: m.
    noise : (m, n, 3) array
        Variance per axis, without the control point's. Units: m^2.
    otherwise : (n,) array
        Log density of objects that are not surveyed points (1/m^3), over the odds that a surveyed
        point is visible.
    rate : (m,) array
        sqrt(3) over the correlation time. Units: 1/s.
    segment : (n,) int array
        Drift restarts between two segments.
    pairs : CandidatePairs
    pair_variance : (p, 3) array
        Variance of the control points' positions. Units: m^2.
    moved_share : (p,) array
        Probability that a pair's surveyed point is elsewhere, from information outside the chain.
    """

    gps_time: np.ndarray
    pass_number: np.ndarray
    forward: np.ndarray
    gain: np.ndarray
    noise: np.ndarray
    otherwise: np.ndarray
    rate: np.ndarray
    segment: np.ndarray
    pairs: CandidatePairs
    pair_variance: np.ndarray
    moved_share: np.ndarray


def transition(chain: Chain, start: int, end: int) -> np.ndarray:
    """Transitions F of c, s and its rate from one observation to another, later or earlier.

    All three are divided by their prior sigmas, so their prior covariance is I, and remains I with
    a process noise of I - F F^T.

    Parameters
    ----------
    chain : Chain
    start, end : int
        Rows.

    Returns
    -------
    matrix : (m + 1, 3, 3) array
        One for each model, and last that of a restarting drift.
    """
    turned = 1.0 - chain.forward[start] @ chain.forward[end]
    share = (SETTINGS.turning_sigma / SETTINGS.constant_sigma) ** 2
    matrix = np.zeros((len(chain.rate) + 1, 3, 3))
    matrix[:, 0, 0] = 1.0 - share * turned
    if chain.segment[start] == chain.segment[end]:
        step = chain.rate * (chain.gps_time[end] - chain.gps_time[start])
        decay = np.exp(-abs(step))
        matrix[:-1, 1, 1] = (1.0 + abs(step)) * decay
        matrix[:-1, 1, 2] = step * decay
        matrix[:-1, 2, 1] = -step * decay
        matrix[:-1, 2, 2] = (1.0 - abs(step)) * decay
    return matrix


def build_chain(
    observations: TargetObservations,
    control: ControlPoints,
    pose: Trajectory,
    errors: PosErrors,
    pairs: CandidatePairs,
) -> Chain:
    """Build the chain of observations in order of time.

    Parameters
    ----------
    observations : TargetObservations
    control : ControlPoints
    pose : Trajectory
        Trajectory at the observations.
    errors : PosErrors
        Error model of the drive.
    pairs : CandidatePairs
    """
    distance = np.linalg.norm(observations.position - pose.position, axis=1)
    known = np.einsum("nii->ni", observations.covariance)
    angle = errors.at(observations.gps_time).angles.max(axis=1)
    known = known + ((angle * distance) ** 2)[:, None]
    error = errors.predictive(observations.gps_time)
    ahead = pose.attitude.apply([0.0, 1.0, 0.0])[:, :2]
    odds = (1.0 - SETTINGS.visible_share) / SETTINGS.visible_share
    return Chain(
        gps_time=observations.gps_time,
        pass_number=observations.pass_number,
        forward=ahead / np.maximum(np.linalg.norm(ahead, axis=1, keepdims=True), 1e-12),
        gain=error.sigma,
        noise=known + error.rough_variance,
        otherwise=np.log(_lookalikes(observations, pose) * odds),
        rate=np.sqrt(3.0) / error.correlation_time,
        segment=errors.history.segment(observations.gps_time),
        pairs=pairs,
        pair_variance=control.sigma[pairs.control] ** 2,
        moved_share=np.full(len(pairs.control), SETTINGS.moved_share),
    )


def _lookalikes(observations, pose):
    """Density (n,) of objects with each observation's kind and size. Units: 1/m^3."""
    keys = zip(observations.kind, observations.size.round(2), strict=True)
    appearance = np.array([f"{kind} {size}" for kind, size in keys])
    _, number, count = np.unique(appearance, return_inverse=True, return_counts=True)
    length = 0.0
    for part in np.unique(observations.pass_number):
        steps = np.diff(pose.position[observations.pass_number == part], axis=0)
        length += np.linalg.norm(steps, axis=1).sum()
    return SETTINGS.lookalike_density * count[number] / max(length, SETTINGS.street_length)
