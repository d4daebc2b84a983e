"""An observation is used: each hypothesis branches into what it may be; a handful is kept."""

import numpy as np
from numba import njit

from mlscorr.matching.beliefs import Chain
from mlscorr.matching.hypotheses import Hypotheses, displacement, log_likelihoods, select


@njit(cache=True, nogil=True)
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
    first, k = chain.pairs.first[row], chain.pairs.first[row + 1] - chain.pairs.first[row]
    count, smallest = 3 * chain.settings.joined_hypotheses, chain.settings.smallest_weight
    weight = log_likelihoods(now, chain, row) + now.weight.reshape(-1, 1)
    belief = np.repeat(now.belief, 2 * k + 1)
    kept = best_of_each(belief, weight.reshape(-1), 4 * count, smallest)
    parent, choice = kept // (2 * k + 1), kept % (2 * k + 1)
    pair = np.where(choice < 2 * k, first + choice % max(k, 1), -1)
    control = np.where(pair < 0, -1, chain.pairs.control[pair])
    used = np.column_stack((now.used[parent], control))
    history = np.column_stack((now.history[parent], pair))  # takes up the sound pairs only
    history = np.where((choice < k).reshape(-1, 1), history[:, 1:], history[:, :-1])
    groups, total = merge(now.belief[parent], history, used, weight.reshape(-1)[kept])
    best = best_of_each(now.belief[parent[groups]], total, count, smallest)
    rows = groups[best]
    before = select(now, parent[rows])
    window, history = np.append(now.window, row), history[rows]
    after = Hypotheses(
        before.belief, total[best], before.mean, before.covariance, used[rows], window, history
    )
    extra = np.where(choice < k, 0.0, chain.settings.moved_sigma**2)
    _update(after, chain, row, pair[rows], extra[rows])
    return after


@njit(cache=True, nogil=True)
def _update(after, chain, row, pair, extra):
    """Kalman update, in place, of hypotheses by their pairs with extra variances (m^2).

    K = P H^T / S, x = x + K v, P = P - K H P with H = (sigma, g, 0) per axis.
    """
    gain = chain.gain[:, row][after.belief]
    value, variance = displacement(after, chain, row)
    cross = np.empty(3)  # P H^T
    for hypothesis, named in enumerate(pair):
        for axis in range(3 if named >= 0 else 0):
            x, p = after.mean[hypothesis, axis], after.covariance[hypothesis, axis]
            away = chain.pairs.misclosure[named, axis] - value[hypothesis, axis]
            spread = variance[hypothesis, axis] + chain.pair_variance[named, axis]
            for i in range(3):
                cross[i] = (
                    chain.settings.constant_sigma * p[i, 0] + gain[hypothesis, axis] * p[i, 1]
                )
            for i in range(3):
                weight = cross[i] / (spread + extra[hypothesis])
                x[i] += weight * away
                for j in range(3):
                    p[i, j] -= weight * cross[j]


@njit(cache=True, nogil=True)
def heaviest(now: Hypotheses, chain: Chain) -> Hypotheses:
    """Those of each belief that are joined with the other side's.

    Parameters
    ----------
    now : Hypotheses
    chain : Chain
    """
    count, smallest = chain.settings.joined_hypotheses, chain.settings.smallest_weight
    return select(now, best_of_each(now.belief, now.weight, count, smallest))


@njit(cache=True, nogil=True)
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
    near = np.flatnonzero(weight - weight.max() >= smallest_weight)
    order = near[np.argsort(-weight[near], kind="mergesort")]
    rank = np.zeros(belief.max() + 1, np.int64)
    kept = np.zeros(len(order), np.bool_)
    for i, row in enumerate(order):
        kept[i] = rank[belief[row]] < count
        rank[belief[row]] += 1
    return order[kept]


@njit(cache=True, nogil=True)
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
    key = _keys(belief, history, used)
    order = np.argsort(key, kind="mergesort")  # stable: the heaviest of a group stays its first
    rows, total, groups = np.empty_like(order), np.empty(len(order)), 0
    for i, row in enumerate(order):
        if i == 0 or key[row] != key[order[i - 1]]:
            rows[groups], total[groups] = row, 0.0
            groups += 1
        total[groups - 1] += np.exp(weight[row] - weight[rows[groups - 1]])
    rows = rows[:groups]
    return rows, weight[rows] + np.log(total[:groups])


@njit(cache=True, nogil=True)
def _keys(belief, history, used):
    """A whole number (b,) for each row of all three, equal where they are (Knuth 1997, 6.4)."""
    factor = np.int64(6364136223846793005)  # of a linear congruential sequence modulo 2^64
    key = belief + np.int64(1)
    for table in (history, used):
        for column in range(table.shape[1]):
            key = (key ^ (key >> np.int64(29))) * factor + table[:, column]
    return key
