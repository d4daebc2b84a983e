"""Cholesky factor of a sparse symmetric block matrix, and its inverse in the blocks of the factor.

For front j with the diagonal block L_jj and the blocks B below it, in the order of a Pattern:

    A_jj = L_jj L_jj^T,   B = A_j L_jj^-T,   A_SS <- A_SS - B B^T,    S the nodes below

and backward, with U = B L_jj^-1, those blocks of Z = A^-1 that exist in the factor:

    Z_Sj = -Z_SS U,   Z_jj = L_jj^-T L_jj^-1 - U^T Z_Sj

Sources: Davis 2006, Direct Methods for Sparse Linear Systems, chapter 4; Liu, Ng and Peyton 1993,
SIAM J. Matrix Anal. Appl. 14, 242-252 (fronts); Takahashi, Fagan and Chin 1973 (selected inverse).

CHOLMOD (scikit-sparse 0.5.0, supernodal part under the GPL) and SelInv (selinv 1.0.2) do the same,
but neither has wheels: pip compiles both, and the first needs SuiteSparse installed. SuperLU in
scipy has no selected inverse; ``benchmarks/bench_tie_solver.py`` compares it with these loops.
"""

import numpy as np

from mlscorr.collocation._pattern import Pattern
from mlscorr.compiled_loops import loop

STRIP = 16  # columns of a panel factored by loops, a power of two; BLAS does the rest
# Products of smaller values are subnormal numbers, which a processor handles 100 times slower
NOTHING = float(np.sqrt(np.finfo(float).tiny))


@loop
def _panel(pattern, values, front):
    """Values (h, b) of a front's columns, starting with the diagonal block."""
    begin = pattern.node[front]
    end = pattern.node[front + 1]
    width = pattern.first[end] - pattern.first[begin]
    return values[pattern.start[front] : pattern.start[front + 1]].reshape((-1, width))


@loop
def _most_below(pattern):
    """Largest number of states below a front."""
    largest = 0
    for front in range(pattern.start.size - 1):
        width = pattern.first[pattern.node[front + 1]] - pattern.first[pattern.node[front]]
        below = (pattern.start[front + 1] - pattern.start[front]) // max(width, 1) - width
        largest = max(largest, below)
    return largest


@loop
def factorise(pattern: Pattern, values: np.ndarray) -> int:
    """Factor a matrix by Cholesky, in place.

    Parameters
    ----------
    pattern : Pattern
    values : (v,) array
        Input: the matrix, at least its lower triangle. Output: the factor.

    Returns
    -------
    state : int
        First state without a positive pivot, in the order of elimination; -1 if there is none.
    """
    room = np.empty(_most_below(pattern) ** 2)
    for front in range(pattern.start.size - 1):
        panel = _panel(pattern, values, front)
        failed = _factorise_panel(panel)
        if failed >= 0:
            return pattern.first[pattern.node[front]] + failed
        below = panel[panel.shape[1] :]
        if below.shape[0] > 0:
            product = room[: below.shape[0] ** 2].reshape((below.shape[0], -1))
            np.dot(below, below.T, product)
            k = pattern.column[front]
            while k < pattern.column[front + 1]:
                end = _run_end(pattern, front, k)
                _subtract(pattern, values, product, front, k, end)
                k = end
    return -1


@loop
def _run_end(pattern, front, k):
    """End of the run of nodes below a front, from the k-th on, whose columns are adjacent."""
    row = pattern.row
    end = pattern.column[front + 1]
    target = pattern.front[row[k]]
    k = k + 1
    while k < end and row[k] == row[k - 1] + 1 and pattern.front[row[k]] == target:
        k += 1
    return k


@loop
def _find_row(pattern, front, node, at):
    """Row of a front's panel at which a node begins, and start of the next search in ``row``."""
    begin = pattern.node[front]
    end = pattern.node[front + 1]
    if node < end:
        return pattern.first[node] - pattern.first[begin], at
    while pattern.row[at] != node:
        at += 1
    return pattern.height[at], at


@loop
def _factorise_panel(panel):
    """Replace A_jj and A_j by L_jj and B; return the column without a positive pivot, or -1."""
    height, width = panel.shape
    for begin in range(0, width, STRIP):
        if begin > 0:  # the largest power of two in it: as many columns before it as after it
            span = begin & -begin
            end = min(begin + span, width)
            done = panel[begin:, begin - span : begin].copy()
            panel[begin:, begin:end] -= np.dot(done, done[: end - begin].T)
        end = min(begin + STRIP, width)
        for i in range(begin, height):
            for a in range(begin, min(end, i + 1)):
                total = panel[i, a]
                for k in range(begin, a):
                    total -= panel[i, k] * panel[a, k]
                if i > a:
                    panel[i, a] = total / panel[a, a]
                elif total > 0.0:
                    panel[a, a] = np.sqrt(total)
                else:
                    return a
    for a in range(width):
        panel[a, a + 1 :] = 0.0
    _drop_nothing(panel)
    return -1


@loop
def _drop_nothing(panel):
    """Set values far below any rounding error to zero."""
    for i in range(panel.shape[0]):
        for a in range(panel.shape[1]):
            if abs(panel[i, a]) < NOTHING:
                panel[i, a] = 0.0


