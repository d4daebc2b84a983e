"""Block pattern of a sparse symmetric matrix and of its Cholesky factor.

A matrix has a node for each block of rows, and an edge for each block that may be nonzero. Nodes
are eliminated in an order of minimum degree. Everything that depends on the edges only is computed
once.

Sources: George and Liu 1989, SIAM Review 31, 1-19 (minimum degree); Davis 2006, Direct Methods for
Sparse Linear Systems, chapter 4 (fill, postorder); Ashcraft and Grimes 1989, ACM Trans. Math.
Software 15, 291-309 (fronts with some zeros).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import depth_first_order
from scipy.sparse.linalg import spilu

from mlscorr.compiled_loops import loop


class Pattern(NamedTuple):
    """Block pattern of a matrix, of its factor and of its inverse.

    Nodes and states are in the order of elimination. Consecutive nodes with the same blocks below
    them in the factor, or nearly so, form a front. Its columns are a panel in ``values``: the
    diagonal block, of which the lower triangle counts, then the blocks below it, row by row.

    Parameters
    ----------
    place : (k,) int array
        Position of each of the caller's nodes in the order of elimination.
    first : (k + 1,) int array
        State at which each node begins.
    front : (k,) int array
        Front of each node.
    node : (g + 1,) int array
        Node at which each front begins.
    start : (g + 1,) int array
        Index in values at which the panel of each front begins.
    column : (g + 1,) int array
        Index in ``row`` at which the nodes below the diagonal of each front begin.
    row, height : (l,) int array
        These nodes, in order, and the number of rows of the panel above each.
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
        """Make the pattern of a matrix.

        Parameters
        ----------
        sizes : (k,) int array
            Number of states of each node.
        edges : (e, 2) int array
            Pairs of nodes, in any order, with repetitions.
        """
        place = _elimination_order(len(sizes), edges)
        place = _postorder(*_filled(place, edges))[place]
        row, column = _filled(place, edges)
        ordered = np.asarray(sizes, dtype=np.int64)[np.argsort(place)]
        first = np.append(0, np.cumsum(ordered))
        ends = _ends_front(row, column, first)
        node = np.append(0, np.flatnonzero(ends) + 1)
        below = np.diff(column)
        row = row[np.repeat(ends, below)]
        column = np.append(0, np.cumsum(below[ends]))
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
        """Values of a zero matrix."""
        return np.zeros(self.start[-1])


