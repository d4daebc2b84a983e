"""How probable each pair is, given all other observations before and after it."""

from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from mlscorr.matching.hypotheses import (
    KEPT,
    VISIT,
    Hypotheses,
    best_of_each,
    displacement,
    log_likelihoods,
    taken,
    walk,
)

CLASH = -40.0  # log weight of a past and a future that use a point twice in one visit
REVERSED = np.array([1.0, 1.0, -1.0])  # the rate changes its sign when time runs backwards


@dataclass(frozen=True)
class Marginals:
    """Probabilities (p,) of each pair, and what all others make of each observation.

    sound is that of a pair's being right and its surveyed point where the target is, moved that
    of its being right and the surveyed point elsewhere.

    expected (n, 3) is the misclosure by the other observations, sigma (n, 3) that of the
    difference to it. Units: m.
    """

    sound: np.ndarray
    moved: np.ndarray
    expected: np.ndarray
    sigma: np.ndarray


def marginals(chain):
    """Marginals of a Chain: hypotheses from its start joined with those from its end."""
    n, p = len(chain), len(chain.pairs.control)
    rows = np.arange(n)
    forward = [_light(now) for _, now in walk(chain, rows)][:-1]
    found = Marginals(np.zeros(p), np.zeros(p), np.zeros((n, 3)), np.zeros((n, 3)))
    for row, backward in walk(chain, rows[::-1]):
        if row is None:
            break
        _join(forward.pop(), _light(backward), chain, row, found)
    return found


def _light(now):
    return now[best_of_each(now.belief, now.weight, KEPT)]


def _join(before, after, chain, row, found):
    """Fill in the marginals of one observation."""
    one, other = np.nonzero(before.belief[:, None] == after.belief)
    both = _product(before, after, one, other, chain)
    density = log_likelihoods(both, chain, row)
    density[:, :-1][np.tile(taken(after, chain, row), 2)[other]] = -np.inf
    prior = both.weight + np.where(_clash(before, after, chain)[one, other], CLASH, 0.0)
    weight = prior[:, None] + density
    probability = np.exp(weight - logsumexp(weight)).sum(axis=0)
    pairs = chain.pairs.of(row)
    found.sound[pairs], found.moved[pairs] = probability[:-1].reshape(2, -1)
    share = np.exp(prior - logsumexp(prior))
    value, variance = displacement(both.mean, both.covariance, chain.gain[both.belief, row])
    found.expected[row] = share @ value
    spread = variance + chain.noise[both.belief, row] + (value - found.expected[row]) ** 2
    found.sigma[row] = np.sqrt(share @ spread)


def _clash(before, after, chain):
    """Which hypotheses of past and future (b, a) use one control point twice in one visit."""
    past, future = before.window, after.window
    near = np.abs(chain.gps_time[past][:, None] - chain.gps_time[future]) <= VISIT
    near &= chain.pass_number[past][:, None] == chain.pass_number[future]
    clash = np.zeros((len(before), len(after)), bool)
    for i, j in zip(*np.nonzero(near), strict=True):
        mine, theirs = before.used[:, i, None], after.used[:, j]
        clash |= (mine == theirs) & (mine >= 0)
    return clash


def _product(before, after, one, other, chain):
    """Pairs (one, other) of hypotheses of past and future, joined; their prior counts once.

    With precisions L and means m, L = L1 + L2 - L0 and L m = L1 m1 + L2 m2.
    """
    past, eta_past, square_past, size_past = _information(before.mean, before.covariance)
    turned = after.covariance * (REVERSED[:, None] * REVERSED)
    future, eta_future, square_future, size_future = _information(after.mean * REVERSED, turned)
    prior = chain.prior[before.belief[one]][:, None]
    precision = past[one] + future[other] - (1.0 / prior)[..., None] * np.eye(3)
    covariance, size = _inverse(precision)
    eta = eta_past[one] + eta_future[other]
    mean = (covariance @ eta[..., None])[..., 0]
    square = (eta * mean).sum(axis=(1, 2)) - square_past[one] - square_future[other]
    size = (np.log(prior).sum(axis=-1) - np.log(size)).sum(axis=1)
    size = size + size_past[one] + size_future[other]
    weight = before.weight[one] + after.weight[other] + 0.5 * (square + size)
    return Hypotheses(
        before.belief[one], weight, mean, covariance, before.used[one], before.window,
        before.history[one],
    )  # fmt: skip


def _information(mean, covariance):
    """Precision, precision times mean, mean times that, and log determinant of the precision."""
    precision, size = _inverse(covariance)
    eta = (precision @ mean[..., None])[..., 0]
    return precision, eta, (eta * mean).sum(axis=(1, 2)), -np.log(size).sum(axis=1)


def _inverse(matrix):
    """Inverse and determinant of symmetric (..., 3, 3) matrices, by cofactors: LAPACK is slow on
    many small ones."""
    a, b, c = matrix[..., 0, 0], matrix[..., 0, 1], matrix[..., 0, 2]
    d, e, f = matrix[..., 1, 1], matrix[..., 1, 2], matrix[..., 2, 2]
    cofactors = [d * f - e * e, c * e - b * f, b * e - c * d]
    cofactors += [a * f - c * c, b * c - a * e, a * d - b * b]
    size = a * cofactors[0] + b * cofactors[1] + c * cofactors[2]
    rows = [[0, 1, 2], [1, 3, 4], [2, 4, 5]]
    inverse = np.stack([np.stack([cofactors[i] for i in row], axis=-1) for row in rows], axis=-2)
    return inverse / size[..., None, None], size
