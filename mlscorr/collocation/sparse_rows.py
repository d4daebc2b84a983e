"""Rows that observe the signals at one or more epochs, as sums over the states at knots.

A row is l = sum over its sides of B(t) f(t), plus A x, an error u shared with other rows of the
target, and noise. It is whitened by W with W R W^T = I, where R is the noise and the interpolation
error between knots. H, which observes the states, is never stored: each loop over rows expands W H
of the current observation, about a dozen nonzero columns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from mlscorr.collocation._knots import Knots, knot_gains
from mlscorr.collocation._matrices import assign, whitening_root
from mlscorr.collocation._pattern import Pattern, locate, panel_width
from mlscorr.collocation._states import Layout
from mlscorr.collocation.markov import check_finite
from mlscorr.collocation.model import NOT_POSITIVE, Noise, Signal, signal_clocks
from mlscorr.compiled_loops import loop


@dataclass(frozen=True)
class SparseRows:
    """Observations of r rows each, which depend on the signals at e epochs, their sides.

    A control target has one side and three rows, a tie two sides and one row. With the misclosure
    of ``Ties``, the mixing of its first side is n^T P(t_1), that of the second -n^T P(t_2).

    Parameters
    ----------
    gps_time : (n, e) array
        In any order. Units: s.
    misclosure : (n, r) array
        Units: m.
    noise : Noise
    design : (n, r, p) array
        A. May have zero columns.
    signals : sequence of Signal
        With mixings (n e, r, k) and clocks (n e,) at the sides, those of an observation in
        sequence. Rows that are solved together must have the same covariances.
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
        if len(parts) == 1:  # no copy, because many ties take most memory here
            return np.ascontiguousarray(parts[0], dtype=float)
        return np.concatenate([np.zeros((*shape, 0)), *parts], axis=3)


class Sides(NamedTuple):
    """Dependence of n observations of r rows each on the states.

    Parameters
    ----------
    cell : (n, e) int array
        Cell of the knots, for each side.
    gains : (n, e, s, 2 d) array
        Gains of the states at the two adjacent knots.
    mixing : (n, e, r, k) array
    unknown : (n,) int array
        Node of the shared error, -1 for none.
    sigma : (n, r) array
        Sigmas of the shared error.
    remaining : (n, e, s) array
        Variance of each signal's interpolation error between knots.
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
        """Make the sides of rows for states at knots.

        Parameters
        ----------
        rows : SparseRows
        layout : Layout
        knots : Knots
        nodes : int
            Index of the first node for shared errors.
        """
        gps_time, clocks = rows.epochs
        mixing = rows.mixing
        noise = rows.noise
        n, e = rows.gps_time.shape
        own = noise.separate
        check_finite(rows.gps_time[:, 0], rows.gps_time, rows.misclosure, own, rows.design, mixing)
        cell = np.searchsorted(knots.times, gps_time, side="right")
        gains, remaining = knot_gains(layout, knots, cell, clocks)
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
        """Return the sides with nodes in the order of elimination.

        Parameters
        ----------
        place : (k,) int array
            Position of each node.
        """
        return self._replace(unknown=np.append(place, -1)[self.unknown])  # -1 is kept

    def whitened(self, layout: Layout, separate: np.ndarray) -> Sides:
        """Return the sides with another independent noise of each observation.

        Parameters
        ----------
        layout : Layout
        separate : (n, r, r) array

        Raises
        ------
        ValueError
            If it is not positive definite.
        """
        own = np.ascontiguousarray(separate, dtype=float)
        white = whiteners(layout, self.mixing, self.remaining, own)
        if np.isnan(white).any():
            raise ValueError(NOT_POSITIVE.format(self.sigma.size))
        return self._replace(white=white)


def check_same(
    sizes: np.ndarray, pattern: Pattern, sides: Sequence[Sides], known: Sequence[Sides]
) -> None:
    """Refuse rows that depend on other states than those whose knots they should use.

    Parameters
    ----------
    sizes : (k,) int array
        Number of states of each node that the rows depend on.
    pattern : Pattern
        Pattern of the other rows.
    sides, known : sequences of Sides
        Sides of these rows, and of the others.
    """
    same = np.array_equal(sizes, np.diff(pattern.first)[pattern.place]) and len(sides) == len(known)
    for here, there in zip(sides, known, strict=False):
        same = same and np.array_equal(here.cell, there.cell)
        same = same and np.array_equal(here.unknown, there.unknown)
    if not same:
        raise ValueError(
            f"The {sum(len(part.cell) for part in sides)} observations refer to other epochs, "
            "shared errors or states than the solution whose knots they should use. Omit "
            "``like``."
        )


@loop
def whiteners(
    layout: Layout, mixing: np.ndarray, remaining: np.ndarray, own: np.ndarray
) -> np.ndarray:
    """W of noise and interpolation error; NaN if their sum is not positive definite.

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


@loop
def add_information(
    layout: Layout, pattern: Pattern, cells: np.ndarray, sides: Sides, values: np.ndarray
) -> None:
    """Add H^T R^-1 H to the values of a matrix.

    Parameters
    ----------
    layout : Layout
    pattern : Pattern
    cells : (u + 1, s, 2) int array
        Knots.cells, in the order of elimination.
    sides : Sides
    values : (v,) array
    """
    out = _room(layout, sides)
    _, nodes, begin, columns, _ = out
    for i in range(sides.unknown.size):
        _expand(layout, pattern.first, cells, sides, i, out)
        for a in range(out.number[0]):
            for b in range(out.number[0]):
                position = locate(pattern, nodes[a], nodes[b])
                if position < 0:
                    continue
                left = columns[:, begin[a] : begin[a + 1]]
                right = columns[:, begin[b] : begin[b + 1]]
                width = panel_width(pattern, nodes[b])
                for p in range(left.shape[1]):
                    target = values[position + p * width : position + p * width + right.shape[1]]
                    for m in range(left.shape[0]):
                        weight = left[m, p]
                        for q in range(right.shape[1]):
                            target[q] += weight * right[m, q]


