"""Probability of each pair, given all other observations before and after it.

The hypotheses on a drive branch at each observation, from its start and from its end. Those with
the largest weights are kept, and those that later observations cannot separate are merged. Each
side is a set of Kalman filter states. Their product, divided by the common prior, is the prediction
from all other observations (two-filter smoother, Fraser and Potter 1969).
"""

from typing import NamedTuple

import numpy as np

from mlscorr.matching._beliefs import Chain
from mlscorr.matching._hypotheses import (
    Hypotheses,
    displacement,
    log_likelihoods,
    predict,
    select,
    start,
)
from mlscorr.matching.settings import SETTINGS

SHORT_DRIVE = 1000  # observations; hypotheses of so many are kept: some 30 kB each


class Marginals(NamedTuple):
    """Probability of each pair, and prediction of each observation from all others.

    Parameters
    ----------
    sound : (p,) array
        Probability that a pair is right and its surveyed point is at the target.
    moved : (p,) array
        Probability that it is right and the surveyed point is elsewhere.
    expected : (n, 3) array
        Misclosure predicted from the other observations. Units: m.
    sigma : (n, 3) array
        Sigma of the difference from it. Units: m.
    """

    sound: np.ndarray
    moved: np.ndarray
    expected: np.ndarray
    sigma: np.ndarray


def marginals(chain: Chain) -> Marginals:
    """Combine hypotheses from the start of a drive with those from its end.

    Of the forward hypotheses only those at the start of each segment are kept. A segment is
    filtered again when the backward pass reaches it, so memory grows with sqrt(n).

    Parameters
    ----------
    chain : Chain
    """
    n = len(chain.gps_time)
    p = len(chain.pairs.control)
    result = Marginals(np.zeros(p), np.zeros(p), np.zeros((n, 3)), np.zeros((n, 3)))
    if p == 0:
        return result
    length = max(SHORT_DRIVE, int(np.ceil(np.sqrt(n))))
    starts = range(0, n, length)
    begins = [start(chain)]
    for first in starts[:-1]:
        now = begins[-1]
        for row in range(first, first + length):
            now = _pass(now, chain, row, row + 1)
        begins.append(now)
    future = start(chain)
    for first in reversed(starts):
        last = min(first + length, n) - 1
        now = begins.pop()
        past = [heaviest(now)]
        for row in range(first, last):
            now = _pass(now, chain, row, row + 1)
            past.append(heaviest(now))
        for row in range(last, first - 1, -1):
            if row + 1 < n:
                future = _pass(future, chain, row + 1, row)
            _fill(join(past[row - first], heaviest(future), chain), chain, row, result)
    return result


def _pass(now, chain, row, following):
    """Hypotheses before the observation that follows this one, which is used."""
    return predict(use(now, chain, row), chain, row, following)


def _fill(both, chain, row, result):
    """Store the marginals of an observation."""
    if len(both.weight) == 0:
        return  # no common model of past and future: no prediction
    density = _probabilities(log_likelihoods(both, chain, row))
    pairs = chain.pairs.of(row)
    k = density.shape[1] // 2
    result.sound[pairs] = density[:, :k].sum(axis=0)
    result.moved[pairs] = density[:, k : 2 * k].sum(axis=0)
    share = _probabilities(both.weight)
    value, variance = displacement(both, chain, row)
    expected = share @ value
    result.expected[row] = expected
    result.sigma[row] = np.sqrt(share @ (variance + (value - expected) ** 2))


def _probabilities(weight):
    """Probabilities from logarithmic weights."""
    probability = np.exp(weight - weight.max())
    return probability / probability.sum()


