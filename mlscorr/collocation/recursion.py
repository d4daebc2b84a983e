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

import numpy as np
from numba import njit

from mlscorr.collocation.states import (
    add_blocks,
    carry,
    carry_square,
    fill_noise,
    fill_transition,
    observe,
    send_back,
)

SINGULAR = 1e-15  # share of an observation's prior variance below which nothing is left of it


@njit(cache=True, nogil=True)
def _times(a, b):
    """a b. Plain loops: on matrices this small they are as fast as BLAS, and quick to compile."""
    out = np.zeros((a.shape[0], b.shape[1]))
    for i in range(a.shape[0]):
        for k in range(a.shape[1]):
            for j in range(b.shape[1]):
                out[i, j] += a[i, k] * b[k, j]
    return out


@njit(cache=True, nogil=True)
def _across(a, b):
    """a^T b."""
    out = np.zeros((a.shape[1], b.shape[1]))
    for k in range(a.shape[0]):
        for i in range(a.shape[1]):
            for j in range(b.shape[1]):
                out[i, j] += a[k, i] * b[k, j]
    return out


@njit(cache=True, nogil=True)
def _take(x, a, b):
    """x <- x - a b^T, in place."""
    for i in range(x.shape[0]):
        for j in range(x.shape[1]):
            for k in range(a.shape[1]):
                x[i, j] -= a[i, k] * b[j, k]


@njit(cache=True, nogil=True)
def _even(x):
    """Make x symmetric, in place."""
    for i in range(x.shape[0]):
        for j in range(i):
            x[i, j] = x[j, i] = 0.5 * (x[i, j] + x[j, i])


@njit(cache=True, nogil=True)
def _whitener(s, prior):
    """L^-1 with L L^T = s (r, r); a first element that is no number where s is singular."""
    r = s.shape[0]
    lower = np.zeros((r, r))
    white = np.zeros((r, r))
    for i in range(r):
        for j in range(i + 1):
            total = s[i, j]
            for k in range(j):
                total -= lower[i, k] * lower[j, k]
            if j < i:
                lower[i, j] = total / lower[j, j]
            elif total > SINGULAR * prior[i]:
                lower[i, i] = np.sqrt(total)
            else:
                white[0, 0] = np.nan
                return white
        white[i, i] = 1.0 / lower[i, i]
        for j in range(i):
            total = 0.0
            for k in range(j, i):
                total -= lower[i, k] * white[k, j]
            white[i, j] = total / lower[i, i]
    return white


@njit(cache=True, nogil=True)
def filter_covariance(layout, size, step, mixing, noise):
    """Kalman filter of the covariances over n epochs.

    step (n,) is the time since the epoch before. Returns the transitions (n, s, 3, 3), gains
    transposed K^T (n, r, d), whiteners (n, r, r) of the innovations and covariances P (n, d, d).
    A whitener that is no number tells the epoch where V is not positive definite.
    """
    n, r, k = mixing.shape
    number = layout.states.size
    transitions = np.zeros((n, number, 3, 3))
    gains = np.zeros((n, r, size))
    whiteners = np.zeros((n, r, r))
    covariances = np.zeros((n, size, size))
    spread = np.zeros((number, 3, 3))
    fill_noise(layout, np.inf, spread)  # the stationary covariance
    p = np.zeros((size, size))
    for i in range(n):
        if i > 0:
            fill_transition(layout, step[i], transitions[i])
            fill_noise(layout, step[i], spread)
            p = carry_square(layout, transitions[i], p, False)
        add_blocks(layout, spread, p)
        seen = observe(layout.first, mixing[i], p)  # H P-
        innovation = observe(layout.first, mixing[i], seen.T.copy())
        prior = np.zeros(r)
        for m in range(r):
            prior[m] = noise[i, m, m]
            for j in range(k):
                prior[m] += mixing[i, m, j] ** 2
            for other in range(r):
                innovation[m, other] += noise[i, m, other]
        white = _whitener(innovation, prior)
        whiteners[i] = white
        if np.isnan(white[0, 0]):
            break
        gain = _across(white, _times(white, seen))  # K^T
        p = _joseph(layout.first, mixing[i], noise[i], p, gain, seen)
        gains[i] = gain
        covariances[i] = p
    return transitions, gains, whiteners, covariances


