"""Rows that see the signals at an epoch or more, as sums over the states at knots.

A row is l = sum over its sides of B(t) f(t), plus A x, u of the target that it shares with other
rows, and noise. It is whitened by W with W R W^T = I, R the noise and what the knots leave.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit

from mlscorr.collocation._knots import Knots, knot_gains
from mlscorr.collocation._matrices import assign, whitening_root
from mlscorr.collocation._pattern import Pattern
from mlscorr.collocation._states import Layout
from mlscorr.collocation.markov import check_finite
from mlscorr.collocation.model import NOT_POSITIVE, Signal, signal_clocks
from mlscorr.collocation.noise import Noise


@dataclass(frozen=True)
class SparseRows:
    """Observations of r rows each, that see the signals at e epochs, their sides.

    A control target has one side and three rows, a tie two sides and one row: as ``Ties`` has its
    misclosure, the mixing of its first side is n^T P(t_1), that of the second -n^T P(t_2).

    Parameters
    ----------
    gps_time : (n, e) array
        In any order. Units: s.
    misclosure : (n, r) array
        Units: m.
    noise : Noise
    design : (n, r, p) array
        A. May have no column.
    signals : sequence of Signal
        With mixings (n e, r, k) and clocks (n e,) at the sides, those of an observation after each
        other. Of the same covariances wherever rows are solved together.
    """

    gps_time: np.ndarray
    misclosure: np.ndarray
    noise: Noise
    design: np.ndarray
    signals: Sequence[Signal]

    @property
    def epochs(self) -> tuple[np.ndarray, np.ndarray]:
        """Times (n e,) and clocks (n e, s) of all sides."""
        gps_time = np.asarray(self.gps_time, dtype=float).ravel()
        return gps_time, signal_clocks(self.signals, gps_time)

    @property
    def mixing(self) -> np.ndarray:
        """Mixings (n, e, r, k) of all signals."""
        n, r = np.shape(self.misclosure)
        shape = (n, np.shape(self.gps_time)[1], r)
        parts = [signal.mixing.reshape(*shape, signal.mixing.shape[-1]) for signal in self.signals]
        if len(parts) == 1:  # without a copy: it is most of what many ties hold
            return np.ascontiguousarray(parts[0], dtype=float)
        return np.concatenate([np.zeros((*shape, 0)), *parts], axis=3)


class Sides(NamedTuple):
    """What n observations of r rows each see of the states.

    Parameters
    ----------
    cell : (n, e) int array
        Of the knots, for each side.
    gains : (n, e, s, 2 d) array
        Of the states at the knots about it.
    mixing : (n, e, r, k) array
    unknown : (n,) int array
        Node of the shared error, -1 for none.
    sigma : (n, r) array
        Of the shared error.
    remaining : (n, e, s) array
        Variance of what the knots leave of each signal.
    white : (n, r, r) array
        W.
    """

    cell: np.ndarray
    gains: np.ndarray
    mixing: np.ndarray
    unknown: np.ndarray
    sigma: np.ndarray
    remaining: np.ndarray
    white: np.ndarray

    @classmethod
    def of(cls, rows: SparseRows, layout: Layout, knots: Knots, nodes: int) -> Sides:
        """What rows see of the states at knots.

        Parameters
        ----------
        rows : SparseRows
        layout : Layout
        knots : Knots
        nodes : int
            Number of the first node for errors that they share.
        """
        gps_time, clocks = rows.epochs
        mixing, noise, (n, e) = rows.mixing, rows.noise, rows.gps_time.shape
        own = noise.separate
        check_finite(rows.gps_time[:, 0], rows.gps_time, rows.misclosure, own, rows.design, mixing)
        cell = np.searchsorted(knots.times, gps_time, side="right")
        order = np.argsort(cell, kind="stable")
        gains, remaining = knot_gains(layout, knots, cell, clocks, order)
        unknown = np.full(n, -1)
        sigma = np.zeros(rows.misclosure.shape)
        if len(noise.repeated):
            number = np.searchsorted(noise.repeated[:-1], noise.group)
            unknown = np.where(noise.repeated[number] == noise.group, nodes + number, -1)
            sigma = noise.shared[noise.group].astype(float)
        parts = gains.reshape(n, e, *gains.shape[1:]), mixing, unknown, sigma
        sides = cls(cell.reshape(n, e), *parts, remaining.reshape(n, e, clocks.shape[1]), own)
        return sides.whitened(layout, own)

    def placed(self, place: np.ndarray) -> Sides:
        """The same with nodes in the order of elimination.

        Parameters
        ----------
        place : (k,) int array
            Of each node.
        """
        return self._replace(unknown=np.append(place, -1)[self.unknown])  # -1 stays

    def whitened(self, layout: Layout, separate: np.ndarray) -> Sides:
        """The same with another noise that each observation has alone.

        Parameters
        ----------
        layout : Layout
        separate : (n, r, r) array

        Raises
        ------
        ValueError
            Where it is not positive definite.
        """
        own = np.ascontiguousarray(separate, dtype=float)
        white = whiteners(layout, self.mixing, self.remaining, own)
        if np.isnan(white).any():
            raise ValueError(NOT_POSITIVE.format(self.sigma.size))
        return self._replace(white=white)


def check_same(
    sizes: np.ndarray, pattern: Pattern, sides: Sequence[Sides], known: Sequence[Sides]
) -> None:
    """Refuse rows that see other states than those whose knots they should use.

    Parameters
    ----------
    sizes : (k,) int array
        Number of states of each node that the rows see.
    pattern : Pattern
        Of the others.
    sides, known : sequences of Sides
        Of the rows, and of the others.
    """
    same = np.array_equal(sizes, np.diff(pattern.first)[pattern.place]) and len(sides) == len(known)
    for here, there in zip(sides, known, strict=False):
        same = same and np.array_equal(here.cell, there.cell)
        same = same and np.array_equal(here.unknown, there.unknown)
    if not same:
        raise ValueError(
            f"The {sum(len(part.cell) for part in sides)} observations see other epochs, shared "
            "errors or states than those of the solution whose knots they should use. Leave "
            "``like`` out."
        )


@njit(cache=True, nogil=True)
def whiteners(
    layout: Layout, mixing: np.ndarray, remaining: np.ndarray, own: np.ndarray
) -> np.ndarray:
    """W of noise and of what the knots leave; not a number where that is not positive definite.

    Parameters
    ----------
    layout : Layout
    mixing, remaining : (n, e, r, k), (n, e, s) array
    own : (n, r, r) array
    """
    white = np.zeros(own.shape)
    for i in range(own.shape[0]):
        total = own[i].copy()
        for e in range(mixing.shape[1]):
            for j in range(mixing.shape[3]):
                variance = remaining[i, e, layout.signal[j]]
                for m in range(total.shape[0]):
                    for other in range(total.shape[0]):
                        weight = mixing[i, e, m, j] * mixing[i, e, other, j]
                        total[m, other] += variance * weight
        assign(white[i], whitening_root(total, np.diag(total)))
    return white
