"""Loops over sparse rows: what they tell of the states, and what the states tell of them.

H, which observes the states, is never written out: each loop expands W H of the observations that
it comes to, some dozen columns that are not zero.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from mlscorr.collocation._pattern import Pattern, locate, panel_width
from mlscorr.collocation._states import Layout
from mlscorr.collocation.sparse_rows import Sides


class Expanded(NamedTuple):
    """An observation's rows of W H: its distinct nodes and their columns, of which ``number`` hold.

    Parameters
    ----------
    number : (1,) int array
    nodes, begin : (c,), (c + 1,) int array
        In the order of elimination, and where the columns of each begin.
    columns : (r, w) array
    processes : (s + 1,) int array
        First process of each signal.
    """

    number: np.ndarray
    nodes: np.ndarray
    begin: np.ndarray
    columns: np.ndarray
    processes: np.ndarray


@njit(cache=True, nogil=True)
def _room(layout, sides):
    """Room for an expanded observation."""
    _, e, r, _ = sides.mixing.shape
    capacity = 2 * e * layout.states.size + 1
    width = 2 * e * layout.states[layout.signal].sum() + r
    nodes = np.zeros(capacity, dtype=np.int64)
    begin = np.zeros(capacity + 1, dtype=np.int64)
    processes = np.searchsorted(layout.signal, np.arange(layout.states.size + 1))
    return Expanded(np.zeros(1, dtype=np.int64), nodes, begin, np.zeros((r, width)), processes)


@njit(cache=True, nogil=True)
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
    for m in range(columns.shape[0] - 1, -1, -1):  # W is lower triangular: its last row first
        row = columns[m, : begin[number[0]]]
        row *= white[i, m, m]
        for other in range(m):
            row += white[i, m, other] * columns[other, : row.size]


@njit(cache=True, nogil=True)
def _enter(number, nodes, begin, columns, first, node):
    """Where the columns of a node begin; a new one's are zero."""
    for at in range(number[0]):
        if nodes[at] == node:
            return begin[at]
    at = number[0]
    nodes[at] = node
    begin[at + 1] = begin[at] + first[node + 1] - first[node]
    columns[:, begin[at] : begin[at + 1]] = 0.0
    number[0] += 1
    return begin[at]


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
def observe(
    layout: Layout,
    pattern: Pattern,
    cells: np.ndarray,
    sides: Sides,
    x: np.ndarray,
    y: np.ndarray,
    transposed: bool,
) -> None:
    """Y <- y + W H x, or x <- x + H^T W^T y, in place.

    Parameters
    ----------
    layout, pattern, cells, sides
        As of add_information.
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


@njit(cache=True, nogil=True)
def row_covariances(
    layout: Layout, pattern: Pattern, cells: np.ndarray, sides: Sides, inverse: np.ndarray
) -> np.ndarray:
    """W H L^-1 H^T W^T of each observation: (n, r, r).

    Parameters
    ----------
    layout, pattern, cells, sides
        As of add_information.
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
