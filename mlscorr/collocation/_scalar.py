"""The Markov recursion for scalar observations, which keeps no states."""

import numpy as np
from numba import njit

from mlscorr.collocation._recursion import Recursion
from mlscorr.collocation._states import carry


@njit(cache=True, nogil=True)
def whiten_columns(
    recursion: Recursion, columns: np.ndarray, out: np.ndarray, inverse: bool = False
) -> None:
    """Whiten columns by the filter of scalar observations, without keeping its states.

    Parameters
    ----------
    recursion : Recursion
        Without the axis of observations: mixing (n, k), gains (n, d), whiteners (n,).
    columns, out : (n, c) array
    inverse : bool
        Give white columns the covariance V0 instead.
    """
    layout, transitions, mixing, gains, whiteners = recursion
    n, c = columns.shape
    x = np.zeros((gains.shape[1], c))
    innovation = np.empty(c)
    for i in range(n):
        if i > 0:
            carry(layout, transitions[i], x, False)
        out[i] = 0.0
        for j in range(layout.first.size):
            for b in range(c):
                out[i, b] += mixing[i, j] * x[layout.first[j], b]
        for b in range(c):
            innovation[b] = columns[i, b] / whiteners[i] if inverse else columns[i, b] - out[i, b]
            out[i, b] = out[i, b] + innovation[b] if inverse else innovation[b] * whiteners[i]
        for a in range(x.shape[0]):
            for b in range(c):
                x[a, b] += gains[i, a] * innovation[b]


@njit(cache=True, nogil=True)
def common_innovations(shared: np.ndarray, columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Innovations where observations have unit errors in common.

    Recursive least squares: the errors are estimated from all earlier observations.

    Parameters
    ----------
    shared : (n, c) array
        By which the errors enter white observations.
    columns : (n, k) array
        White but for these errors.

    Returns
    -------
    innovations : (n, k) array
    growth : (n,) array
        Of their sigma by what isn't known of the errors.
    """
    n, k = columns.shape
    c = shared.shape[1]
    p = np.eye(c)
    x = np.zeros((c, k))
    u = np.empty((n, k))
    growth = np.empty(n)
    for i in range(n):
        known = np.flatnonzero(shared[i])
        gain = np.zeros(c)
        for a in known:
            for b in range(c):
                gain[b] += shared[i, a] * p[a, b]
        s = 1.0
        for a in known:
            s += shared[i, a] * gain[a]
        growth[i] = np.sqrt(s)
        touched = np.flatnonzero(gain)
        for b in range(k):
            v = columns[i, b]
            for a in known:
                v -= shared[i, a] * x[a, b]
            u[i, b] = v / growth[i]
            for a in touched:
                x[a, b] += gain[a] * v / s
        for a in touched:
            for b in touched:
                p[a, b] -= gain[a] * gain[b] / s
    return u, growth
