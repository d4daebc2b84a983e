"""How probable each pair is, given all other observations before and after it.

Both sides are what Kalman filters know, one from the drive's start and one from its end: their
product, over the prior that both hold, is what all other observations say (two-filter smoother,
Fraser and Potter 1969).
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from mlscorr.matching import _hypotheses as hypotheses
from mlscorr.matching._beliefs import Chain
from mlscorr.matching._branching import heaviest, use
from mlscorr.matching.settings import COMPILED, INNER


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
    n = len(chain.gps_time)
    p = len(chain.pairs.control)
    result = Marginals(np.zeros(p), np.zeros(p), np.zeros((n, 3)), np.zeros((n, 3)))
    if p > 0:
        _smooth(chain, result)
    return result


@njit(**COMPILED)
def _smooth(chain, result):
    """Fill in the marginals of all observations.

    Of the past's hypotheses only every sqrt(n)-th are kept, and the stretch from there is walked
    again where the future comes to it: memory grows with sqrt(n).
    """
    n = len(chain.gps_time)
    length = int(np.ceil(np.sqrt(n)))
    now = hypotheses.start(chain)
    begins = [now]
    for row in range(1, n):
        now = hypotheses.predict(use(now, chain, row - 1), chain, row - 1, row)
        if row % length == 0:
            begins.append(now)
    future = hypotheses.start(chain)
    for part in range(len(begins) - 1, -1, -1):
        first = part * length
        last = min((part + 1) * length, n) - 1
        past = [heaviest(begins[part], chain)]
        now = begins[part]
        for row in range(first + 1, last + 1):
            now = hypotheses.predict(use(now, chain, row - 1), chain, row - 1, row)
            past.append(heaviest(now, chain))
        for row in range(last, first - 1, -1):
            if row + 1 < n:
                future = hypotheses.predict(use(future, chain, row + 1), chain, row + 1, row)
            _fill(join(past[row - first], heaviest(future, chain), chain), chain, row, result)


@njit(**INNER)
def _fill(both, chain, row, result):
    """Fill in the marginals of an observation."""
    if len(both.weight) == 0:
        return  # past and future agree in no belief: nothing is said
    density = hypotheses.log_likelihoods(both, chain, row)
    k = density.shape[1] // 2
    first = chain.pairs.first[row]
    _normalize(density.reshape(-1))
    for hypothesis in range(len(density)):
        for choice in range(k):
            result.sound[first + choice] += density[hypothesis, choice]
            result.moved[first + choice] += density[hypothesis, k + choice]
    share = both.weight
    _normalize(share)
    value, variance = hypotheses.displacement(both, chain, row)
    for axis in range(3):
        expected = 0.0
        square = 0.0
        for hypothesis in range(len(share)):
            expected += share[hypothesis] * value[hypothesis, axis]
        for hypothesis in range(len(share)):
            away = value[hypothesis, axis] - expected
            square += share[hypothesis] * (variance[hypothesis, axis] + away**2)
        result.expected[row, axis], result.sigma[row, axis] = expected, np.sqrt(square)


@njit(**INNER)
def _normalize(weight):
    """Make probabilities of logarithmic weights, in place."""
    largest = -np.inf
    total = 0.0
    for row in range(len(weight)):
        largest = max(largest, weight[row])
    for row in range(len(weight)):
        weight[row] = np.exp(weight[row] - largest)
        total += weight[row]
    for row in range(len(weight)):
        weight[row] /= total


@njit(**COMPILED)
def join(
    before: hypotheses.Hypotheses, after: hypotheses.Hypotheses, chain: Chain
) -> hypotheses.Hypotheses:
    """Pairs (past, future) of hypotheses of one belief, joined; their prior counts once.

    With precisions L and means m, L = L1 + L2 - I and L m = L1 m1 + L2 m2. Both windows are
    joined, and the histories are those of the past.

    Parameters
    ----------
    before, after : Hypotheses
        At an observation, by those before it and by those after it.
    chain : Chain
    """
    rows, others = _of_one_belief(before, after)
    w = len(before.window)
    both = hypotheses.select(before, rows, w, w + len(after.window))
    precisions, vectors, weights = _information(before)
    later_precisions, later_vectors, later_weights = _information(after)
    precision = np.empty((3, 3))
    vector = np.empty(3)
    for column, row in enumerate(after.window):
        both.window[w + column] = row
    for pair, (i, j) in enumerate(zip(rows, others)):  # noqa: B905 - numba knows no strict
        for column in range(len(after.window)):
            both.used[pair, w + column] = after.used[j, column]
        weight = before.weight[i] + weights[i] + after.weight[j] + later_weights[j]
        weight += 2.0 * chain.settings.least_log_weight * _clash(before, i, after, j, chain)
        for axis in range(3):
            for row in range(3):
                vector[row] = vectors[i, axis, row] + later_vectors[j, axis, row]
                for column in range(3):
                    known = (
                        precisions[i, axis, row, column] + later_precisions[j, axis, row, column]
                    )
                    precision[row, column] = known - (row == column)
            x = both.mean[pair, axis]
            p = both.covariance[pair, axis]
            determinant = _invert(precision, p)
            square = 0.0
            for row in range(3):
                x[row] = p[row, 0] * vector[0] + p[row, 1] * vector[1] + p[row, 2] * vector[2]
                square += vector[row] * x[row]
            weight += 0.5 * (square - np.log(determinant))
        both.weight[pair] = weight
    return both


@njit(inline="always", error_model="numpy")
def _of_one_belief(before, after):
    """Rows of past and future, of each pair that agrees in its belief."""
    size = 0
    for belief in before.belief:
        for other in after.belief:
            size += belief == other
    rows = np.empty(size, np.int64)
    others = np.empty(size, np.int64)
    pair = 0
    for i, belief in enumerate(before.belief):
        for j, other in enumerate(after.belief):
            if belief == other:
                rows[pair] = i
                others[pair] = j
                pair += 1
    return rows, others


@njit(**INNER)
def _information(now):
    """Precisions L, vectors L m and weights (log |L| - m L m) / 2, over all axes."""
    b = len(now.weight)
    precision = np.empty((b, 3, 3, 3))
    vector = np.zeros((b, 3, 3))
    weight = np.zeros(b)
    for hypothesis in range(len(weight)):
        for axis in range(3):
            matrix = precision[hypothesis, axis]
            x = now.mean[hypothesis, axis]
            square = np.log(_invert(now.covariance[hypothesis, axis], matrix))
            for i in range(3):
                for j in range(3):
                    vector[hypothesis, axis, i] += matrix[i, j] * x[j]
                square += vector[hypothesis, axis, i] * x[i]
            weight[hypothesis] -= 0.5 * square
    return precision, vector, weight


@njit(**INNER)
def _invert(matrix, out):
    """Inverse of a symmetric 3 x 3 matrix by its cofactors, and its determinant."""
    a = matrix[0, 0]
    b = matrix[0, 1]
    c = matrix[0, 2]
    d = matrix[1, 1]
    e = matrix[1, 2]
    f = matrix[2, 2]
    out[0, 0] = d * f - e * e
    out[1, 1] = a * f - c * c
    out[2, 2] = a * d - b * b
    out[0, 1] = out[1, 0] = c * e - b * f
    out[0, 2] = out[2, 0] = b * e - c * d
    out[1, 2] = out[2, 1] = b * c - a * e
    determinant = a * out[0, 0] + b * out[0, 1] + c * out[0, 2]
    for i in range(3):
        for j in range(3):
            out[i, j] /= determinant
    return determinant


@njit(inline="always", error_model="numpy")
def _clash(before, i, after, j, chain):
    """Whether hypotheses of past and future use one control point twice in one visit."""
    for column, row in enumerate(before.window):
        control = before.used[i, column]
        for place, other in enumerate(after.window):
            if control >= 0 and control == after.used[j, place]:
                apart = abs(chain.gps_time[row] - chain.gps_time[other])
                same_pass = chain.pass_number[row] == chain.pass_number[other]
                if same_pass and apart <= chain.settings.visit_gap:
                    return True
    return False