@njit(cache=True, nogil=True)
def _joseph(first, mixing, noise, p, gain, seen):
    """(I - K H) P- (I - K H)^T + K R K^T from K^T and H P-."""
    columns, wide = gain.T.copy(), seen.T.copy()
    _take(p, columns, wide)
    left = observe(first, mixing, p.T.copy())  # H [(I - K H) P-]^T, which R K^T balances
    _take(left, noise, columns)
    _take(p, left.T.copy(), columns)
    _even(p)
    return p


@njit(cache=True, nogil=True)
def filter_columns(layout, transitions, mixing, gains, whiteners, columns):
    """Filter columns of observations (n, r, c): whitened (n, r, c) and states x (n, d, c)."""
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
        whitened[i] = _times(whiteners[i], innovation)
        step = _across(gains[i], innovation)
        for a in range(x.shape[0]):
            for b in range(c):
                x[a, b] += step[a, b]
        states[i] = x
    return whitened, states


@njit(cache=True, nogil=True)
def smooth_columns(layout, transitions, mixing, gains, whiteners, whitened):
    """From whitened columns back: V^-1 c (n, r, c), and the adjoints a (n, d, c)."""
    n, r, c = whitened.shape
    a = np.zeros((gains.shape[2], c))
    adjoints = np.zeros((n, gains.shape[2], c))
    weights = np.zeros((n, r, c))
    for i in range(n - 1, -1, -1):
        adjoints[i] = a
        u = _across(whiteners[i], whitened[i])
        _take(u, gains[i], a.T.copy())
        weights[i] = u
        send_back(layout.first, mixing[i], u, a)
        if i > 0:
            carry(layout, transitions[i], a, True)
    return weights, adjoints


@njit(cache=True, nogil=True)
def smooth_covariance(layout, step, transitions, mixing, gains, whiteners, covariances):
    """The backward pass of N.

    Returns the diagonal blocks of V^-1 (n, r, r), K^T N (n, r, d), and the covariances of the
    smoothed states with themselves (n, d, d) and with those of the next epoch (n - 1, d, d).
    """
    n, r, _ = mixing.shape
    size = gains.shape[2]
    blocks = np.zeros((n, r, r))
    future = np.zeros((n, r, size))
    same = np.zeros((n, size, size))
    following = np.zeros((max(n - 1, 0), size, size))
    spread = np.zeros((layout.states.size, 3, 3))
    information = np.zeros((size, size))
    for i in range(n - 1, -1, -1):
        future[i] = _times(gains[i], information)
        weight = _across(whiteners[i], whiteners[i])  # S^-1
        blocks[i] = weight
        _take(blocks[i], -future[i], gains[i])
        same[i] = covariances[i]
        _take(same[i], _times(covariances[i], information), covariances[i])
        if i == 0:
            break
        send_back(layout.first, mixing[i], -future[i], information)  # (I - K H)^T N
        information = information.T.copy()
        back = observe(layout.first, mixing[i], np.eye(size))
        back = _times(weight, back)
        _take(back, gains[i], information.T.copy())
        send_back(layout.first, mixing[i], back, information)  # N-
        _even(information)
        fill_noise(layout, step[i], spread)
        predicted = carry_square(layout, transitions[i], covariances[i - 1], False)
        add_blocks(layout, spread, predicted)
        forward = covariances[i - 1].copy()
        carry(layout, transitions[i], forward, False)
        forward = forward.T.copy()  # P F^T
        following[i - 1] = forward
        _take(following[i - 1], _times(forward, information), predicted)
        information = carry_square(layout, transitions[i], information, True)
    return blocks, future, same, following


@njit(cache=True, nogil=True)
def precision_between(layout, transitions, mixing, gains, whiteners, future, early, late):
    """Block (r, r) of V^-1 at an early and a late epoch, walking from late to early."""
    y = np.zeros((gains.shape[2], gains.shape[1]))
    weight = _across(whiteners[late], whiteners[late])  # S^-1 + K^T N K
    _take(weight, -future[late], gains[late])
    send_back(layout.first, mixing[late], weight, y)
    for a in range(y.shape[0]):
        for m in range(y.shape[1]):
            y[a, m] -= future[late, m, a]
    for i in range(late, early, -1):
        if i < late:  # (I - K H)^T
            send_back(layout.first, mixing[i], -_times(gains[i], y), y)
        carry(layout, transitions[i], y, True)
    return -_times(gains[early], y)