@loop
def _subtract(pattern, values, product, front, k, run_end):
    """Subtract columns k to run_end of a product of the blocks below a front from the matrix."""
    first = pattern.first
    row = pattern.row
    height = pattern.height
    target = pattern.front[row[k]]
    size = first[row[run_end - 1] + 1] - first[row[k]]
    panel = _panel(pattern, values, target)
    at = pattern.column[target]
    column = first[row[k]] - first[pattern.node[target]]
    # for all blocks below
    left = height[k]
    top = height[pattern.column[front]]
    for other in range(k, pattern.column[front + 1]):
        high, at = _find_row(pattern, target, row[other], at)
        for p in range(first[row[other] + 1] - first[row[other]]):
            to = panel[high + p, column : column + size]
            change = product[height[other] - top + p, left - top : left - top + size]
            for q in range(size):
                to[q] -= change[q]


@loop
def solve_in_place(pattern: Pattern, values: np.ndarray, x: np.ndarray) -> None:
    """Replace x by A^-1 x, by the factor.

    Parameters
    ----------
    pattern : Pattern
    values : (v,) array
        Of the factor.
    x : (n, c) array
        In the order of elimination.
    """
    count = pattern.start.size - 1
    for step in range(2 * count):
        front = step if step < count else 2 * count - 1 - step
        panel = _panel(pattern, values, front)
        width = panel.shape[1]
        begin = pattern.first[pattern.node[front]]
        here = x[begin : begin + width]
        below = panel[width:]
        if step < count:
            _substitute(panel, here)
            if below.shape[0] > 0:
                _subtract_below(pattern, front, np.dot(below, here), x)
        else:
            if below.shape[0] > 0:
                here -= np.dot(below.T, _states_below(pattern, front, below.shape[0], x))
            _substitute_back(panel, here)


@loop
def _states_below(pattern, front, count, x):
    """Rows (m, c) of x at the nodes below a front."""
    gathered = np.empty((count, x.shape[1]))
    at = 0
    for k in range(pattern.column[front], pattern.column[front + 1]):
        for state in range(pattern.first[pattern.row[k]], pattern.first[pattern.row[k] + 1]):
            for c in range(x.shape[1]):
                gathered[at, c] = x[state, c]
            at += 1
    return gathered


@loop
def _subtract_below(pattern, front, change, x):
    """Subtract rows (m, c) from those of x at the nodes below a front."""
    at = 0
    for k in range(pattern.column[front], pattern.column[front + 1]):
        for state in range(pattern.first[pattern.row[k]], pattern.first[pattern.row[k] + 1]):
            for c in range(x.shape[1]):
                x[state, c] -= change[at, c]
            at += 1


@loop
def _substitute(lower, x):
    """Replace x by L^-1 x, with L the first rows of lower."""
    for a in range(x.shape[0]):
        for k in range(a):
            for m in range(x.shape[1]):
                x[a, m] -= lower[a, k] * x[k, m]
        for m in range(x.shape[1]):
            x[a, m] /= lower[a, a]


@loop
def _substitute_back(lower, x):
    """Replace x by L^-T x, with L the first rows of lower."""
    for a in range(x.shape[0] - 1, -1, -1):
        for m in range(x.shape[1]):
            x[a, m] /= lower[a, a]
        for k in range(a):
            for m in range(x.shape[1]):
                x[k, m] -= lower[a, k] * x[a, m]


@loop
def _inverted(lower):
    """L^-1, with L the first rows of lower: diagonal strips first, then pairs of them."""
    width = lower.shape[1]
    inverse = np.eye(width)
    for begin in range(0, width, STRIP):
        end = min(begin + STRIP, width)
        _substitute(lower[begin:end, begin:end], inverse[begin:end, begin:end])
    span = STRIP
    while span < width:
        for middle in range(span, width, 2 * span):
            before = slice(middle - span, middle)
            after = slice(middle, min(middle + span, width))
            known = np.dot(lower[after, before].copy(), inverse[before, before].copy())
            inverse[after, before] = -np.dot(inverse[after, after].copy(), known)
        span *= 2
    return inverse


@loop
def invert_in_place(pattern: Pattern, values: np.ndarray) -> None:
    """Compute the blocks of the inverse that exist in the factor, in its place.

    Parameters
    ----------
    pattern : Pattern
    values : (v,) array
        Input: the factor. Output: the inverse.
    """
    room = np.empty(_most_below(pattern) ** 2)
    for front in range(pattern.start.size - 2, -1, -1):
        panel = _panel(pattern, values, front)
        width = panel.shape[1]
        root = _inverted(panel)
        scaled = np.dot(panel[width:], root)  # U
        _drop_nothing(scaled)
        panel[:width] = np.dot(root.T, root)
        if scaled.shape[0] > 0:
            known = room[: scaled.shape[0] ** 2].reshape((scaled.shape[0], -1))
            k = pattern.column[front]
            while k < pattern.column[front + 1]:
                end = _run_end(pattern, front, k)
                _collect(pattern, values, known, front, k, end)
                k = end
            np.dot(known, -scaled, panel[width:])
            panel[:width] -= np.dot(scaled.T, panel[width:])
        _drop_nothing(panel)


@loop
def _collect(pattern, inverse, known, front, k, run_end):
    """Columns of the inverse at nodes k to run_end below a front, and their mirror image."""
    first = pattern.first
    row = pattern.row
    height = pattern.height
    source = pattern.front[row[k]]
    size = first[row[run_end - 1] + 1] - first[row[k]]
    panel = _panel(pattern, inverse, source)
    at = pattern.column[source]
    column = first[row[k]] - first[pattern.node[source]]
    left = height[k]
    top = height[pattern.column[front]]
    for other in range(k, pattern.column[front + 1]):
        high, at = _find_row(pattern, source, row[other], at)
        for p in range(first[row[other] + 1] - first[row[other]]):
            line = panel[high + p, column : column + size]
            here = height[other] - top + p
            to = known[here, left - top : left - top + size]
            for q in range(size):
                to[q] = line[q]
                known[left - top + q, here] = line[q]