def join(before: Hypotheses, after: Hypotheses, chain: Chain) -> Hypotheses:
    """Join pairs (past, future) of hypotheses of one model; their common prior counts once.

    With precisions L and means m, L = L1 + L2 - I and L m = L1 m1 + L2 m2. Both windows are joined;
    the histories are those of the past.

    Parameters
    ----------
    before, after : Hypotheses
        At an observation, from the observations before and after it.
    chain : Chain
    """
    rows, others = np.nonzero(before.belief[:, None] == after.belief)
    w = len(before.window)
    both = select(before, rows, w, w + len(after.window))
    both.window[w:] = after.window
    both.used[:, w:] = after.used[others]
    precision, vector, weight = _information(before)
    later_precision, later_vector, later_weight = _information(after)
    vectors = vector[rows] + later_vector[others]
    inverse, determinant = _inverse(precision[rows] + later_precision[others] - np.eye(3))
    both.covariance[:] = inverse
    both.mean[:] = (inverse @ vectors[..., None])[..., 0]
    both.weight[:] += weight[rows] + after.weight[others] + later_weight[others]
    both.weight[:] += 0.5 * (vectors * both.mean).sum(axis=(1, 2))
    both.weight[:] -= 0.5 * np.log(determinant).sum(axis=1)
    both.weight[_clash(both, w, chain)] += 2.0 * SETTINGS.least_log_weight
    return both


def _information(now):
    """Precisions L, vectors L m and weights (log |L| - m L m) / 2, over all axes."""
    precision, determinant = _inverse(now.covariance)
    vector = (precision @ now.mean[..., None])[..., 0]
    square = (vector * now.mean).sum(axis=(1, 2))
    return precision, vector, -0.5 * (np.log(determinant).sum(axis=1) + square)


def _inverse(matrix):
    """Inverses of symmetric matrices (..., 3, 3) by cofactors, and their determinants."""
    a = matrix[..., 0, 0]
    b = matrix[..., 0, 1]
    c = matrix[..., 0, 2]
    d = matrix[..., 1, 1]
    e = matrix[..., 1, 2]
    f = matrix[..., 2, 2]
    inverse = np.empty_like(matrix)
    inverse[..., 0, 0] = d * f - e * e
    inverse[..., 1, 1] = a * f - c * c
    inverse[..., 2, 2] = a * d - b * b
    inverse[..., 0, 1] = inverse[..., 1, 0] = c * e - b * f
    inverse[..., 0, 2] = inverse[..., 2, 0] = b * e - c * d
    inverse[..., 1, 2] = inverse[..., 2, 1] = b * c - a * e
    determinant = a * inverse[..., 0, 0] + b * inverse[..., 0, 1] + c * inverse[..., 0, 2]
    inverse /= determinant[..., None, None]
    return inverse, determinant


def _clash(both, w, chain):
    """Flag (b,) of pairs that use a control point twice in one visit; the first w are of the
    past.
    """
    past = both.window[:w, None]
    future = both.window[w:]
    is_visit = chain.pass_number[past] == chain.pass_number[future]
    is_visit &= abs(chain.gps_time[past] - chain.gps_time[future]) <= SETTINGS.visit_gap
    control = both.used[:, :w, None]
    return ((control == both.used[:, None, w:]) & (control >= 0) & is_visit).any(axis=(1, 2))


