"""Hypotheses of who is who, followed along the drive with a Kalman filter each.

A hypothesis names a control point, or none, for each observation so far; its weight is its
probability density, and its state what the named ones say of the misclosure. Unlikely hypotheses
are dropped, and those that differ only long ago are merged (multiple hypothesis tracking, Reid
1979).
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from mlscorr.matching.beliefs import Chain, transition


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


@njit(cache=True, nogil=True)
def select(now: Hypotheses, rows: np.ndarray) -> Hypotheses:
    """Some of the hypotheses.

    Parameters
    ----------
    now : Hypotheses
    rows : (r,) int array
    """
    mean, covariance, used = now.mean[rows], now.covariance[rows], now.used[rows]
    return Hypotheses(
        now.belief[rows], now.weight[rows], mean, covariance, used, now.window, now.history[rows]
    )


@njit(cache=True, nogil=True)
def start(chain: Chain) -> Hypotheses:
    """One hypothesis of each belief, before any observation.

    Parameters
    ----------
    chain : Chain
    """
    m = len(chain.rate)
    covariance = np.zeros((m, 3, 3, 3)) + np.eye(3)
    belief, weight, mean = np.arange(m), np.zeros(m), np.zeros((m, 3, 3))
    used, window = np.empty((m, 0), np.int64), np.empty(0, np.int64)
    history = np.full((m, chain.settings.memory), -1)
    return Hypotheses(belief, weight, mean, covariance, used, window, history)


@njit(cache=True, nogil=True)
def predict(now: Hypotheses, chain: Chain, last: int, row: int) -> Hypotheses:
    """The hypotheses at the next observation: the drift went on, or started anew in any belief.

    Parameters
    ----------
    now : Hypotheses
        After the last observation.
    chain : Chain
    last, row : int
        Rows of the last observation and the next one, later or earlier.
    """
    time = abs(chain.gps_time[row] - chain.gps_time[last]) / chain.settings.restart_time
    stays = np.exp(-max(time, np.exp(chain.settings.smallest_weight)))
    best = np.argsort(-now.weight, kind="mergesort")[: chain.settings.joined_hypotheses // 4]
    b, m = len(now.weight), len(chain.rate)
    after = select(now, np.append(np.arange(b), np.repeat(best, m)))
    after.weight[:b] += np.log(stays)
    after.weight[b:] += np.log((1.0 - stays) / m)
    after.history[b:] = -2  # as of no other hypothesis
    matrix = transition(chain, last, row)
    for hypothesis in range(len(after.weight)):
        _carry(matrix[after.belief[hypothesis] if hypothesis < b else m], after, hypothesis)
        if hypothesis >= b:
            after.belief[hypothesis] = (hypothesis - b) % m
    recent = np.abs(chain.gps_time[now.window] - chain.gps_time[row]) <= chain.settings.pause
    kept = np.flatnonzero(recent)
    mean, covariance, used = after.mean, after.covariance, after.used[:, kept]
    window = now.window[kept]
    return Hypotheses(after.belief, after.weight, mean, covariance, used, window, after.history)


@njit(cache=True, nogil=True)
def _carry(f, now, hypothesis):
    """Kalman prediction, in place: x = F x, P = I + F (P - I) F^T per axis."""
    half = np.empty((3, 3))  # F (P - I)
    for axis in range(3):
        x, p = now.mean[hypothesis, axis], now.covariance[hypothesis, axis]
        x[0] *= f[0, 0]
        x[1], x[2] = f[1, 1] * x[1] + f[1, 2] * x[2], f[2, 1] * x[1] + f[2, 2] * x[2]
        for i in range(3):
            p[i, i] -= 1.0
        for i in range(3):
            for j in range(3):
                half[i, j] = f[i, 0] * p[0, j] + f[i, 1] * p[1, j] + f[i, 2] * p[2, j]
        for i in range(3):
            for j in range(3):
                p[i, j] = half[i, 0] * f[j, 0] + half[i, 1] * f[j, 1] + half[i, 2] * f[j, 2]
            p[i, i] += 1.0


@njit(cache=True, nogil=True)
def log_likelihoods(now: Hypotheses, chain: Chain, row: int) -> np.ndarray:
    """Log densities (b, 2 k + 1) of what an observation is, by the misclosures of its k pairs.

    First its being each pair's target, then its being a target whose surveyed point lies elsewhere,
    at last its being none of them. A pair of two appearances may be a target taken down wrong.

    Parameters
    ----------
    now : Hypotheses
    chain : Chain
    row : int
    """
    first, k = chain.pairs.first[row], chain.pairs.first[row + 1] - chain.pairs.first[row]
    density = np.full((len(now.weight), 2 * k + 1), -np.inf)
    density[:, 2 * k] = chain.otherwise[row]
    value, variance = displacement(now, chain, row)
    used, exchanged = in_use(now, chain, row), chain.settings.exchanged_share
    square, spread = np.empty(3), np.empty(3)
    for hypothesis in range(len(now.weight)):
        for choice in range(k):
            if used[hypothesis, choice]:
                continue
            pair = first + choice
            for axis in range(3):
                spread[axis] = variance[hypothesis, axis] + chain.pair_variance[pair, axis]
                square[axis] = (chain.pairs.misclosure[pair, axis] - value[hypothesis, axis]) ** 2
            moved = chain.moved_share[pair]
            same = chain.pairs.same[pair]
            share = (1.0 - moved) * (1.0 - exchanged) if same else exchanged
            density[hypothesis, choice] = _log_normal(square, spread, 0.0) + np.log(share)
            if same:
                elsewhere = _log_normal(square, spread, chain.settings.moved_sigma**2)
                density[hypothesis, k + choice] = elsewhere + np.log(moved)
    return density


@njit(cache=True, nogil=True)
def displacement(now: Hypotheses, chain: Chain, row: int) -> tuple[np.ndarray, np.ndarray]:
    """Misclosure (b, 3) by the states, and its variance without survey's. Units: m, m^2.

    Parameters
    ----------
    now : Hypotheses
    chain : Chain
    row : int
    """
    sigma, p = chain.settings.constant_sigma, now.covariance
    gain, noise = chain.gain[:, row][now.belief], chain.noise[:, row][now.belief]
    value = sigma * now.mean[..., 0] + gain * now.mean[..., 1]
    variance = sigma**2 * p[..., 0, 0] + 2.0 * sigma * gain * p[..., 0, 1]
    return value, variance + gain**2 * p[..., 1, 1] + noise


@njit(cache=True, nogil=True)
def in_use(now: Hypotheses, chain: Chain, row: int) -> np.ndarray:
    """Which pairs of an observation name a point that its hypothesis uses already: (b, k).

    Parameters
    ----------
    now : Hypotheses
    chain : Chain
    row : int
    """
    control = chain.pairs.control[chain.pairs.first[row] : chain.pairs.first[row + 1]]
    used = np.zeros((len(now.weight), len(control)), np.bool_)
    for place, other in enumerate(now.window):
        if chain.pass_number[other] == chain.pass_number[row]:
            used |= control == now.used[:, place].copy().reshape(-1, 1)
    return used


@njit(cache=True, nogil=True)
def _log_normal(square, variance, extra):
    total, size = 0.0, 1.0
    for axis in range(3):
        total += square[axis] / (variance[axis] + extra)
        size *= 2.0 * np.pi * (variance[axis] + extra)
    return -0.5 * (total + np.log(size))
