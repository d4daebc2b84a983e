"""Signal at any epoch from the smoothed states at the two observation epochs about it.

Given both states a Markov process between them knows nothing of the rest, so for each process

    E s(t) = a s_i + b s_i+1,   b = c Q^-1,   a = e F1 - b F(dt),   var = q1 - b c^T
    c = e Q1 F2^T,   Q = Q(dt),   dt = t_i+1 - t_i

with F1, Q1 over t - t_i, F2 over t_i+1 - t, e the first state and q1 the first element of Q1
(Rasmussen and Williams 2006, appendix B; Särkkä and Solin 2019, section 10). Before the first
and past the last observation the missing neighbour stands at infinity.
"""

import numpy as np
from numba import njit

from mlscorr.collocation.states import fill_noise, fill_transition
from mlscorr.covariance import process_noise, transition


@njit(cache=True, nogil=True, error_model="numpy")
def _invert(matrices, states, out):
    """Inverses of covariances of d <= 3 states by elimination, which no small step harms: it
    acts on the elements' ratios."""
    lower = np.zeros((3, 3))
    for s in range(states.size):
        d = states[s]
        for i in range(d):
            for j in range(i + 1):
                total = matrices[s, i, j]
                for k in range(j):
                    total -= lower[i, k] * lower[j, k] * lower[k, k]
                lower[i, j] = total if i == j else total / lower[j, j]
        for column in range(d):
            for i in range(d):
                total = 1.0 if i == column else 0.0
                for k in range(i):
                    total -= lower[i, k] * out[s, k, column]
                out[s, i, column] = total
            for i in range(d - 1, -1, -1):
                total = out[s, i, column] / lower[i, i]
                for k in range(i + 1, d):
                    total -= lower[k, i] * out[s, k, column]
                out[s, i, column] = total


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _gains(s, states, before, after, whole, inverses, gains):
    """Gains a, b of signal s into gains (s, 2 d), and the variance that both states leave.

    before and after are the times to the neighbours in units of 1 / rate, infinite at the ends.
    """
    q0, q1, q2, _, _, _ = process_noise(states, before)
    f = transition(states, after)
    c0 = q0 * f[0] + q1 * f[1] + q2 * f[2]
    c1 = q0 * f[3] + q1 * f[4] + q2 * f[5]
    c2 = q0 * f[6] + q1 * f[7] + q2 * f[8]
    b0 = c0 * inverses[s, 0, 0] + c1 * inverses[s, 1, 0] + c2 * inverses[s, 2, 0]
    b1 = c0 * inverses[s, 0, 1] + c1 * inverses[s, 1, 1] + c2 * inverses[s, 2, 1]
    b2 = c0 * inverses[s, 0, 2] + c1 * inverses[s, 1, 2] + c2 * inverses[s, 2, 2]
    f = transition(states, before)
    gains[s, 0] = f[0] - b0 * whole[s, 0, 0] - b1 * whole[s, 1, 0] - b2 * whole[s, 2, 0]
    if states > 1:
        gains[s, 1] = f[1] - b0 * whole[s, 0, 1] - b1 * whole[s, 1, 1] - b2 * whole[s, 2, 1]
        gains[s, states + 1] = b1
    if states > 2:
        gains[s, 2] = f[2] - b0 * whole[s, 0, 2] - b1 * whole[s, 1, 2] - b2 * whole[s, 2, 2]
        gains[s, 5] = b2
    gains[s, states] = b0
    return max(q0 - b0 * c0 - b1 * c1 - b2 * c2, 0.0)


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _last_before(nodes, time, i):
    """The last node at or before a time, -1 before all; i is where the search starts."""
    n = nodes.size
    if i < 0 or nodes[i] > time:
        return np.searchsorted(nodes, time, side="right") - 1
    for _ in range(4):
        if i + 1 == n or nodes[i + 1] > time:
            return i
        i += 1
    return np.searchsorted(nodes, time, side="right") - 1


