"""How probable each pair is, given all other observations before and after it.

The hypotheses on a drive branch at each observation, from its start and from its end; the heaviest
stay, and those that no later observation can tell apart are merged. Each side is what Kalman
filters know: their product, over the prior that both hold, is what all other observations say
(two-filter smoother, Fraser and Potter 1969).
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from mlscorr.matching import _hypotheses as hypotheses
from mlscorr.matching._beliefs import Chain
from mlscorr.matching._hypotheses import Hypotheses, displacement, log_likelihoods, select
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
        result.expected[row, axis] = expected
        result.sigma[row, axis] = np.sqrt(square)


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


@njit(**COMPILED)
def use(now: Hypotheses, chain: Chain, row: int) -> Hypotheses:
    """The hypotheses after an observation: each branches into its pairs and none.

    Parameters
    ----------
    now : Hypotheses
        Before it.
    chain : Chain
    row : int
        Of the observation.
    """
    first = chain.pairs.first[row]
    k = chain.pairs.first[row + 1] - chain.pairs.first[row]
    count = 3 * chain.settings.joined_hypotheses
    smallest = chain.settings.least_log_weight
    weight = log_likelihoods(now, chain, row).reshape(-1)
    w = len(now.window)
    belief = np.empty(len(weight), np.int64)
    choices = 2 * k + 1
    for branch in range(len(weight)):
        belief[branch] = now.belief[branch // choices]
    kept = best_of_each(belief, weight, 4 * count, smallest)
    after = select(now, kept // choices, w, w + 1)
    choice = kept % choices
    after.window[w] = row
    for place, branch in enumerate(kept):
        if choice[place] < 2 * k:
            pair = first + choice[place] % k
        else:
            pair = -1
        after.weight[place] = weight[branch]
        after.used[place, w] = chain.pairs.control[pair] if pair >= 0 else -1
        if choice[place] < k:  # takes up the sound pairs only
            for column in range(chain.settings.merging_matches - 1):
                after.history[place, column] = after.history[place, column + 1]
            after.history[place, -1] = pair
    groups, total = merge(after.belief, after.history, after.used, after.weight)
    best = best_of_each(after.belief[groups], total, count, smallest)
    rows = groups[best]
    after = select(after, rows, w + 1, w + 1)
    for place, group in enumerate(best):
        after.weight[place] = total[group]
    _update(after, chain, row, choice[rows])
    return after


@njit(**INNER)
def _update(after, chain, row, choice):
    """Kalman update, in place, of hypotheses by what each takes an observation for.

    K = P H^T / S, x = x + K v, P = P - K H P with H = (sigma, g, 0) per axis.
    """
    first = chain.pairs.first[row]
    k = chain.pairs.first[row + 1] - chain.pairs.first[row]
    sigma = chain.settings.constant_sigma
    value, variance = displacement(after, chain, row)
    cross = np.empty(3)  # P H^T
    for hypothesis in range(len(choice)):
        if choice[hypothesis] == 2 * k:
            continue
        pair = first + choice[hypothesis] % k
        if choice[hypothesis] >= k:
            extra = chain.settings.moved_sigma**2
        else:
            extra = 0.0
        for axis in range(3):
            gain = chain.gain[after.belief[hypothesis], row, axis]
            x = after.mean[hypothesis, axis]
            p = after.covariance[hypothesis, axis]
            away = chain.pairs.misclosure[pair, axis] - value[hypothesis, axis]
            spread = variance[hypothesis, axis] + chain.pair_variance[pair, axis] + extra
            for i in range(3):
                cross[i] = sigma * p[i, 0] + gain * p[i, 1]
            for i in range(3):
                x[i] += cross[i] / spread * away
                for j in range(3):
                    p[i, j] -= cross[i] / spread * cross[j]


@njit(inline="always", error_model="numpy")
def heaviest(now: Hypotheses, chain: Chain) -> Hypotheses:
    """Those of each belief that are joined with the other side's.

    Parameters
    ----------
    now : Hypotheses
    chain : Chain
    """
    count = chain.settings.joined_hypotheses
    smallest = chain.settings.least_log_weight
    rows = best_of_each(now.belief, now.weight, count, smallest)
    w = len(now.window)
    return select(now, rows, w, w)


@njit(**COMPILED)
def best_of_each(
    belief: np.ndarray, weight: np.ndarray, count: int, smallest_weight: float
) -> np.ndarray:
    """Rows with the largest weights of each belief that aren't negligible, the heaviest first.

    Parameters
    ----------
    belief, weight : (b,) array
    count : int
        At most, of each belief.
    smallest_weight : float
        Logarithm, against the best of all.
    """
    largest = -np.inf
    beliefs = 0
    size = 0
    for row in range(len(weight)):
        largest = max(largest, weight[row])
        beliefs = max(beliefs, belief[row] + 1)
    rows = np.empty(len(weight), np.int64)
    rank = np.zeros(beliefs, np.int64)
    for row in range(len(weight)):
        if weight[row] - largest >= smallest_weight:
            rows[size] = row
            size += 1
    _sort(rows[:size], weight)
    kept = 0
    for row in rows[:size]:
        if rank[belief[row]] < count:
            rows[kept] = row
            kept += 1
        rank[belief[row]] += 1
    return rows[:kept]


@njit(**INNER)
def _sort(rows, weight):
    """Sort rising rows by falling weight, in place; equal ones stay in order (Shell 1959)."""
    gap = len(rows)
    while gap > 1:
        gap = max(1, 5 * gap // 11)  # Gonnet and Baeza-Yates 1991
        for end in range(gap, len(rows)):
            row = rows[end]
            place = end
            while place >= gap:
                other = rows[place - gap]
                if weight[other] > weight[row] or (weight[other] == weight[row] and other < row):
                    break
                rows[place] = other
                place -= gap
            rows[place] = row


@njit(**COMPILED)
def merge(
    belief: np.ndarray, history: np.ndarray, used: np.ndarray, weight: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The heaviest of those that agree in belief, last pairs and seconds; their weights' sum.

    Parameters
    ----------
    belief, weight : (b,) array
        The heaviest first.
    history, used : (b, h), (b, w) int array

    Returns
    -------
    rows : (u,) int array
        The heaviest of each group.
    weight : (u,) array
        Logarithm of the sum over its group.
    """
    n = len(weight)
    groups = 0
    keys = np.empty(n, np.int64)
    rows = np.empty(n, np.int64)
    total = np.empty(n)
    table = np.full(2 * n, -1)  # of the groups, by key (Knuth 1997, 6.4)
    for row in range(n):
        keys[row] = _key(belief[row], history[row], used[row])
        slot = abs(keys[row]) % len(table)
        while table[slot] >= 0 and keys[rows[table[slot]]] != keys[row]:
            slot = (slot + 1) % len(table)
        if table[slot] < 0:
            table[slot] = groups
            rows[groups] = row
            total[groups] = 0.0
            groups += 1
        group = table[slot]
        total[group] += np.exp(weight[row] - weight[rows[group]])
    for group in range(groups):
        total[group] = weight[rows[group]] + np.log(total[group])
    return rows[:groups], total[:groups]


@njit(inline="always", error_model="numpy")
def _key(belief, history, used):
    """A whole number for one row of all three, equal where they are."""
    factor = 6364136223846793005  # of a linear congruential sequence modulo 2^64
    key = belief + 1
    for pair in history:
        key = (key ^ (key >> 29)) * factor + pair
    for control in used:
        key = (key ^ (key >> 29)) * factor + control
    return key


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
