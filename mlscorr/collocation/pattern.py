"""Where the blocks of a sparse symmetric matrix and of its Cholesky factor stand.

A matrix has a node for each block of rows, and an edge for each block that may hold something.
Nodes are eliminated in an order of minimum degree, and all that depends on the edges alone is
worked out once.

Sources: George and Liu 1989, SIAM Review 31, 1-19 (minimum degree); Davis 2006, Direct Methods for
Sparse Linear Systems, chapter 4 (fill).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from scipy.sparse import coo_array
from scipy.sparse.linalg import spilu


class Pattern(NamedTuple):
    """Where the blocks of a matrix, of its factor and of its inverse stand.

    Nodes and states are in the order of elimination. Nodes in a row below which the factor has the
    same blocks are a front, whose columns are a panel in ``values``: the block on the diagonal,
    of which the lower triangle counts, then those below it, each row after the other.

    Parameters
    ----------
    place : (k,) int array
        Of each node, as the caller numbers them, in the order of elimination.
    first : (k + 1,) int array
        State at which each node begins.
    front : (k,) int array
        That each node belongs to.
    node : (g + 1,) int array
        At which each front begins.
    start : (g + 1,) int array
        Where the panel of each front begins in values.
    column : (g + 1,) int array
        Where the nodes below the diagonal of each front begin in ``row``.
    row, height : (l,) int array
        These nodes, in order, and how many rows of the panel stand above each.
    """

    place: np.ndarray
    first: np.ndarray
    front: np.ndarray
    node: np.ndarray
    start: np.ndarray
    column: np.ndarray
    row: np.ndarray
    height: np.ndarray

    @classmethod
    def of(cls, sizes: np.ndarray, edges: np.ndarray) -> Pattern:
        """The pattern of a matrix.

        Parameters
        ----------
        sizes : (k,) int array
            Number of states of each node.
        edges : (e, 2) int array
            Pairs of nodes, in any order and more than once.
        """
        count = len(sizes)
        place = _elimination_order(count, edges)
        low, high = np.sort(place[edges].reshape(-1, 2), axis=1).T
        graph = coo_array((np.ones(len(low)), (low, high)), shape=(count, count)).tocsr()
        row, column = _fill_in(graph.indptr.astype(np.int64), graph.indices.astype(np.int64))
        ends = _ends_front(row, column)
        node = np.append(0, np.flatnonzero(ends) + 1)
        below = np.diff(column)
        row, column = row[np.repeat(ends, below)], np.append(0, np.cumsum(below[ends]))
        ordered = np.empty(count, dtype=np.int64)
        ordered[place] = sizes
        first = np.append(0, np.cumsum(ordered))
        widths = np.diff(first[node])
        above = np.append(0, np.cumsum(ordered[row]))
        height = above[:-1] + np.repeat(widths - above[column[:-1]], np.diff(column))
        heights = widths + above[column[1:]] - above[column[:-1]]
        start = np.append(0, np.cumsum(heights * widths))
        front = np.repeat(np.arange(len(widths)), np.diff(node))
        return cls(place, first, front, node, start, column, row, height)

    @property
    def states(self) -> int:
        """Number of states."""
        return int(self.first[-1])

    @property
    def zeros(self) -> np.ndarray:
        """Values of a matrix without anything in it."""
        return np.zeros(self.start[-1])


def _elimination_order(count, edges):
    """Place of each node, by SuperLU."""
    if count == 0:
        return np.zeros(0, dtype=np.int64)
    distinct = edges[edges[:, 0] != edges[:, 1]]
    both = np.vstack([distinct, distinct[:, ::-1]]).T
    graph = coo_array((np.full(both.shape[1], -1.0), tuple(both)), shape=(count, count)).tocsc()
    graph.data[:] = -1.0
    graph.setdiag(np.diff(graph.indptr) + 1.0)  # dominant: nothing is swapped
    symmetric = {"diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}
    nothing = {"drop_tol": 1.0, "fill_factor": 1}  # of a factor that nobody wants
    factor = spilu(graph.tocsc(), permc_spec="MMD_AT_PLUS_A", **symmetric, **nothing)
    return factor.perm_c.astype(np.int64)


def _ends_front(row, column):
    """Which nodes (k,) have other blocks below them than the next one has with its own."""
    below = np.diff(column)
    ends = np.ones(len(below), dtype=bool)
    inner = np.flatnonzero(below[:-1] == below[1:] + 1)
    ends[inner] = row[column[inner]] != inner + 1
    return ends


@njit(cache=True, nogil=True)
def _fill_in(pointer, index):
    """Nodes below the diagonal of each column of the factor, and where each column begins.

    A column's nodes are those of the matrix and those of the columns whose first node it is.
    """
    count = pointer.size - 1
    row = np.empty(4 * index.size + count, dtype=np.int64)
    column = np.zeros(count + 1, dtype=np.int64)
    child, sibling = np.full(count, -1), np.full(count, -1)
    mark = np.full(count, -1)
    end = 0
    for j in range(count):
        begin = end
        if row.size - end < count - j:  # a column has no more nodes than follow it
            larger = np.empty(2 * row.size + count, dtype=np.int64)
            larger[:end] = row[:end]
            row = larger
        for k in range(pointer[j], pointer[j + 1]):
            i = index[k]
            if i > j and mark[i] != j:
                mark[i] = j
                row[end] = i
                end += 1
        c = child[j]
        while c >= 0:
            for k in range(column[c], column[c + 1]):
                i = row[k]
                if i > j and mark[i] != j:
                    mark[i] = j
                    row[end] = i
                    end += 1
            c = sibling[c]
        column[j + 1] = end
        row[begin:end].sort()
        if end > begin:
            parent = row[begin]
            sibling[j], child[parent] = child[parent], j
    return row[:end].copy(), column


@njit(cache=True, nogil=True)
def locate(pattern: Pattern, i: int, j: int) -> int:
    """Where block (i, j) of the lower triangle begins in values.

    Parameters
    ----------
    pattern : Pattern
    i, j : int

    Returns
    -------
    position : int
        -1 where there is no such block, or it stands above the diagonal.
    """
    if i < j:
        return -1
    front = pattern.front[j]
    node = pattern.node[front]
    width, left = panel_width(pattern, j), pattern.first[j] - pattern.first[node]
    if pattern.front[i] == front:
        return pattern.start[front] + (pattern.first[i] - pattern.first[node]) * width + left
    low, end = pattern.column[front], pattern.column[front + 1]
    high = end
    while low < high:
        middle = (low + high) // 2
        if pattern.row[middle] < i:
            low = middle + 1
        else:
            high = middle
    if low == end or pattern.row[low] != i:
        return -1
    return pattern.start[front] + pattern.height[low] * width + left


@njit(cache=True, nogil=True)
def panel_width(pattern: Pattern, j: int) -> int:
    """Number of values from one row of a block below node j to the next.

    Parameters
    ----------
    pattern : Pattern
    j : int
    """
    front = pattern.front[j]
    return pattern.first[pattern.node[front + 1]] - pattern.first[pattern.node[front]]


@njit(cache=True, nogil=True)
def diagonal(pattern: Pattern, values: np.ndarray) -> np.ndarray:
    """Diagonal of a matrix, or of a factor.

    Parameters
    ----------
    pattern : Pattern
    values : (v,) array
    """
    out = np.empty(pattern.first[-1])
    for front in range(pattern.start.size - 1):
        begin, end = pattern.first[pattern.node[front : front + 2]]
        for a in range(end - begin):
            out[begin + a] = values[pattern.start[front] + a * (end - begin + 1)]
    return out
