"""Interpolation of a process at any epoch from its states at the two adjacent nodes.

Given both states, a Markov process between them is independent of the rest, so for each process

    E s(t) = a s_i + b s_i+1,   b = c Q^-1,   a = e F1 - b F(dt),   var = q1 - b c^T
    c = e Q1 F2^T,   Q = Q(dt),   dt = t_i+1 - t_i

with F1, Q1 over t - t_i, F2 over t_i+1 - t, e the first state and q1 the first element of Q1
(Rasmussen and Williams 2006, appendix B; Särkkä and Solin 2019, section 10). Before the first and
past the last node the missing neighbor is at infinity.
"""

import numpy as np

from mlscorr.collocation._states import Layout
from mlscorr.collocation.covariance import process_noise, transition
from mlscorr.compiled_loops import loop


@loop
def conditional_gains(
    layout: Layout, before: np.ndarray, after: np.ndarray, cell: np.ndarray, clocks: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Gains a, b of the states at the nodes adjacent to q epochs, and the remaining variance.

    Fastest if epochs of one cell are consecutive.

    Parameters
    ----------
    layout : Layout
    before, after : (u, s) array
        Clocks of the nodes at both ends of each cell, infinite if there is none.
    cell : (q,) int array
        Cell of each epoch.
    clocks : (q, s) array

    Returns
    -------
    gains, remaining : (q, s, 2 d), (q, s) array
        For up to d states; those of each signal have no space between a and b.
    """
    number = layout.states.size
    largest = 0
    for s in range(number):
        largest = max(largest, layout.states[s])
    gains = np.zeros((cell.size, number, 2 * largest))
    remaining = np.zeros((cell.size, number))
    for s in range(number):
        kind = layout.kinds[s]
        d = layout.states[s]
        rate = layout.rates[s]
        entered = -1
        whole = transition(kind, 0.0)
        for e in range(cell.size):
            u = cell[e]
            if u != entered:
                entered = u
                span = rate * (after[u, s] - before[u, s])
                whole = transition(kind, span)
                # L D L^T of Q between the nodes, with ones for missing states. It works on ratios
                # of the elements, so small steps do no harm
                q0, q1, q2, q3, q4, q5 = process_noise(kind, span)
                l10 = q1 / q0
                l20 = q2 / q0
                d1 = q3 - l10 * q1 if d > 1 else 1.0
                l21 = (q4 - l20 * q1) / d1
                d2 = q5 - l20 * q2 - l21 * l21 * d1 if d > 2 else 1.0
            elapsed = rate * (clocks[e, s] - before[u, s])
            f = transition(kind, rate * (after[u, s] - clocks[e, s]))
            p0, p1, p2, _, _, _ = process_noise(kind, elapsed)
            c0 = p0 * f[0] + p1 * f[1] + p2 * f[2]
            c1 = p0 * f[3] + p1 * f[4] + p2 * f[5]
            c2 = p0 * f[6] + p1 * f[7] + p2 * f[8]
            y1 = c1 - l10 * c0
            b2 = (c2 - l20 * c0 - l21 * y1) / d2
            b1 = y1 / d1 - l21 * b2
            b0 = c0 / q0 - l10 * b1 - l20 * b2
            f = transition(kind, elapsed)
            gains[e, s, 0] = f[0] - b0 * whole[0] - b1 * whole[3] - b2 * whole[6]
            if d > 1:
                gains[e, s, 1] = f[1] - b0 * whole[1] - b1 * whole[4] - b2 * whole[7]
                gains[e, s, d + 1] = b1
            if d > 2:
                gains[e, s, 2] = f[2] - b0 * whole[2] - b1 * whole[5] - b2 * whole[8]
                gains[e, s, 5] = b2
            gains[e, s, d] = b0
            remaining[e, s] = max(p0 - b0 * c0 - b1 * c1 - b2 * c2, 0.0)
    return gains, remaining


@loop
def process_moments(
    layout: Layout,
    cell: np.ndarray,
    gains: np.ndarray,
    remaining: np.ndarray,
    columns: np.ndarray,
    joint: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Estimates and covariance of k processes at q epochs.

    Parameters
    ----------
    layout : Layout
    cell : (q,) int array
        Cell of each epoch.
    gains, remaining
        See ``conditional_gains``.
    columns : (u, 2 d, c) array
        Estimates of the states at both ends of each cell, process by process, first before and then
        after it; zero if there is no node.
    joint : (u, 2 d, 2 d) array
        Their covariance.

    Returns
    -------
    values, covariance : (q, k, c), (q, k, k) array
    """
    k = layout.first.size
    size = joint.shape[1]
    values = np.zeros((cell.size, k, columns.shape[2]))
    covariance = np.zeros((cell.size, k, k))
    row = np.zeros((1, size))
    for e in range(cell.size):
        u = cell[e]
        for j in range(k):
            s = layout.signal[j]
            a = 2 * layout.first[j]
            for b in range(a, size):
                row[0, b] = 0.0
            for p in range(2 * layout.states[s]):
                gain = gains[e, s, p]
                for c in range(columns.shape[2]):
                    values[e, j, c] += gain * columns[u, a + p, c]
                for b in range(a, size):
                    row[0, b] += gain * joint[u, a + p, b]
            for other in range(j, k):
                to = layout.signal[other]
                b = 2 * layout.first[other]
                total = remaining[e, s] if other == j else 0.0
                for p in range(2 * layout.states[to]):
                    total += row[0, b + p] * gains[e, to, p]
                covariance[e, j, other] = total
                covariance[e, other, j] = total
    return values, covariance
