"""Association hypotheses along the drive, each with a Kalman filter.

A hypothesis assigns a control point, or none, to each observation so far. Its weight is its
probability density, and its state the estimate of the misclosure from the assigned ones. Unlikely
hypotheses are dropped, and those that differ only in older observations are merged (multiple
hypothesis tracking, Reid 1979).
"""

from typing import NamedTuple

import numpy as np

from mlscorr.matching._beliefs import Chain, transition
from mlscorr.matching.settings import SETTINGS


class Hypotheses(NamedTuple):
    """Set of b hypotheses under several models at one observation, before it is used.

    Parameters
    ----------
    belief : (b,) int array
    weight : (b,) array
        Logarithms.
    mean : (b, 3, 3) array
        Of c, s and its rate (last axis) for each map axis, in units of their prior sigmas.
    covariance : (b, 3, 3, 3) array
        Of these, for each map axis.
    used : (b, w) int array
        Control points of the observations in ``window`` (w,), the last two seconds; -1 for none.
    history : (b, h) int array
        Last pairs of each hypothesis.
    """

    belief: np.ndarray
    weight: np.ndarray
    mean: np.ndarray
    covariance: np.ndarray
    used: np.ndarray
    window: np.ndarray
    history: np.ndarray


def start(chain: Chain) -> Hypotheses:
    """Make one hypothesis for each model, before any observation.

    Parameters
    ----------
    chain : Chain
    """
    count = len(chain.rate)
    return Hypotheses(
        belief=np.arange(count),
        weight=np.zeros(count),
        mean=np.zeros((count, 3, 3)),
        covariance=np.tile(np.eye(3), (count, 3, 1, 1)),
        used=np.empty((count, 0), dtype=int),
        window=np.empty(0, dtype=int),
        history=np.full((count, SETTINGS.merging_matches), -1),
    )


def select(now: Hypotheses, rows: np.ndarray, kept: int, w: int) -> Hypotheses:
    """Copy some of the hypotheses.

    Parameters
    ----------
    now : Hypotheses
    rows : (r,) int array
    kept, w : int
        Number of last observations that remain in the window of w; the others are filled later.
    """
    old = len(now.window) - kept
    window = np.empty(w, dtype=int)
    window[:kept] = now.window[old:]
    used = np.empty((len(rows), w), dtype=int)
    used[:, :kept] = now.used[rows, old:]
    return Hypotheses(
        now.belief[rows],
        now.weight[rows],
        now.mean[rows],
        now.covariance[rows],
        used,
        window,
        now.history[rows],
    )


def predict(now: Hypotheses, chain: Chain, last: int, row: int) -> Hypotheses:
    """Predict hypotheses at the next observation: the drift continues, or restarts in any model.

    Kalman prediction x = F x, P = I + F (P - I) F^T per axis.

    Parameters
    ----------
    now : Hypotheses
        After the last observation, sorted by decreasing weight.
    chain : Chain
    last, row : int
        Rows of the last observation and the next one, later or earlier.
    """
    time = chain.gps_time
    gap = abs(time[row] - time[last]) / SETTINGS.restart_time
    stays = np.exp(-max(gap, np.exp(SETTINGS.least_log_weight)))
    b = len(now.weight)
    m = len(chain.rate)
    renewed = min(b, SETTINGS.joined_hypotheses // 4)
    parent = np.concatenate([np.arange(b), np.repeat(np.arange(renewed), m)])
    kept = len(now.window)
    while kept > 0 and abs(time[now.window[-kept]] - time[row]) > SETTINGS.visit_gap:
        kept -= 1
    after = select(now, parent, kept, kept)
    after.weight[:b] += np.log(stays)
    after.weight[b:] += np.log((1.0 - stays) / m)
    matrix = transition(chain, last, row)
    f = matrix[np.concatenate([after.belief[:b], np.full(renewed * m, m)])][:, None]
    after.belief[b:] = np.tile(np.arange(m), renewed)
    after.history[b:] = -2  # matches no other hypothesis
    after.mean[:] = (f @ after.mean[..., None])[..., 0]
    after.covariance[:] = f @ (after.covariance - np.eye(3)) @ f.swapaxes(2, 3) + np.eye(3)
    return after


def log_likelihoods(now: Hypotheses, chain: Chain, row: int) -> np.ndarray:
    """Log densities (b, 2 k + 1) of an observation's identities, from misclosures of its k pairs.

    The order is: each pair's target; each pair's target with its surveyed point elsewhere; none of
    them. A pair with different kind or size may be a target that was recorded incorrectly.

    Parameters
    ----------
    now : Hypotheses
        Their weights are included in the densities.
    chain : Chain
    row : int
    """
    pairs = chain.pairs.of(row)
    same = chain.pairs.same[pairs]
    moved = chain.moved_share[pairs]
    value, variance = displacement(now, chain, row)
    square = (chain.pairs.misclosure[pairs] - value[:, None]) ** 2
    spread = variance[:, None] + chain.pair_variance[pairs]
    exchanged = SETTINGS.exchanged_share
    share = np.where(same, (1.0 - moved) * (1.0 - exchanged), exchanged)
    with np.errstate(divide="ignore"):  # a share may be zero
        sound = _log_normal(square, spread) + np.log(share)
        elsewhere = _log_normal(square, spread + SETTINGS.moved_sigma**2)
        elsewhere += np.log(np.where(same, moved, 0.0))
    none = np.full((len(now.weight), 1), chain.otherwise[row])
    in_use = _in_use(now, chain, row, chain.pairs.control[pairs])
    sound[in_use] = -np.inf
    elsewhere[in_use] = -np.inf
    return now.weight[:, None] + np.concatenate([sound, elsewhere, none], axis=1)


def displacement(now: Hypotheses, chain: Chain, row: int) -> tuple[np.ndarray, np.ndarray]:
    """Misclosure (b, 3) from the states, and its variance without the survey. Units: m, m^2.

    Parameters
    ----------
    now : Hypotheses
    chain : Chain
    row : int
    """
    sigma = SETTINGS.constant_sigma
    gain = chain.gain[now.belief, row]
    p = now.covariance
    value = sigma * now.mean[..., 0] + gain * now.mean[..., 1]
    state = sigma**2 * p[..., 0, 0] + 2.0 * sigma * gain * p[..., 0, 1] + gain**2 * p[..., 1, 1]
    return value, state + chain.noise[now.belief, row]


def _in_use(now, chain, row, control):
    """Flag (b, k) of points that a hypothesis already uses in this pass."""
    is_same_pass = chain.pass_number[now.window] == chain.pass_number[row]
    return (now.used[:, is_same_pass, None] == control).any(axis=1)


def _log_normal(square, variance):
    """Log density of three independent normal errors, given their squares (..., 3)."""
    total = (square / variance).sum(axis=-1)
    return -0.5 * (total + np.log((2.0 * np.pi * variance).prod(axis=-1)))
