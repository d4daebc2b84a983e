"""The states of all signals' processes, and how time carries and observations see them.

H, which observes them, is B (mixing) on the first state of each process; F and Q are blocks, one
for each process. None of them is ever written out.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from mlscorr.covariance import process_noise, transition


class Layout(NamedTuple):
    """Where the states of k processes of s signals stand in the d states of all."""

    first: np.ndarray  # (k,) first state of each process
    signal: np.ndarray  # (k,) its signal
    states: np.ndarray  # (s,) number of states of a process
    rates: np.ndarray  # (s,) 1/s

    @classmethod
    def of(cls, signals):
        """The layout of Signals."""
        states = np.array([s.covariance.states for s in signals], dtype=np.int64)
        count = np.array([s.mixing.shape[2] for s in signals], dtype=np.int64)
        signal = np.repeat(np.arange(len(signals)), count)
        first = np.concatenate([[0], np.cumsum(states[signal])[:-1]])[: len(signal)]
        rates = np.array([s.covariance.rate for s in signals], dtype=float)
        return cls(first.astype(np.int64), signal.astype(np.int64), states, rates)

    @property
    def size(self):
        """Number of states in all."""
        return int(self.states[self.signal].sum())


@njit(cache=True, nogil=True)
def fill_transition(layout, span, out):
    """F of each signal over a span of time (s) into out (s, 3, 3)."""
    for s in range(layout.states.size):
        f = transition(layout.states[s], span * layout.rates[s])
        out[s, 0, 0], out[s, 0, 1], out[s, 0, 2] = f[0], f[1], f[2]
        out[s, 1, 0], out[s, 1, 1], out[s, 1, 2] = f[3], f[4], f[5]
        out[s, 2, 0], out[s, 2, 1], out[s, 2, 2] = f[6], f[7], f[8]


@njit(cache=True, nogil=True)
def fill_noise(layout, span, out):
    """Q of each signal over a span of time (s) into out (s, 3, 3)."""
    for s in range(layout.states.size):
        q = process_noise(layout.states[s], span * layout.rates[s])
        out[s, 0, 0], out[s, 0, 1], out[s, 0, 2] = q[0], q[1], q[2]
        out[s, 1, 0], out[s, 1, 1], out[s, 1, 2] = q[1], q[3], q[4]
        out[s, 2, 0], out[s, 2, 1], out[s, 2, 2] = q[2], q[4], q[5]


@njit(cache=True, nogil=True)
def carry(layout, blocks, x, transposed):
    """x <- F x, or F^T x, in place; x (d, c)."""
    for j in range(layout.first.size):
        a = layout.first[j]
        f = blocks[layout.signal[j]]
        states = layout.states[layout.signal[j]]
        f01, f10 = (f[1, 0], f[0, 1]) if transposed else (f[0, 1], f[1, 0])
        f02, f20 = (f[2, 0], f[0, 2]) if transposed else (f[0, 2], f[2, 0])
        f12, f21 = (f[2, 1], f[1, 2]) if transposed else (f[1, 2], f[2, 1])
        f00, f11, f22 = f[0, 0], f[1, 1], f[2, 2]
        for c in range(x.shape[1]):
            x0 = x[a, c]
            if states == 1:
                x[a, c] = f00 * x0
            elif states == 2:
                x1 = x[a + 1, c]
                x[a, c] = f00 * x0 + f01 * x1
                x[a + 1, c] = f10 * x0 + f11 * x1
            else:
                x1, x2 = x[a + 1, c], x[a + 2, c]
                x[a, c] = f00 * x0 + f01 * x1 + f02 * x2
                x[a + 1, c] = f10 * x0 + f11 * x1 + f12 * x2
                x[a + 2, c] = f20 * x0 + f21 * x1 + f22 * x2


@njit(cache=True, nogil=True)
def carry_square(layout, blocks, x, transposed):
    """F x F^T, or F^T x F, of a symmetric x (d, d); a new array."""
    half = x.copy()
    carry(layout, blocks, half, transposed)
    whole = half.T.copy()
    carry(layout, blocks, whole, transposed)
    return whole


@njit(cache=True, nogil=True)
def add_blocks(layout, blocks, x):
    """Add each process's block of states to the diagonal of x (d, d)."""
    for j in range(layout.first.size):
        a = layout.first[j]
        states = layout.states[layout.signal[j]]
        for p in range(states):
            for q in range(states):
                x[a + p, a + q] += blocks[layout.signal[j], p, q]


@njit(cache=True, nogil=True)
def observe(first, mixing, x):
    """H x of states x (d, c): (r, c)."""
    out = np.zeros((mixing.shape[0], x.shape[1]))
    for m in range(mixing.shape[0]):
        for j in range(first.size):
            for c in range(x.shape[1]):
                out[m, c] += mixing[m, j] * x[first[j], c]
    return out


@njit(cache=True, nogil=True)
def send_back(first, mixing, y, x):
    """x <- x + H^T y, in place; y (r, c), x (d, c)."""
    for m in range(mixing.shape[0]):
        for j in range(first.size):
            for c in range(x.shape[1]):
                x[first[j], c] += mixing[m, j] * y[m, c]
