"""The Markov recursion: V^-1 of all observations in one pass forward and one backward.

Forward runs the Kalman filter, whose innovations are the whitened observations; backward run the
adjoints of de Jong 1989 (J. Am. Stat. Assoc. 84, 1085-1088), which need no inverse of a state's
covariance, so that two targets a millisecond apart do no harm:

    P- = F P F^T + Q            S = H P- H^T + R            K = P- H^T S^-1
    P  = (I - K H) P- (I - K H)^T + K R K^T                 (Joseph)
    v  = l - H x-               x = x- + K v
    u  = S^-1 v - K^T a         a- = a + H^T u              a <- F^T a-
    N- = (I - K H)^T N (I - K H) + H^T S^-1 H               N <- F^T N- F

u is V^-1 l; S^-1 + K^T N K is a diagonal block of V^-1; x + P a is a smoothed state and P - P N P
its covariance. H = B (mixing) on the first state of each process. Sources: Särkkä and Solin 2019,
section 10 (filter, smoother) and 12 (processes); Durbin and Koopman 2012, section 4.5.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from mlscorr.collocation._matrices import (
    assign,
    make_symmetric,
    multiply,
    multiply_transposed,
    subtract_product,
    whitening_root,
)
from mlscorr.collocation._states import (
    Layout,
    add_blocks,
    carry,
    carry_square,
    fill_noise,
    fill_transition,
    observe,
    send_back,
)
from mlscorr.compiled_loops import LOOP


class Recursion(NamedTuple):
    """The factor of V0 of n epochs, as the compiled loops take it.

    Parameters
    ----------
    layout : Layout
    transitions : (n, s, 3, 3) array
    mixing : (n, r, k) array
    gains : (n, r, d) array
        K^T.
    whiteners : (n, r, r) array
        Inverse roots of the innovations' covariances.
    """

    layout: Layout
    transitions: np.ndarray
    mixing: np.ndarray
    gains: np.ndarray
    whiteners: np.ndarray


@njit(**LOOP)
def filter_covariance(
    layout: Layout, size: int, steps: np.ndarray, mixing: np.ndarray, noise: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Kalman filter of the covariances over n epochs.

    Parameters
    ----------
    layout : Layout
    size : int
        Number d of states.
    steps : (n, s) array
        Times since the epoch before, by each signal's clock.
    mixing, noise : (n, r, k), (n, r, r) array

    Returns
    -------
    transitions : (n, s, 3, 3) array
    gains : (n, r, d) array
        K^T.
    whiteners : (n, r, r) array
        Of the innovations; not a number at the epoch where V is not positive definite.
    covariances : (n, d, d) array
        P.
    """
    n, r, k = mixing.shape
    number = layout.states.size
    transitions = np.zeros((n, number, 3, 3))
    gains = np.zeros((n, r, size))
    whiteners = np.zeros((n, r, r))
    covariances = np.zeros((n, size, size))
    spread = np.zeros((number, 3, 3))
    fill_noise(layout, np.full(number, np.inf), spread)  # the stationary covariance
    p = np.zeros((size, size))
    for i in range(n):
        if i > 0:
            fill_transition(layout, steps[i], transitions[i])
            fill_noise(layout, steps[i], spread)
            p = carry_square(layout, transitions[i], p, False)
        add_blocks(layout, spread, p)
        observed = observe(layout.first, mixing[i], p)  # H P-
        innovation = observe(layout.first, mixing[i], observed.T)
        prior = np.zeros(r)
        for m in range(r):
            prior[m] = noise[i, m, m]
            for j in range(k):
                prior[m] += mixing[i, m, j] ** 2
            for other in range(r):
                innovation[m, other] += noise[i, m, other]
        white = whitening_root(innovation, prior)
        assign(whiteners[i], white)
        if np.isnan(white[0, 0]):
            break
        gain = multiply_transposed(white, multiply(white, observed))  # K^T
        p = _joseph(layout.first, mixing[i], noise[i], p, gain, observed)
        assign(gains[i], gain)
        assign(covariances[i], p)
    return transitions, gains, whiteners, covariances


@njit(**LOOP)
def _joseph(first, mixing, noise, p, gain, observed):
    """(I - K H) P- (I - K H)^T + K R K^T from K^T and H P-."""
    subtract_product(p, gain.T, observed)
    left = observe(first, mixing, p.T)  # H [(I - K H) P-]^T, which R K^T balances
    subtract_product(left, noise, gain)
    subtract_product(p, left.T, gain)
    make_symmetric(p)
    return p


