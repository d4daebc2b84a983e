"""Hypotheses of who is who, followed along the drive with a Kalman filter each.

A hypothesis names a control point, or none, for each observation so far; its weight is its
probability density, and its state what the named ones say of the misclosure. Unlikely hypotheses
are dropped, and those that differ only long ago are merged (multiple hypothesis tracking, Reid
1979).
"""

from typing import NamedTuple

import numpy as np

from mlscorr.matching._beliefs import Chain, transition
from mlscorr.matching.settings import SETTINGS


class Hypotheses(NamedTuple):
    """b hypotheses of several beliefs at one observation, before it is used.

    Parameters
    ----------
    belief : (b,) int array
    weight : (b,) array
        Logarithms.
    mean : (b, 3, 3) array
        Of c, s and its rate (last axis) per map axis, over their sigmas before any observation.
    covariance : (b, 3, 3, 3) array
        Of these per map axis.
    used : (b, w) int array
        Control points of the observations in ``window`` (w,), those of the last two seconds; -1
        for none.
    history : (b, h) int array
        The last pairs of the memory.
    """

    belief: np.ndarray
    weight: np.ndarray
    mean: np.ndarray
    covariance: np.ndarray
    used: np.ndarray
    window: np.ndarray
    history: np.ndarray


def start(chain: Chain) -> Hypotheses:
    """One hypothesis of each belief, before any observation.

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
        So many observations, the last ones, stay in the window of w; others are to be filled in.
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
    """The hypotheses at the next observation: the drift went on, or started anew in any belief.

    Kalman prediction x = F x, P = I + F (P - I) F^T per axis.

    Parameters
    ----------
    now : Hypotheses
        After the last observation, the heaviest first.
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
    after.history[b:] = -2  # as of no other hypothesis
    after.mean[:] = (f @ after.mean[..., None])[..., 0]
    after.covariance[:] = f @ (after.covariance - np.eye(3)) @ f.swapaxes(2, 3) + np.eye(3)
    return after


def log_likelihoods(now: Hypotheses, chain: Chain, row: int) -> np.ndarray:
    """Log densities (b, 2 k + 1) of what an observation is, by the misclosures of its k pairs.

    First its being each pair's target, then its being a target whose surveyed point lies elsewhere,
    at last its being none of them. A pair of two appearances may be a target taken down wrong.

    Parameters
    ----------
    now : Hypotheses
        Their weights are a part of the densities.
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
    """Misclosure (b, 3) by the states, and its variance without survey's. Units: m, m^2.

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
    """Points (b, k) that each hypothesis uses already in this pass."""
    is_same_pass = chain.pass_number[now.window] == chain.pass_number[row]
    return (now.used[:, is_same_pass, None] == control).any(axis=1)


def _log_normal(square, variance):
    """Log density of three independent normal errors by their squares (..., 3)."""
    total = (square / variance).sum(axis=-1)
    return -0.5 * (total + np.log((2.0 * np.pi * variance).prod(axis=-1)))
