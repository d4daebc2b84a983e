"""Hypotheses of who is who, followed along the drive with a Kalman filter each.

A hypothesis names a control point, or none, for each observation so far; its weight is its
probability density, and its state what the named ones say of the misclosure. Unlikely hypotheses
are dropped, and those that differ only long ago are merged (multiple hypothesis tracking, Reid
1979).
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from mlscorr.matching._beliefs import Chain, transition
from mlscorr.matching.settings import COMPILED, INNER


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


@njit(inline="always", error_model="numpy")
def _empty(b, window, h):
    """B hypotheses to be filled in, with histories of h pairs."""
    belief = np.empty(b, np.int64)
    weight = np.empty(b)
    mean = np.empty((b, 3, 3))
    covariance = np.empty((b, 3, 3, 3))
    used = np.empty((b, len(window)), np.int64)
    history = np.empty((b, h), np.int64)
    return Hypotheses(belief, weight, mean, covariance, used, window, history)


@njit(**COMPILED)
def select(now: Hypotheses, rows: np.ndarray, kept: int, w: int) -> Hypotheses:
    """Some of the hypotheses.

    Parameters
    ----------
    now : Hypotheses
    rows : (r,) int array
    kept, w : int
        So many observations, the last ones, stay in the window of w; others are to be filled in.
    """
    old = len(now.window) - kept
    h = now.history.shape[1]
    after = _empty(len(rows), np.empty(w, np.int64), h)
    for column in range(kept):
        after.window[column] = now.window[old + column]
    for hypothesis, row in enumerate(rows):
        after.belief[hypothesis] = now.belief[row]
        after.weight[hypothesis] = now.weight[row]
        for axis in range(3):
            for i in range(3):
                after.mean[hypothesis, axis, i] = now.mean[row, axis, i]
                for j in range(3):
                    after.covariance[hypothesis, axis, i, j] = now.covariance[row, axis, i, j]
        for column in range(kept):
            after.used[hypothesis, column] = now.used[row, old + column]
        for column in range(h):
            after.history[hypothesis, column] = now.history[row, column]
    return after


@njit(**COMPILED)
def start(chain: Chain) -> Hypotheses:
    """One hypothesis of each belief, before any observation.

    Parameters
    ----------
    chain : Chain
    """
    now = _empty(len(chain.rate), np.empty(0, np.int64), chain.settings.merging_matches)
    for belief in range(len(chain.rate)):
        now.belief[belief] = belief
        now.weight[belief] = 0.0
        for axis in range(3):
            for i in range(3):
                now.mean[belief, axis, i] = 0.0
                for j in range(3):
                    now.covariance[belief, axis, i, j] = 1.0 if i == j else 0.0
        for column in range(chain.settings.merging_matches):
            now.history[belief, column] = -1
    return now


@njit(**COMPILED)
def predict(now: Hypotheses, chain: Chain, last: int, row: int) -> Hypotheses:
    """The hypotheses at the next observation: the drift went on, or started anew in any belief.

    Parameters
    ----------
    now : Hypotheses
        After the last observation, the heaviest first.
    chain : Chain
    last, row : int
        Rows of the last observation and the next one, later or earlier.
    """
    time = chain.gps_time
    settings = chain.settings
    gap = abs(time[row] - time[last]) / settings.restart_time
    stays = np.exp(-max(gap, np.exp(settings.least_log_weight)))
    b = len(now.weight)
    m = len(chain.rate)
    parent = np.empty(b + min(b, settings.joined_hypotheses // 4) * m, np.int64)
    for hypothesis in range(len(parent)):
        parent[hypothesis] = hypothesis if hypothesis < b else (hypothesis - b) // m
    kept = len(now.window)
    while kept > 0 and abs(time[now.window[-kept]] - time[row]) > settings.visit_gap:
        kept -= 1
    after = select(now, parent, kept, kept)
    matrix = transition(chain, last, row)
    for hypothesis in range(len(parent)):
        if hypothesis < b:
            after.weight[hypothesis] += np.log(stays)
            _carry(matrix[after.belief[hypothesis]], after, hypothesis)
        else:
            after.belief[hypothesis] = (hypothesis - b) % m
            after.weight[hypothesis] += np.log((1.0 - stays) / m)
            for column in range(settings.merging_matches):
                after.history[hypothesis, column] = -2  # as of no other hypothesis
            _carry(matrix[m], after, hypothesis)
    return after


@njit(**INNER)
def _carry(f, now, hypothesis):
    """Kalman prediction, in place: x = F x, P = I + F (P - I) F^T per axis."""
    half = np.empty((3, 3))  # F (P - I)
    for axis in range(3):
        x = now.mean[hypothesis, axis]
        p = now.covariance[hypothesis, axis]
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


@njit(**COMPILED)
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
    pairs = chain.pairs
    exchanged = chain.settings.exchanged_share
    first = pairs.first[row]
    k = pairs.first[row + 1] - pairs.first[row]
    density = np.full((len(now.weight), 2 * k + 1), -np.inf)
    value, variance = displacement(now, chain, row)
    square = np.empty(3)
    spread = np.empty(3)
    for hypothesis in range(len(now.weight)):
        density[hypothesis, 2 * k] = now.weight[hypothesis] + chain.otherwise[row]
        for choice in range(k):
            pair = first + choice
            if _in_use(now, hypothesis, chain, row, pair):
                continue
            for axis in range(3):
                spread[axis] = variance[hypothesis, axis] + chain.pair_variance[pair, axis]
                square[axis] = (pairs.misclosure[pair, axis] - value[hypothesis, axis]) ** 2
            moved = chain.moved_share[pair]
            same = pairs.same[pair]
            share = (1.0 - moved) * (1.0 - exchanged) if same else exchanged
            normal = _log_normal(square, spread, 0.0)
            density[hypothesis, choice] = now.weight[hypothesis] + normal + np.log(share)
            if same:
                normal = _log_normal(square, spread, chain.settings.moved_sigma**2)
                density[hypothesis, k + choice] = now.weight[hypothesis] + normal + np.log(moved)
    return density


@njit(**COMPILED)
def displacement(now: Hypotheses, chain: Chain, row: int) -> tuple[np.ndarray, np.ndarray]:
    """Misclosure (b, 3) by the states, and its variance without survey's. Units: m, m^2.

    Parameters
    ----------
    now : Hypotheses
    chain : Chain
    row : int
    """
    b = len(now.weight)
    sigma = chain.settings.constant_sigma
    value = np.empty((b, 3))
    variance = np.empty((b, 3))
    for hypothesis in range(b):
        belief = now.belief[hypothesis]
        for axis in range(3):
            gain = chain.gain[belief, row, axis]
            noise = chain.noise[belief, row, axis]
            x = now.mean[hypothesis, axis]
            p = now.covariance[hypothesis, axis]
            value[hypothesis, axis] = sigma * x[0] + gain * x[1]
            state = sigma**2 * p[0, 0] + 2.0 * sigma * gain * p[0, 1] + gain**2 * p[1, 1]
            variance[hypothesis, axis] = state + noise
    return value, variance


@njit(inline="always", error_model="numpy")
def _in_use(now, hypothesis, chain, row, pair):
    """Whether the pair names a point that the hypothesis uses already in this pass."""
    in_use = False
    for column, other in enumerate(now.window):
        if now.used[hypothesis, column] == chain.pairs.control[pair]:
            in_use = in_use or chain.pass_number[other] == chain.pass_number[row]
    return in_use


@njit(inline="always", error_model="numpy")
def _log_normal(square, variance, extra):
    total = 0.0
    size = 1.0
    for axis in range(3):
        total += square[axis] / (variance[axis] + extra)
        size *= 2.0 * np.pi * (variance[axis] + extra)
    return -0.5 * (total + np.log(size))