def use(now: Hypotheses, chain: Chain, row: int) -> Hypotheses:
    """Update hypotheses by an observation: each branches into its pairs and none.

    Parameters
    ----------
    now : Hypotheses
        Before the observation.
    chain : Chain
    row : int
        Row of the observation.
    """
    pairs = np.arange(chain.pairs.first[row], chain.pairs.first[row + 1])
    k = len(pairs)
    count = 3 * SETTINGS.joined_hypotheses
    smallest = SETTINGS.least_log_weight
    density = log_likelihoods(now, chain, row)
    weight = density.ravel()
    choices = density.shape[1]
    kept = best_of_each(np.repeat(now.belief, choices), weight, 4 * count, smallest)
    w = len(now.window)
    after = select(now, kept // choices, w, w + 1)
    choice = kept % choices
    pair = np.concatenate([pairs, pairs, [-1]])[choice]
    after.window[w] = row
    after.weight[:] = weight[kept]
    after.used[:, w] = np.append(chain.pairs.control, -1)[pair]
    is_sound = choice < k  # only the sound pairs update the state
    after.history[is_sound, :-1] = after.history[is_sound, 1:]
    after.history[is_sound, -1] = pair[is_sound]
    groups, total = merge(after.belief, after.history, after.used, after.weight)
    best = best_of_each(after.belief[groups], total, count, smallest)
    rows = groups[best]
    after = select(after, rows, w + 1, w + 1)
    after.weight[:] = total[best]
    _update(after, chain, row, pair[rows], choice[rows] >= k)
    return after


def _update(after, chain, row, pair, is_moved):
    """Kalman update, in place, of hypotheses by the pair, or none, that each assigns.

    K = P H^T / S, x = x + K v, P = P - K H P with H = (sigma, g, 0) per axis.
    """
    taken = np.flatnonzero(pair >= 0)
    pair = pair[taken]
    value, variance = displacement(after, chain, row)
    gain = chain.gain[after.belief[taken], row]
    p = after.covariance[taken]
    cross = SETTINGS.constant_sigma * p[..., 0] + gain[..., None] * p[..., 1]  # P H^T
    extra = SETTINGS.moved_sigma**2 * is_moved[taken, None]
    spread = variance[taken] + chain.pair_variance[pair] + extra
    away = chain.pairs.misclosure[pair] - value[taken]
    step = cross / spread[..., None]
    after.mean[taken] += step * away[..., None]
    after.covariance[taken] = p - step[..., :, None] * cross[..., None, :]


def heaviest(now: Hypotheses) -> Hypotheses:
    """Select the hypotheses of each model that are joined with the other side's.

    Parameters
    ----------
    now : Hypotheses
    """
    count = SETTINGS.joined_hypotheses
    rows = best_of_each(now.belief, now.weight, count, SETTINGS.least_log_weight)
    w = len(now.window)
    return select(now, rows, w, w)


def best_of_each(
    belief: np.ndarray, weight: np.ndarray, count: int, smallest_weight: float
) -> np.ndarray:
    """Rows with the largest non-negligible weights of each model, sorted by decreasing weight.

    Parameters
    ----------
    belief, weight : (b,) array
    count : int
        Largest number for each model.
    smallest_weight : float
        Logarithm, relative to the best of all.
    """
    rows = np.flatnonzero(weight - weight.max(initial=-np.inf) >= smallest_weight)
    rows = rows[np.argsort(-weight[rows], kind="stable")]
    by_belief = np.argsort(belief[rows], kind="stable")
    ordered = belief[rows[by_belief]]
    rank = np.empty(len(rows), dtype=int)
    rank[by_belief] = np.arange(len(rows)) - np.searchsorted(ordered, ordered)
    return rows[rank < count]


def merge(
    belief: np.ndarray, history: np.ndarray, used: np.ndarray, weight: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Merge hypotheses that agree in model, last pairs and seconds; sum their weights.

    Parameters
    ----------
    belief, weight : (b,) array
        Sorted by decreasing weight.
    history, used : (b, h), (b, w) int array

    Returns
    -------
    rows : (u,) int array
        The one with the largest weight of each group.
    weight : (u,) array
        Logarithm of the sum over its group.
    """
    key = _keys(np.column_stack([belief + 1, history, used]))
    _, first, group = np.unique(key, return_index=True, return_inverse=True)
    sums = np.bincount(group, np.exp(weight - weight[first][group]))
    total = weight[first] + np.log(sums)
    order = np.argsort(first)
    return first[order], total[order]


def _keys(table):
    """Hash each row of integers to an integer, equal for equal rows."""
    factor = 6364136223846793005  # multiplier of a linear congruential sequence modulo 2^64
    key = table[:, 0].copy()
    for column in table[:, 1:].T:
        key = (key ^ (key >> 29)) * factor + column
    return key
