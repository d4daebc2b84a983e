"""Markov recursion: V^-1 of all observations in one forward and one backward pass.

The forward pass is the Kalman filter, whose innovations are the whitened observations. The backward
pass uses the adjoints of de Jong 1989 (J. Am. Stat. Assoc. 84, 1085-1088), which need no inverse of
a state's covariance, so that two targets one millisecond apart do no harm:

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

from mlscorr.collocation._matrices import whitening_root
from mlscorr.collocation._states import (
    Layout,
    carry,
    dense_blocks,
    fill_noise,
    fill_transition,
)
from mlscorr.compiled_loops import loop


class Recursion(NamedTuple):
    """Factor of V0 of n epochs, as passed to the compiled loops.

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


def filter_covariance(
    layout: Layout, size: int, steps: np.ndarray, mixing: np.ndarray, noise: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Run the Kalman filter of the covariances over n epochs.

    Parameters
    ----------
    layout : Layout
    size : int
        Number d of states.
    steps : (n, s) array
        Times since the previous epoch, by each signal's clock.
    mixing, noise : (n, r, k), (n, r, r) array

    Returns
    -------
    transitions : (n, s, 3, 3) array
    gains : (n, r, d) array
        K^T.
    whiteners : (n, r, r) array
        Of the innovations; NaN at the epoch where V is not positive definite.
    covariances : (n, d, d) array
        P.
    """
    n, r, _ = mixing.shape
    spans = steps.copy()
    spans[:1] = np.inf  # start from the stationary covariance
    transitions = np.zeros((*steps.shape, 3, 3))
    spread = np.zeros_like(transitions)
    fill_transition(layout, spans, transitions)
    fill_noise(layout, spans, spread)
    transitions[:1] = 0.0
    filtered = np.zeros((n, r, size)), np.zeros((n, r, r)), np.zeros((n, size, size))
    _filter_covariance(layout, transitions, spread, mixing, noise, *filtered)
    return transitions, *filtered


@loop
def _filter_covariance(layout, transitions, spread, mixing, noise, gains, whiteners, covariances):
    """Compute K^T, whiteners and P in place; NaN from the first epoch where V is not positive
    definite.
    """
    n, r, k = mixing.shape
    size = gains.shape[2]
    first = layout.first
    p = np.zeros((size, size))
    half = np.zeros((size, size))
    observed = np.zeros((r, size))  # H P-
    left = np.zeros((r, size))
    innovation = np.zeros((r, r))
    prior = np.zeros(r)
    for i in range(n):
        carry(layout, transitions[i], p, False)
        for a in range(size):
            for b in range(size):
                half[a, b] = p[b, a]
        carry(layout, transitions[i], half, False)
        for a in range(size):
            for b in range(size):
                p[a, b] = half[a, b]
        for j in range(k):
            s = layout.signal[j]
            for a in range(layout.states[s]):
                for b in range(layout.states[s]):
                    p[first[j] + a, first[j] + b] += spread[i, s, a, b]
        for m in range(r):
            for b in range(size):
                observed[m, b] = 0.0
            prior[m] = noise[i, m, m]
            for j in range(k):
                weight = mixing[i, m, j]
                prior[m] += weight**2
                for b in range(size):
                    observed[m, b] += weight * p[first[j], b]
        for m in range(r):
            for other in range(r):
                total = noise[i, m, other]
                for j in range(k):
                    total += mixing[i, m, j] * observed[other, first[j]]
                innovation[m, other] = total
        white = whitening_root(innovation, prior)
        for m in range(r):
            for other in range(r):
                whiteners[i, m, other] = white[m, other]
        if np.isnan(white[0, 0]):
            break
        for m in range(r):  # K^T = S^-1 H P-
            for b in range(size):
                left[m, b] = 0.0
            for other in range(m + 1):
                for b in range(size):
                    left[m, b] += white[m, other] * observed[other, b]
            for other in range(m + 1):
                for b in range(size):
                    gains[i, other, b] += white[m, other] * left[m, b]
        # (I - K H) P- (I - K H)^T + K R K^T
        for m in range(r):
            for a in range(size):
                for b in range(size):
                    p[a, b] -= gains[i, m, a] * observed[m, b]
        for m in range(r):  # H [(I - K H) P-]^T, which R K^T balances
            for b in range(size):
                left[m, b] = 0.0
                for j in range(k):
                    left[m, b] += mixing[i, m, j] * p[b, first[j]]
            for other in range(r):
                for b in range(size):
                    left[m, b] -= noise[i, m, other] * gains[i, other, b]
        for m in range(r):
            for a in range(size):
                for b in range(size):
                    p[a, b] -= left[m, a] * gains[i, m, b]
        for a in range(size):
            for b in range(a + 1):
                mean = 0.5 * (p[a, b] + p[b, a])
                p[a, b] = mean
                p[b, a] = mean
                covariances[i, a, b] = mean
                covariances[i, b, a] = mean


@loop
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
    n, r, width = columns.shape
    size = gains.shape[2]
    x = np.zeros((size, width))
    states = np.zeros((n, size, width))
    whitened = np.zeros((n, r, width))
    innovation = np.zeros((r, width))
    for i in range(n):
        carry(layout, transitions[i], x, False)
        for m in range(r):
            for c in range(width):
                innovation[m, c] = columns[i, m, c]
            for j in range(layout.first.size):
                for c in range(width):
                    innovation[m, c] -= mixing[i, m, j] * x[layout.first[j], c]
            for other in range(m + 1):
                for c in range(width):
                    whitened[i, m, c] += whiteners[i, m, other] * innovation[other, c]
        for m in range(r):
            for a in range(size):
                for c in range(width):
                    x[a, c] += gains[i, m, a] * innovation[m, c]
        for a in range(size):
            for c in range(width):
                states[i, a, c] = x[a, c]
    return whitened, states


@loop
def smooth_columns(recursion: Recursion, whitened: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Smooth whitened columns in the backward pass.

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
    n, r, width = whitened.shape
    size = gains.shape[2]
    x = np.zeros((size, width))
    adjoints = np.zeros((n, size, width))
    weights = np.zeros((n, r, width))
    for i in range(n - 1, -1, -1):
        for a in range(size):
            for c in range(width):
                adjoints[i, a, c] = x[a, c]
        for m in range(r):
            for other in range(m, r):
                for c in range(width):
                    weights[i, m, c] += whiteners[i, other, m] * whitened[i, other, c]
            for a in range(size):
                for c in range(width):
                    weights[i, m, c] -= gains[i, m, a] * adjoints[i, a, c]
            for j in range(layout.first.size):
                for c in range(width):
                    x[layout.first[j], c] += mixing[i, m, j] * weights[i, m, c]
        carry(layout, transitions[i], x, True)
    return weights, adjoints


def smooth_covariance(
    recursion: Recursion, steps: np.ndarray, covariances: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Run the backward pass of N.

    Parameters
    ----------
    recursion : Recursion
    steps, covariances : (n, s), (n, d, d) array
        See filter_covariance.

    Returns
    -------
    blocks : (n, r, r) array
        On the diagonal of V^-1.
    same, following : (n, d, d), (n - 1, d, d) array
        Covariances of the smoothed states, and with those of the next epoch.
    """
    layout, transitions, mixing, gains, whiteners = recursion
    n, _, size = gains.shape
    f = dense_blocks(layout, transitions)
    observer = np.zeros((n, mixing.shape[1], size))  # H
    observer[:, :, layout.first] = mixing
    precision = whiteners.swapaxes(1, 2) @ whiteners  # S^-1
    reduction = np.eye(size) - gains.swapaxes(1, 2) @ observer  # I - K H
    added = observer.swapaxes(1, 2) @ precision @ observer  # H^T S^-1 H
    backward = f.swapaxes(1, 2)
    information = _carried_back(reduction @ f, backward @ added @ f)  # N
    blocks = precision + gains @ information @ gains.swapaxes(1, 2)
    same = covariances - covariances @ information @ covariances
    spread = np.zeros_like(transitions[1:])
    fill_noise(layout, steps[1:], spread)
    forward = covariances[:-1] @ backward[1:]  # P F^T
    predicted = f[1:] @ forward + dense_blocks(layout, spread)
    updated = reduction[1:].swapaxes(1, 2) @ information[1:] @ reduction[1:] + added[1:]  # N-
    following = forward - forward @ updated @ predicted
    return blocks, same, following


@loop
def _carried_back(steps, gained):
    """N of all epochs (n, d, d) by N <- C^T N C + G, from C and G of the step to each epoch."""
    n, d, _ = steps.shape
    out = np.zeros((n, d, d))
    half = np.zeros((d, d))
    for i in range(n - 1, 0, -1):
        for a in range(d):
            for b in range(d):
                half[a, b] = 0.0
                out[i - 1, a, b] = gained[i, a, b]
            for k in range(d):
                for b in range(d):
                    half[a, b] += out[i, a, k] * steps[i, k, b]
        for a in range(d):
            for k in range(d):
                for b in range(d):
                    out[i - 1, a, b] += steps[i, k, a] * half[k, b]
        for a in range(d):  # exactly symmetric
            for b in range(a):
                mean = 0.5 * (out[i - 1, a, b] + out[i - 1, b, a])
                out[i - 1, a, b] = mean
                out[i - 1, b, a] = mean
    return out
