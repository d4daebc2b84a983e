"""The states of all signals' processes, and how time carries and observations see them.

H, which observes them, is B (mixing) on the first state of each process; F and Q are blocks, one
for each process. None of them is ever written out.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numba import njit

from mlscorr.collocation.covariance import process_noise, transition
from mlscorr.compiled_loops import LOOP

if TYPE_CHECKING:
    from mlscorr.collocation.model import Signal


class Layout(NamedTuple):
    """Where the states of k processes of s signals stand in the d states of all.

    Parameters
    ----------
    first, signal : (k,) int array
        First state of each process, and its signal.
    states, kinds : (s,) int array
        Number of states of a process, and that of its covariance family.
    rates : (s,) array
        Units: 1/s.
    """

    first: np.ndarray
    signal: np.ndarray
    states: np.ndarray
    kinds: np.ndarray
    rates: np.ndarray

    @classmethod
    def of(cls, signals: Sequence[Signal]) -> Layout:
        """The layout of Signals."""
        states = np.array([s.covariance.states for s in signals], dtype=np.int64)
        count = np.array([s.mixing.shape[2] for s in signals], dtype=np.int64)
        signal = np.repeat(np.arange(len(signals)), count)
        first = np.concatenate([[0], np.cumsum(states[signal])[:-1]])[: len(signal)]
        rates = np.array([s.covariance.rate for s in signals], dtype=float)
        kinds = np.array([s.covariance.kind for s in signals], dtype=np.int64)
        return cls(first.astype(np.int64), signal.astype(np.int64), states, kinds, rates)

    @property
    def size(self) -> int:
        """Number of states in all."""
        return int(self.states[self.signal].sum())


@njit(**LOOP)
def fill_transition(layout: Layout, spans: np.ndarray, out: np.ndarray) -> None:
    """F of each signal over a span of its clock.

    Parameters
    ----------
    layout : Layout
    spans : (s,) array
        Units: s.
    out : (s, 3, 3) array
    """
    for s in range(layout.states.size):
        f = transition(layout.kinds[s], spans[s] * layout.rates[s])
        for k in range(9):
            out[s, k // 3, k % 3] = f[k]


@njit(**LOOP)
def fill_noise(layout: Layout, spans: np.ndarray, out: np.ndarray) -> None:
    """Q of each signal over a span of its clock.

    Parameters
    ----------
    layout : Layout
    spans : (s,) array
        Units: s.
    out : (s, 3, 3) array
    """
    for s in range(layout.states.size):
        q = process_noise(layout.kinds[s], spans[s] * layout.rates[s])
        out[s, 0, 0] = q[0]
        out[s, 0, 1] = q[1]
        out[s, 0, 2] = q[2]
        out[s, 1, 0] = q[1]
        out[s, 1, 1] = q[3]
        out[s, 1, 2] = q[4]
        out[s, 2, 0] = q[2]
        out[s, 2, 1] = q[4]
        out[s, 2, 2] = q[5]


@njit(**LOOP)
def carry(layout: Layout, blocks: np.ndarray, x: np.ndarray, transposed: bool) -> None:
    """X <- F x, or F^T x, in place.

    Parameters
    ----------
    layout : Layout
    blocks : (s, 3, 3) array
        F of each signal.
    x : (d, c) array
    transposed : bool
    """
    for j in range(layout.first.size):
        a = layout.first[j]
        f = blocks[layout.signal[j]]
        states = layout.states[layout.signal[j]]
        f01, f10 = (f[1, 0], f[0, 1]) if transposed else (f[0, 1], f[1, 0])
        f02, f20 = (f[2, 0], f[0, 2]) if transposed else (f[0, 2], f[2, 0])
        f12, f21 = (f[2, 1], f[1, 2]) if transposed else (f[1, 2], f[2, 1])
        f00 = f[0, 0]
        f11 = f[1, 1]
        f22 = f[2, 2]
        for c in range(x.shape[1]):
            x0 = x[a, c]
            if states == 1:
                x[a, c] = f00 * x0
            elif states == 2:
                x1 = x[a + 1, c]
                x[a, c] = f00 * x0 + f01 * x1
                x[a + 1, c] = f10 * x0 + f11 * x1
            else:
                x1 = x[a + 1, c]
                x2 = x[a + 2, c]
                x[a, c] = f00 * x0 + f01 * x1 + f02 * x2
                x[a + 1, c] = f10 * x0 + f11 * x1 + f12 * x2
                x[a + 2, c] = f20 * x0 + f21 * x1 + f22 * x2


@njit(**LOOP)
def carry_square(layout: Layout, blocks: np.ndarray, x: np.ndarray, transposed: bool) -> np.ndarray:
    """F x F^T, or F^T x F, of a symmetric x; a new array.

    Parameters
    ----------
    layout : Layout
    blocks : (s, 3, 3) array
        F of each signal.
    x : (d, d) array
    transposed : bool
    """
    half = x.copy()
    carry(layout, blocks, half, transposed)
    whole = half.T.copy()
    carry(layout, blocks, whole, transposed)
    return whole


@njit(**LOOP)
def add_blocks(layout: Layout, blocks: np.ndarray, x: np.ndarray) -> None:
    """Add each process's block of states to the diagonal of x.

    Parameters
    ----------
    layout : Layout
    blocks : (s, 3, 3) array
    x : (d, d) array
    """
    for j in range(layout.first.size):
        a = layout.first[j]
        states = layout.states[layout.signal[j]]
        for p in range(states):
            for q in range(states):
                x[a + p, a + q] += blocks[layout.signal[j], p, q]


@njit(**LOOP)
def observe(first: np.ndarray, mixing: np.ndarray, x: np.ndarray) -> np.ndarray:
    """H x of states: (r, c).

    Parameters
    ----------
    first : (k,) int array
    mixing : (r, k) array
    x : (d, c) array
    """
    out = np.zeros((mixing.shape[0], x.shape[1]))
    for m in range(mixing.shape[0]):
        for j in range(first.size):
            for c in range(x.shape[1]):
                out[m, c] += mixing[m, j] * x[first[j], c]
    return out


@njit(**LOOP)
def send_back(first: np.ndarray, mixing: np.ndarray, y: np.ndarray, x: np.ndarray) -> None:
    """X <- x + H^T y, in place.

    Parameters
    ----------
    first : (k,) int array
    mixing : (r, k) array
    y : (r, c) array
    x : (d, c) array
    """
    for m in range(mixing.shape[0]):
        for j in range(first.size):
            for c in range(x.shape[1]):
                x[first[j], c] += mixing[m, j] * y[m, c]
