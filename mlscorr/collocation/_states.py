"""The states of all signals' processes, and how time carries and observations see them.

H, which observes them, is B (mixing) on the first state of each process; F and Q are blocks, one
for each process. None of them is ever written out.
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


@loop
def fill_transition(layout: Layout, spans: np.ndarray, out: np.ndarray) -> None:
    """F of each signal over n spans of its clock.

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
    """Q of each signal over n spans of its clock.

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
        s = layout.signal[j]
        d = layout.states[s]
        for c in range(x.shape[1]):
            x0 = x[a, c]
            x1 = x[a + 1, c] if d > 1 else 0.0
            x2 = x[a + 2, c] if d > 2 else 0.0
            for p in range(d):
                if transposed:
                    x[a + p, c] = blocks[s, 0, p] * x0 + blocks[s, 1, p] * x1 + blocks[s, 2, p] * x2
                else:
                    x[a + p, c] = blocks[s, p, 0] * x0 + blocks[s, p, 1] * x1 + blocks[s, p, 2] * x2


def dense_blocks(layout: Layout, blocks: np.ndarray) -> np.ndarray:
    """Matrices (n, d, d) with the blocks of each process on their diagonals.

    Parameters
    ----------
    layout : Layout
    blocks : (n, s, 3, 3) array
        Of each signal.
    """
    out = np.zeros((len(blocks), layout.size, layout.size))
    for first, signal in zip(layout.first, layout.signal, strict=True):
        d = layout.states[signal]
        out[:, first : first + d, first : first + d] = blocks[:, signal, :d, :d]
    return out