def _elimination_order(count, edges):
    """Position of each node in the order of elimination, by SuperLU."""
    if count == 0:
        return np.zeros(0, dtype=np.int64)
    distinct = edges[edges[:, 0] != edges[:, 1]]
    both = np.vstack([distinct, distinct[:, ::-1]]).T
    graph = coo_array((np.full(both.shape[1], -1.0), tuple(both)), shape=(count, count)).tocsc()
    graph.data[:] = -1.0
    graph.setdiag(np.diff(graph.indptr) + 1.0)  # dominant, so that there is no pivoting
    symmetric = {"diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}
    nothing = {"drop_tol": 1.0, "fill_factor": 1}  # the factor itself is not needed
    factor = spilu(graph.tocsc(), permc_spec="MMD_AT_PLUS_A", **symmetric, **nothing)
    return factor.perm_c.astype(np.int64)


def _filled(place, edges):
    """Nodes below the diagonal of each column of the factor, and start of each column."""
    low, high = np.sort(place[edges].reshape(-1, 2), axis=1).T
    graph = coo_array((np.ones(len(low)), (low, high)), shape=(len(place), len(place))).tocsr()
    return _fill_in(graph.indptr.astype(np.int64), graph.indices.astype(np.int64))


def _postorder(row, column):
    """Position (k,) of each node in postorder, after the nodes whose parent it is.

    A node's parent is the first node below it in the factor. Of several children, the one with the
    longest column comes directly before its parent. The factor is the same, but children and
    parents can form fronts.
    """
    below = np.diff(column)
    # root of all
    count = len(below)
    parent = np.full(len(below), len(below))
    parent[below > 0] = row[column[:-1][below > 0]]
    children = np.lexsort([-below, parent])
    begin = np.searchsorted(parent[children], np.arange(count + 2))
    tree = csr_array((np.ones(count), children, begin), shape=(count + 1, count + 1))
    visited = depth_first_order(tree, count, return_predecessors=False)  # parents first
    return np.argsort(visited[:0:-1])


@loop
def _ends_front(row, column, first):
    """Flag (k,) of nodes that end a front: their parent is not next, or splitting is cheaper.

    The cost counts multiplications and moved values: those of a front's product are written and
    read, and so are those of the matrix from which it is subtracted.
    """
    ends = np.ones(column.size - 1, np.bool_)
    begin = 0
    joint_work = 0.0
    for j in range(column.size - 1):
        below = 0
        for i in row[column[j] : column[j + 1]]:
            below += first[i + 1] - first[i]
        separate_work = joint_work + _work(first[j + 1] - first[j], below)
        work = _work(first[j + 1] - first[begin], below)
        if j > begin and row[column[j - 1]] == j and work <= separate_work:
            ends[j - 1] = False
            joint_work = work
        else:
            begin = j
            joint_work = separate_work - joint_work
    return ends


@loop
def _work(width, below):
    return width**3 / 3 + width * below * (width + below) + 4 * below**2


@loop
def _fill_in(pointer, index):
    """Nodes below the diagonal of each column of the factor, and start of each column.

    They are the nodes of the matrix and of the columns whose first node this column is.
    """
    count = pointer.size - 1
    row = np.empty(4 * index.size + count, dtype=np.int64)
    column = np.zeros(count + 1, dtype=np.int64)
    child = np.full(count, -1)
    sibling = np.full(count, -1)
    mark = np.full(count, -1)
    end = 0
    for j in range(count):
        begin = end
        if row.size - end < count - j:  # a column has at most as many nodes as follow it
            larger = np.empty(2 * row.size + count, dtype=np.int64)
            larger[:end] = row[:end]
            row = larger
        end = _enter(index[pointer[j] : pointer[j + 1]], j, mark, row, end)
        c = child[j]
        while c >= 0:
            end = _enter(row[column[c] : column[c + 1]], j, mark, row, end)
            c = sibling[c]
        column[j + 1] = end
        row[begin:end].sort()
        if end > begin:
            parent = row[begin]
            sibling[j] = child[parent]
            child[parent] = j
    return row[:end].copy(), column


@loop
def _enter(nodes, j, mark, row, end):
    """Append those of some nodes that column j does not have yet; return the new end."""
    for i in nodes:
        if i > j and mark[i] != j:
            mark[i] = j
            row[end] = i
            end += 1
    return end


@loop
def locate(pattern: Pattern, i: int, j: int) -> int:
    """Index in values at which block (i, j) of the lower triangle begins.

    Parameters
    ----------
    pattern : Pattern
    i, j : int

    Returns
    -------
    position : int
        -1 if there is no such block, or it is above the diagonal.
    """
    if i < j:
        return -1
    front = pattern.front[j]
    node = pattern.node[front]
    width = panel_width(pattern, j)
    left = pattern.first[j] - pattern.first[node]
    if pattern.front[i] == front:
        return pattern.start[front] + (pattern.first[i] - pattern.first[node]) * width + left
    low = pattern.column[front]
    end = pattern.column[front + 1]
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


@loop
def panel_width(pattern: Pattern, j: int) -> int:
    """Stride in values between rows of a block below node j.

    Parameters
    ----------
    pattern : Pattern
    j : int
    """
    front = pattern.front[j]
    return pattern.first[pattern.node[front + 1]] - pattern.first[pattern.node[front]]


@loop
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
