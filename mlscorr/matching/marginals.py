"""How probable each pair is, given all other observations before and after it.

Both sides are what Kalman filters know, one from the drive's start and one from its end: their
product, over the prior that both hold, is what all other observations say (two-filter smoother,
Fraser and Potter 1969).
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from mlscorr.matching.beliefs import Chain
from mlscorr.matching.branching import heaviest, use
from mlscorr.matching.hypotheses import Hypotheses, displacement, log_likelihoods, predict, start


class Marginals(NamedTuple):
    """How probable pairs are, and what all others make of each observation.

    Parameters
    ----------
    sound : (p,) array
        Probability of a pair's being right and its surveyed point where the target is.
    moved : (p,) array
        Of its being right and the surveyed point elsewhere.
    expected : (n, 3) array
        Misclosure by the other observations. Units: m.
    sigma : (n, 3) array
        Of the difference to it. Units: m.
    """

    sound: np.ndarray
    moved: np.ndarray
    expected: np.ndarray
    sigma: np.ndarray


def marginals(chain: Chain) -> Marginals:
    """Join hypotheses from the start of a drive with those from its end.

    Parameters
    ----------
    chain : Chain
    """
    n, p = len(chain.gps_time), len(chain.pairs.control)
    result = Marginals(np.zeros(p), np.zeros(p), np.zeros((n, 3)), np.zeros((n, 3)))
    if p > 0:
        _smooth(chain, result)
    return result


@njit(cache=True, nogil=True)
def _smooth(chain, result):
    """Fill in the marginals of all observations.

    Of the past's hypotheses only every sqrt(n)-th are kept, and the stretch from there is walked
    again where the future comes to it: memory grows with sqrt(n).
    """
    n = len(chain.gps_time)
    length = int(np.ceil(np.sqrt(n)))
    now = start(chain)
    begins = [now]
    for row in range(1, n):
        now = predict(use(now, chain, row - 1), chain, row - 1, row)
        if row % length == 0:
            begins.append(now)
    future = start(chain)
    for part in range(len(begins) - 1, -1, -1):
        first, last = part * length, min((part + 1) * length, n) - 1
        past = [heaviest(begins[part], chain)]
        now = begins[part]
        for row in range(first + 1, last + 1):
            now = predict(use(now, chain, row - 1), chain, row - 1, row)
            past.append(heaviest(now, chain))
        for row in range(last, first - 1, -1):
            if row + 1 < n:
                future = predict(use(future, chain, row + 1), chain, row + 1, row)
            _fill(past[row - first], heaviest(future, chain), chain, row, result)


@njit(cache=True, nogil=True)
def _fill(before, after, chain, row, result):
    """Fill in the marginals of an observation."""
    both = join(before, after, chain)
    if len(both.weight) == 0:
        return  # past and future agree in no belief: nothing is said
    density = log_likelihoods(both, chain, row)
    k = density.shape[1] // 2
    weight = both.weight.reshape(-1, 1) + density
    probability = np.exp(weight - weight.max())
    probability /= probability.sum()
    first = chain.pairs.first[row]
    result.sound[first : first + k] = probability[:, :k].sum(axis=0)
    result.moved[first : first + k] = probability[:, k : 2 * k].sum(axis=0)
    share = np.exp(both.weight - both.weight.max())
    share /= share.sum()
    value, variance = displacement(both, chain, row)
    result.expected[row] = share @ value
    result.sigma[row] = np.sqrt(share @ (variance + (value - result.expected[row]) ** 2))


@njit(cache=True, nogil=True)
def join(before: Hypotheses, after: Hypotheses, chain: Chain) -> Hypotheses:
    """Pairs (past, future) of hypotheses of one belief, joined; their prior counts once.

    With precisions L and means m, L = L1 + L2 - I and L m = L1 m1 + L2 m2. Both windows are
    joined, and the histories are those of the past.

    Parameters
    ----------
    before, after : Hypotheses
        At an observation, by those before it and by those after it.
    chain : Chain
    """
    past, future = np.nonzero(before.belief.reshape(-1, 1) == after.belief)
    precisions, vectors, weights = _information(before)
    later_precisions, later_vectors, later_weights = _information(after)
    weights = (before.weight + weights).reshape(-1, 1) + after.weight + later_weights
    weights += 2.0 * chain.settings.smallest_weight * _clash(before, after, chain)
    weight, mean = np.empty(len(past)), np.empty((len(past), 3, 3))
    covariance = np.empty((len(past), 3, 3, 3))
    for pair, (i, j) in enumerate(zip(past, future)):  # noqa: B905 - numba knows no strict
        weight[pair] = weights[i, j]
        for axis in range(3):
            x, p = mean[pair, axis], covariance[pair, axis]
            precision = precisions[i, axis] + later_precisions[j, axis] - np.eye(3)
            vector = vectors[i, axis] + later_vectors[j, axis]
            determinant, square = _invert(precision, p), 0.0
            for row in range(3):
                x[row] = p[row, 0] * vector[0] + p[row, 1] * vector[1] + p[row, 2] * vector[2]
                square += vector[row] * x[row]
            weight[pair] += 0.5 * (square - np.log(determinant))
    used = np.column_stack((before.used[past], after.used[future]))
    window, history = np.append(before.window, after.window), before.history[past]
    return Hypotheses(before.belief[past], weight, mean, covariance, used, window, history)


@njit(cache=True, nogil=True)
def _information(now):
    """Precisions L, vectors L m and weights (log |L| - m L m) / 2, over all axes."""
    precision, vector = np.empty(now.covariance.shape), np.zeros(now.mean.shape)
    weight = np.zeros(len(now.weight))
    for hypothesis in range(len(weight)):
        for axis in range(3):
            matrix, x = precision[hypothesis, axis], now.mean[hypothesis, axis]
            square = np.log(_invert(now.covariance[hypothesis, axis], matrix))
            for i in range(3):
                for j in range(3):
                    vector[hypothesis, axis, i] += matrix[i, j] * x[j]
                square += vector[hypothesis, axis, i] * x[i]
            weight[hypothesis] -= 0.5 * square
    return precision, vector, weight


@njit(cache=True, nogil=True)
def _invert(matrix, out):
    """Inverse of a symmetric 3 x 3 matrix by its cofactors, and its determinant."""
    a, b, c = matrix[0, 0], matrix[0, 1], matrix[0, 2]
    d, e, f = matrix[1, 1], matrix[1, 2], matrix[2, 2]
    out[0, 0], out[1, 1], out[2, 2] = d * f - e * e, a * f - c * c, a * d - b * b
    out[0, 1] = out[1, 0] = c * e - b * f
    out[0, 2] = out[2, 0] = b * e - c * d
    out[1, 2] = out[2, 1] = b * c - a * e
    determinant = a * out[0, 0] + b * out[0, 1] + c * out[0, 2]
    out /= determinant
    return determinant


@njit(cache=True, nogil=True)
def _clash(before, after, chain):
    """Which hypotheses of past and future (b, a) use one control point twice in one visit."""
    clash = np.zeros((len(before.weight), len(after.weight)), np.bool_)
    for i, row in enumerate(before.window):
        for j, other in enumerate(after.window):
            near = abs(chain.gps_time[row] - chain.gps_time[other]) <= chain.settings.pause
            if near and chain.pass_number[row] == chain.pass_number[other]:
                control = before.used[:, i].copy().reshape(-1, 1)
                clash |= (control == after.used[:, j]) & (control >= 0)
    return clash
