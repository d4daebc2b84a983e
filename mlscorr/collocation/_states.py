"""States of all signals' processes, their transition in time and their observation.

H, which observes them, is B (mixing) on the first state of each process; F and Q have one block for
each process. None of them is ever stored as a full matrix.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from mlscorr.collocation.covariance import process_noise, transition
from mlscorr.compiled_loops import loop

if TYPE_CHECKING:
    from mlscorr.collocation.model import Signal


class Layout(NamedTuple):
    """Positions of the states of k processes of s signals among all d states.

    Parameters
    ----------
    first, signal : (k,) int array
        First state of each process, and index of its signal.
    states, kinds : (s,) int array
        Number of states of a process, and number of its covariance family.
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
        """Make the layout of Signals."""
        states = np.array([s.covariance.states for s in signals], dtype=np.int64)
        count = np.array([s.mixing.shape[2] for s in signals], dtype=np.int64)
        signal = np.repeat(np.arange(len(signals)), count)
        first = np.concatenate([[0], np.cumsum(states[signal])[:-1]])[: len(signal)]
        rates = np.array([s.covariance.rate for s in signals], dtype=float)
        kinds = np.array([s.covariance.kind for s in signals], dtype=np.int64)
        return cls(first.astype(np.int64), signal.astype(np.int64), states, kinds, rates)

    @property
    def size(self) -> int:
        """Total number of states."""
        return int(self.states[self.signal].sum())


@loop
def fill_transition(layout: Layout, spans: np.ndarray, out: np.ndarray) -> None:
    """Compute F of each signal over n spans of its clock, in place.

    Parameters
    ----------
    layout : Layout
    spans : (n, s) array
        Units: s.
    out : (n, s, 3, 3) array
    """
    for i in range(spans.shape[0]):
        for s in range(spans.shape[1]):
            f = transition(layout.kinds[s], spans[i, s] * layout.rates[s])
            for k in range(9):
                out[i, s, k // 3, k % 3] = f[k]


@loop
def fill_noise(layout: Layout, spans: np.ndarray, out: np.ndarray) -> None:
    """Compute Q of each signal over n spans of its clock, in place.

    Parameters
    ----------
    layout : Layout
    spans : (n, s) array
        Units: s.
    out : (n, s, 3, 3) array
    """
    for i in range(spans.shape[0]):
        for s in range(spans.shape[1]):
            q = process_noise(layout.kinds[s], spans[i, s] * layout.rates[s])
            k = 0
            for a in range(3):
                for b in range(a, 3):
                    out[i, s, a, b] = out[i, s, b, a] = q[k]
                    k += 1


@loop
def carry(layout: Layout, blocks: np.ndarray, x: np.ndarray, transposed: bool) -> None:
    """Replace x by F x, or by F^T x.

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
        s = layout.signal[j]
        states = layout.states[s]
        f00 = blocks[s, 0, 0]
        f01 = blocks[s, 0, 1]
        f02 = blocks[s, 0, 2]
        f10 = blocks[s, 1, 0]
        f11 = blocks[s, 1, 1]
        f12 = blocks[s, 1, 2]
        f20 = blocks[s, 2, 0]
        f21 = blocks[s, 2, 1]
        f22 = blocks[s, 2, 2]
        if transposed:
            f01, f10 = f10, f01
            f02, f20 = f20, f02
            f12, f21 = f21, f12
        for c in range(x.shape[1]):  # unrolled: twice as fast as loops over the states
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


def dense_blocks(layout: Layout, blocks: np.ndarray) -> np.ndarray:
    """Matrices (n, d, d) with the blocks of each process on their diagonals.

    Parameters
    ----------
    layout : Layout
    blocks : (n, s, 3, 3) array
        Block of each signal.
    """
    out = np.zeros((len(blocks), layout.size, layout.size))
    for first, signal in zip(layout.first, layout.signal, strict=True):
        d = layout.states[signal]
        out[:, first : first + d, first : first + d] = blocks[:, signal, :d, :d]
    return out