@njit(**LOOP)
def filter_columns(recursion: Recursion, columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Filter columns of observations.

    Parameters
    ----------
    recursion : Recursion
    columns : (n, r, c) array

    Returns
    -------
    whitened : (n, r, c) array
    states : (n, d, c) array
    """
    layout, transitions, mixing, gains, whiteners = recursion
    n, r, c = columns.shape
    x = np.zeros((gains.shape[2], c))
    states = np.zeros((n, gains.shape[2], c))
    whitened = np.zeros((n, r, c))
    for i in range(n):
        if i > 0:
            carry(layout, transitions[i], x, False)
        innovation = observe(layout.first, mixing[i], x)
        for m in range(r):
            for b in range(c):
                innovation[m, b] = columns[i, m, b] - innovation[m, b]
        assign(whitened[i], multiply(whiteners[i], innovation))
        step = multiply_transposed(gains[i], innovation)
        for a in range(x.shape[0]):
            for b in range(c):
                x[a, b] += step[a, b]
        assign(states[i], x)
    return whitened, states


@njit(**LOOP)
def smooth_columns(recursion: Recursion, whitened: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """From whitened columns back.

    Parameters
    ----------
    recursion : Recursion
    whitened : (n, r, c) array

    Returns
    -------
    weights : (n, r, c) array
        V^-1 c.
    adjoints : (n, d, c) array
        a.
    """
    layout, transitions, mixing, gains, whiteners = recursion
    n, r, c = whitened.shape
    a = np.zeros((gains.shape[2], c))
    adjoints = np.zeros((n, gains.shape[2], c))
    weights = np.zeros((n, r, c))
    for i in range(n - 1, -1, -1):
        assign(adjoints[i], a)
        u = multiply_transposed(whiteners[i], whitened[i])
        subtract_product(u, gains[i], a)
        assign(weights[i], u)
        send_back(layout.first, mixing[i], u, a)
        if i > 0:
            carry(layout, transitions[i], a, True)
    return weights, adjoints


@njit(**LOOP)
def smooth_covariance(
    recursion: Recursion, steps: np.ndarray, covariances: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The backward pass of N.

    Parameters
    ----------
    recursion : Recursion
    steps, covariances : (n, s), (n, d, d) array
        As of filter_covariance.

    Returns
    -------
    blocks : (n, r, r) array
        On the diagonal of V^-1.
    future : (n, r, d) array
        K^T N.
    same, following : (n, d, d), (n - 1, d, d) array
        Covariances of the smoothed states with themselves, and with those of the next epoch.
    """
    layout, transitions, mixing, gains, whiteners = recursion
    n, r, _ = mixing.shape
    size = gains.shape[2]
    blocks = np.zeros((n, r, r))
    future = np.zeros((n, r, size))
    same = np.zeros((n, size, size))
    following = np.zeros((max(n - 1, 0), size, size))
    spread = np.zeros((layout.states.size, 3, 3))
    information = np.zeros((size, size))
    for i in range(n - 1, -1, -1):
        assign(future[i], multiply(gains[i], information))
        weight = multiply_transposed(whiteners[i], whiteners[i])  # S^-1
        assign(blocks[i], weight)
        subtract_product(blocks[i], -future[i], gains[i].T)
        assign(same[i], covariances[i])
        subtract_product(same[i], multiply(covariances[i], information), covariances[i])
        if i == 0:
            break
        send_back(layout.first, mixing[i], -future[i], information)  # (I - K H)^T N
        information = information.T.copy()
        back = observe(layout.first, mixing[i], np.eye(size))
        back = multiply(weight, back)
        subtract_product(back, gains[i], information)
        send_back(layout.first, mixing[i], back, information)  # N-
        make_symmetric(information)
        fill_noise(layout, steps[i], spread)
        predicted = carry_square(layout, transitions[i], covariances[i - 1], False)
        add_blocks(layout, spread, predicted)
        forward = covariances[i - 1].copy()
        carry(layout, transitions[i], forward, False)
        forward = forward.T.copy()  # P F^T
        assign(following[i - 1], forward)
        subtract_product(following[i - 1], multiply(forward, information), predicted)
        information = carry_square(layout, transitions[i], information, True)
    return blocks, future, same, following


@njit(**LOOP)
def precision_between(
    recursion: Recursion, future: np.ndarray, early: int, late: int
) -> np.ndarray:
    """Block (r, r) of V^-1 at an early and a late epoch, walking from late to early.

    Parameters
    ----------
    recursion : Recursion
    future : (n, r, d) array
        As of smooth_covariance.
    early, late : int
        Numbers of the epochs.
    """
    layout, transitions, mixing, gains, whiteners = recursion
    y = np.zeros((gains.shape[2], gains.shape[1]))
    weight = multiply_transposed(whiteners[late], whiteners[late])  # S^-1 + K^T N K
    subtract_product(weight, -future[late], gains[late].T)
    send_back(layout.first, mixing[late], weight, y)
    for a in range(y.shape[0]):
        for m in range(y.shape[1]):
            y[a, m] -= future[late, m, a]
    for i in range(late, early, -1):
        if i < late:  # (I - K H)^T
            send_back(layout.first, mixing[i], -multiply(gains[i], y), y)
        carry(layout, transitions[i], y, True)
    return -multiply(gains[early], y)
