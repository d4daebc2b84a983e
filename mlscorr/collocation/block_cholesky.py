"""Cholesky factor of a sparse symmetric matrix in blocks, and its inverse where the factor stands.

For node j with the diagonal block L_jj and the blocks B below it, by the order of a Pattern:

    A_jj = L_jj L_jj^T,   B = A_j L_jj^-T,   A_SS <- A_SS - B B^T,    S the nodes below

and backward, with U = B L_jj^-1, those blocks of Z = A^-1 that stand where the factor has some:

    Z_Sj = -Z_SS U,   Z_jj = L_jj^-T L_jj^-1 - U^T Z_Sj

Sources: Davis 2006, Direct Methods for Sparse Linear Systems, chapter 4; Takahashi, Fagan and Chin
1973 (selected inverse).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from mlscorr.collocation.pattern import Pattern


@njit(cache=True, nogil=True)
def _largest_front(pattern):
    """Largest number of states below a node."""
    largest = 0
    for j in range(pattern.start.size - 1):
        size = pattern.first[j + 1] - pattern.first[j]
        largest = max(largest, (pattern.start[j + 1] - pattern.start[j]) // size - size)
    return largest


@njit(cache=True, nogil=True)
def factorise(pattern: Pattern, values: np.ndarray) -> int:
    """Cholesky factor of a matrix, in its place.

    Parameters
    ----------
    pattern : Pattern
    values : (v,) array
        Of the matrix, its lower triangle at least; of the factor in the end.

    Returns
    -------
    state : int
        The first that has no positive pivot, in the order of elimination; -1 if all have.
    """
    first, start, column = pattern.first, pattern.start, pattern.column
    room = np.empty(_largest_front(pattern) ** 2)
    for j in range(start.size - 1):
        b = first[j + 1] - first[j]
        panel = values[start[j] : start[j + 1]].reshape((-1, b))
        for a in range(b):
            for i in range(a, panel.shape[0]):
                total = panel[i, a]
                for k in range(a):
                    total -= panel[i, k] * panel[a, k]
                if i > a:
                    panel[i, a] = total / panel[a, a]
                elif total > 0.0:
                    panel[a, a] = np.sqrt(total)
                else:
                    return first[j] + a
            panel[a, a + 1 : b] = 0.0
        if panel.shape[0] == b:
            continue
        below = panel[b:]
        product = room[: below.shape[0] ** 2].reshape((below.shape[0], -1))
        np.dot(below, below.T, product)
        for k in range(column[j], column[j + 1]):
            _subtract(pattern, values, product, j, k)
    return -1


@njit(cache=True, nogil=True)
def _subtract(pattern, values, product, j, k):
    """Subtract column k of a product of the blocks below node j from the matrix."""
    first, start, column, row, height = pattern[1:]
    target, at = row[k], column[row[k]]
    b, size = first[j + 1] - first[j], first[target + 1] - first[target]
    left = height[k] - b
    for other in range(k, column[j + 1]):
        node, top = row[other], height[other] - b
        position = start[target]
        if node != target:
            while row[at] != node:
                at += 1
            position += height[at] * size
        for p in range(first[node + 1] - first[node]):
            for q in range(size):
                values[position + p * size + q] -= product[top + p, left + q]


@njit(cache=True, nogil=True)
def solve_in_place(pattern: Pattern, values: np.ndarray, x: np.ndarray) -> None:
    """X <- A^-1 x by the factor.

    Parameters
    ----------
    pattern : Pattern
    values : (v,) array
        Of the factor.
    x : (n, c) array
        In the order of elimination.
    """
    first, start, column, row, height = pattern[1:]
    count, c = start.size - 1, x.shape[1]
    for step in range(2 * count):
        is_forward = step < count
        j = step if is_forward else 2 * count - 1 - step
        b = first[j + 1] - first[j]
        panel = values[start[j] : start[j + 1]].reshape((-1, b))
        here = x[first[j] : first[j + 1]]
        if is_forward:
            _substitute(panel, here)
        for k in range(column[j], column[j + 1]):
            there = x[first[row[k]] : first[row[k] + 1]]
            for p in range(there.shape[0]):
                for a in range(b):
                    weight = panel[height[k] + p, a]
                    for m in range(c):
                        if is_forward:
                            there[p, m] -= weight * here[a, m]
                        else:
                            here[a, m] -= weight * there[p, m]
        if not is_forward:
            _substitute_back(panel, here)


@njit(cache=True, nogil=True)
def _substitute(lower, x):
    """X <- L^-1 x, L the first rows of lower."""
    for a in range(x.shape[0]):
        for m in range(x.shape[1]):
            for k in range(a):
                x[a, m] -= lower[a, k] * x[k, m]
            x[a, m] /= lower[a, a]


@njit(cache=True, nogil=True)
def _substitute_back(lower, x):
    """X <- L^-T x, L the first rows of lower."""
    for a in range(x.shape[0] - 1, -1, -1):
        for m in range(x.shape[1]):
            for k in range(a + 1, x.shape[0]):
                x[a, m] -= lower[k, a] * x[k, m]
            x[a, m] /= lower[a, a]


@njit(cache=True, nogil=True)
def invert_in_place(pattern: Pattern, values: np.ndarray) -> None:
    """Blocks of the inverse where the factor has some, in its place.

    Parameters
    ----------
    pattern : Pattern
    values : (v,) array
        Of the factor; of the inverse in the end.
    """
    first, start, column = pattern.first, pattern.start, pattern.column
    room = np.empty(_largest_front(pattern) ** 2)
    for j in range(start.size - 2, -1, -1):
        b = first[j + 1] - first[j]
        panel = values[start[j] : start[j + 1]].reshape((-1, b))
        root = np.eye(b)
        _substitute(panel, root)
        scaled = np.dot(panel[b:], root)  # U
        panel[:b] = np.dot(root.T, root)
        if scaled.shape[0] > 0:
            known = room[: scaled.shape[0] ** 2].reshape((scaled.shape[0], -1))
            for k in range(column[j], column[j + 1]):
                _collect(pattern, values, known, j, k)
            np.dot(known, -scaled, panel[b:])
            panel[:b] -= np.dot(scaled.T, panel[b:])


@njit(cache=True, nogil=True)
def _collect(pattern, inverse, known, j, k):
    """Columns of the inverse at the k-th node below node j, and their mirror image."""
    first, start, column, row, height = pattern[1:]
    source, at = row[k], column[row[k]]
    b, size = first[j + 1] - first[j], first[source + 1] - first[source]
    left = height[k] - b
    for other in range(k, column[j + 1]):
        node, top = row[other], height[other] - b
        position = start[source]
        if node != source:
            while row[at] != node:
                at += 1
            position += height[at] * size
        for p in range(first[node + 1] - first[node]):
            for q in range(size):
                value = inverse[position + p * size + q]
                known[top + p, left + q] = value
                known[left + q, top + p] = value