@njit(cache=True, nogil=True, error_model="numpy")
def _gather(layout, i, states, same, following, columns, joint):
    """Columns (2 d, c) and joint covariance (2 d, 2 d) of the states at nodes i and i + 1.

    Process by process, its states at i before those at i + 1; zeros where there is no node.
    """
    n = states.shape[0]
    has_left, has_right = i >= 0, i + 1 < n
    for j in range(layout.first.size):
        a, d = layout.first[j], layout.states[layout.signal[j]]
        for p in range(d):
            u, v = 2 * a + p, 2 * a + d + p
            for c in range(columns.shape[1]):
                columns[u, c] = states[i, a + p, c] if has_left else 0.0
                columns[v, c] = states[i + 1, a + p, c] if has_right else 0.0
            for other in range(layout.first.size):
                b, e = 2 * layout.first[other], layout.states[layout.signal[other]]
                for q in range(e):
                    to = layout.first[other] + q
                    cross = following[i, a + p, to] if has_left and has_right else 0.0
                    joint[u, b + q] = same[i, a + p, to] if has_left else 0.0
                    joint[v, b + e + q] = same[i + 1, a + p, to] if has_right else 0.0
                    joint[u, b + e + q] = joint[b + e + q, u] = cross


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _processes(layout, gains, remaining, columns, joint, row, values, covariance):
    """Columns (k, c) and covariance (k, k) of the processes at one epoch."""
    k = layout.first.size
    for j in range(k):
        s = layout.signal[j]
        a, d = 2 * layout.first[j], 2 * layout.states[s]
        for c in range(columns.shape[1]):
            values[j, c] = gains[s, 0] * columns[a, c]
            for p in range(1, d):
                values[j, c] += gains[s, p] * columns[a + p, c]
        for b in range(a, joint.shape[0]):
            row[b] = gains[s, 0] * joint[a, b]
        for p in range(1, d):
            for b in range(a, joint.shape[0]):
                row[b] += gains[s, p] * joint[a + p, b]
        for other in range(j, k):
            to = layout.signal[other]
            b = 2 * layout.first[other]
            total = remaining[s] if other == j else 0.0
            for p in range(2 * layout.states[to]):
                total += row[b + p] * gains[to, p]
            covariance[j, other] = total
            covariance[other, j] = total


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _mix(e, mixing, processes, mixed, covariance):
    """B C B^T of epoch e, mixing (q, r, k), into covariance (q, r, r)."""
    _, r, k = mixing.shape
    for m in range(r):
        for j in range(k):
            mixed[j] = 0.0
        for j in range(k):
            weight = mixing[e, m, j]
            if weight != 0.0:
                for other in range(k):
                    mixed[other] += weight * processes[j, other]
        for other in range(m + 1):
            total = 0.0
            for j in range(k):
                total += mixed[j] * mixing[e, other, j]
            covariance[e, m, other] = total
            covariance[e, other, m] = total


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _add_trend(e, design, mixing, values, trend, root, lacking, mean, covariance):
    """Mean of epoch e, and what of the trend's covariance the signal does not absorb.

    root is upper triangular. lacking (r, p) is room to work in.
    """
    _, r, p = design.shape
    for m in range(r):
        total = 0.0
        for j in range(mixing.shape[2]):
            total += mixing[e, m, j] * values[j, p]
        for c in range(p):
            total += design[e, m, c] * trend[c]
            lacking[m, c] = design[e, m, c]
            for j in range(mixing.shape[2]):
                lacking[m, c] -= mixing[e, m, j] * values[j, c]
        mean[e, m] = total
        if p == 0:
            continue
        for c in range(p - 1, -1, -1):
            lacking[m, c] *= root[c, c]
            for b in range(c):
                lacking[m, c] += lacking[m, b] * root[b, c]
        for other in range(m + 1):
            total = 0.0
            for c in range(p):
                total += lacking[m, c] * lacking[other, c]
            covariance[e, m, other] += total
            if other != m:
                covariance[e, other, m] += total


@njit(cache=True, nogil=True, error_model="numpy")
def interpolate(
    nodes,
    layout,
    states,
    same,
    following,
    trend,
    trend_root,
    gps_time,
    design,
    mixing,
    mean,
    covariance,
):
    """Trend plus signal at q epochs into mean (q, r) and covariance (q, r, r).

    Parameters
    ----------
    nodes : (n,) array
        Times of the observations, sorted.
    states : (n, d, p + 1) array
        Smoothed states of the columns [A, l - A x].
    same, following : (n, d, d), (n - 1, d, d) array
        Covariances of the smoothed states, and with those of the next node.
    trend, trend_root : (p,), (p, p) array
    gps_time, design, mixing : (q,), (q, r, p), (q, r, k) array
    """
    n, size, _ = states.shape
    q, r, p = design.shape
    k, number = layout.first.size, layout.states.size
    whole, spread = np.zeros((number, 3, 3)), np.zeros((number, 3, 3))
    inverses = np.zeros((number, 3, 3))
    gains, remaining = np.zeros((number, 6)), np.zeros(number)
    columns, joint, row = (
        np.zeros((2 * size, p + 1)),
        np.zeros((2 * size, 2 * size)),
        np.zeros(2 * size),
    )
    values, processes = np.zeros((k, p + 1)), np.zeros((k, k))
    mixed, lacking = np.zeros(k), np.zeros((r, p))
    i = entered = -2  # no interval
    for e in range(q):
        i = _last_before(nodes, gps_time[e], i)
        if i != entered:
            if i + 1 < n:
                span = nodes[i + 1] - nodes[i] if i >= 0 else np.inf
                fill_transition(layout, span, whole)
                fill_noise(layout, span, spread)
                _invert(spread, layout.states, inverses)
            _gather(layout, i, states, same, following, columns, joint)
            entered = i
        before = gps_time[e] - nodes[i] if i >= 0 else np.inf
        after = nodes[i + 1] - gps_time[e] if i + 1 < n else np.inf
        for s in range(number):
            x, y = before * layout.rates[s], after * layout.rates[s]
            remaining[s] = _gains(s, layout.states[s], x, y, whole, inverses, gains)
        _processes(layout, gains, remaining, columns, joint, row, values, processes)
        if r == k == 1:
            covariance[e, 0, 0] = mixing[e, 0, 0] ** 2 * processes[0, 0]
        else:
            _mix(e, mixing, processes, mixed, covariance)
        _add_trend(e, design, mixing, values, trend, trend_root, lacking, mean, covariance)