@loop
def observe(
    layout: Layout,
    pattern: Pattern,
    cells: np.ndarray,
    sides: Sides,
    x: np.ndarray,
    y: np.ndarray,
    transposed: bool,
) -> None:
    """Replace y by y + W H x, or x by x + H^T W^T y.

    Parameters
    ----------
    layout, pattern, cells, sides
        See add_information.
    x : (n, c) array
        Of the states.
    y : (n, r, c) array
        Of the rows.
    transposed : bool
    """
    out = _room(layout, sides)
    _, nodes, begin, columns, _ = out
    for i in range(sides.unknown.size):
        _expand(layout, pattern.first, cells, sides, i, out)
        for a in range(out.number[0]):
            states = x[pattern.first[nodes[a]] : pattern.first[nodes[a] + 1]]
            weights = columns[:, begin[a] : begin[a + 1]]
            for m in range(weights.shape[0]):
                for p in range(weights.shape[1]):
                    for c in range(x.shape[1]):
                        if transposed:
                            states[p, c] += weights[m, p] * y[i, m, c]
                        else:
                            y[i, m, c] += weights[m, p] * states[p, c]


@loop
def row_covariances(
    layout: Layout, pattern: Pattern, cells: np.ndarray, sides: Sides, inverse: np.ndarray
) -> np.ndarray:
    """W H L^-1 H^T W^T of each observation: (n, r, r).

    Parameters
    ----------
    layout, pattern, cells, sides
        See add_information.
    inverse : (v,) array
        Values of the selected inverse.
    """
    out = _room(layout, sides)
    _, nodes, begin, columns, _ = out
    r = columns.shape[0]
    covariances = np.zeros((sides.unknown.size, r, r))
    for i in range(sides.unknown.size):
        _expand(layout, pattern.first, cells, sides, i, out)
        for a in range(out.number[0]):
            for b in range(out.number[0]):
                position = locate(pattern, nodes[a], nodes[b])
                if position < 0:
                    continue
                left = columns[:, begin[a] : begin[a + 1]]
                right = columns[:, begin[b] : begin[b + 1]]
                width = panel_width(pattern, nodes[b])
                for p in range(left.shape[1]):
                    known = inverse[position + p * width : position + p * width + right.shape[1]]
                    for m in range(r):
                        total = 0.0
                        for q in range(right.shape[1]):
                            total += known[q] * right[m, q]
                        for other in range(r):
                            covariances[i, m, other] += total * left[other, p]
                            if a != b:
                                covariances[i, other, m] += total * left[other, p]
    return covariances


class Expanded(NamedTuple):
    """Expanded rows of W H of one observation: its distinct nodes and their columns.

    Parameters
    ----------
    number : (1,) int array
    nodes, begin : (c,), (c + 1,) int array
        Nodes in the order of elimination, and start of the columns of each.
    columns : (r, w) array
    processes : (s + 1,) int array
        First process of each signal.
    """

    number: np.ndarray
    nodes: np.ndarray
    begin: np.ndarray
    columns: np.ndarray
    processes: np.ndarray


@loop
def _room(layout, sides):
    """Allocate an expanded observation."""
    _, e, r, _ = sides.mixing.shape
    capacity = 2 * e * layout.states.size + 1
    width = 2 * e * layout.states[layout.signal].sum() + r
    nodes = np.zeros(capacity, dtype=np.int64)
    begin = np.zeros(capacity + 1, dtype=np.int64)
    processes = np.searchsorted(layout.signal, np.arange(layout.states.size + 1))
    return Expanded(np.zeros(1, dtype=np.int64), nodes, begin, np.zeros((r, width)), processes)


@loop
def _expand(layout, first, cells, sides, i, out):
    """Expand observation i; cells are numbered in the order of elimination."""
    cell, gains, mixing, unknown, sigma, _, white = sides
    number, nodes, begin, columns, processes = out
    number[0] = 0
    for e in range(cell.shape[1]):
        for s in range(layout.states.size):
            d = layout.states[s]
            for end in range(2):
                node = cells[cell[i, e], s, end]
                if node < 0:
                    continue
                gain = gains[i, e, s, end * d : end * d + d]
                if gain.any():
                    at = _enter(number, nodes, begin, columns, first, node)
                    observed = mixing[i, e, :, processes[s] : processes[s + 1]]
                    for m in range(columns.shape[0]):
                        row = columns[m, at : at + observed.shape[1] * d]
                        for j in range(observed.shape[1]):
                            for p in range(d):
                                row[j * d + p] += observed[m, j] * gain[p]
    if unknown[i] >= 0:
        at = _enter(number, nodes, begin, columns, first, unknown[i])
        for m in range(columns.shape[0]):
            columns[m, at + m] += sigma[i, m]
    for m in range(columns.shape[0] - 1, -1, -1):  # W is lower triangular: last row first
        row = columns[m, : begin[number[0]]]
        row *= white[i, m, m]
        for other in range(m):
            row += white[i, m, other] * columns[other, : row.size]


@loop
def _enter(number, nodes, begin, columns, first, node):
    """Start of the columns of a node; columns of a new one are set to zero."""
    for at in range(number[0]):
        if nodes[at] == node:
            return begin[at]
    at = number[0]
    nodes[at] = node
    begin[at + 1] = begin[at] + first[node + 1] - first[node]
    columns[:, begin[at] : begin[at + 1]] = 0.0
    number[0] += 1
    return begin[at]
