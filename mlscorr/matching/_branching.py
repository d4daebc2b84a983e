"""An observation is used: each hypothesis branches into what it may be; a handful is kept."""

import numpy as np
from numba import njit

from mlscorr.matching._beliefs import Chain
from mlscorr.matching._hypotheses import Hypotheses, displacement, log_likelihoods, select
from mlscorr.matching.settings import COMPILED, INNER


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
