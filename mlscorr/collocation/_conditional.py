"""A process at any epoch from its states at the two nodes about it.

Given both states a Markov process between them knows nothing of the rest, so for each process

    E s(t) = a s_i + b s_i+1,   b = c Q^-1,   a = e F1 - b F(dt),   var = q1 - b c^T
    c = e Q1 F2^T,   Q = Q(dt),   dt = t_i+1 - t_i

with F1, Q1 over t - t_i, F2 over t_i+1 - t, e the first state and q1 the first element of Q1
(Rasmussen and Williams 2006, appendix B; Särkkä and Solin 2019, section 10). Before the first
and past the last node the missing neighbour stands at infinity.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from mlscorr.collocation._states import Layout, fill_noise, fill_transition
from mlscorr.collocation.covariance import process_noise, transition


class Neighbours(NamedTuple):
    """The nodes about an epoch, by ``neighbours``; those of the signals may differ.

    Parameters
    ----------
    before, after : (s,) array
        Clocks of the nodes, infinite where there is none.
    whole, spread, inverses : (s, 3, 3) array
        F, Q and Q^-1 between them.
    gains, remaining : (s, 6), (s,) array
        a and b of each signal, and the variance that both states leave.
    columns, joint : (2 d, p + 1), (2 d, 2 d) array
        Estimates of the states and their covariance: process by process, those before the epoch
        and then those after it; zeros where there is no node.
    """

    before: np.ndarray
    after: np.ndarray
    whole: np.ndarray
    spread: np.ndarray
    inverses: np.ndarray
    gains: np.ndarray
    remaining: np.ndarray
    columns: np.ndarray
    joint: np.ndarray


class Epochs(NamedTuple):
    """What is asked at q epochs.

    Parameters
    ----------
    gps_time, clocks, design, mixing : (q,), (q, s), (q, r, p), (q, r, k) array
    trend, root : (p,), (p, p) array
        The trend, and the upper triangular root of its covariance.
    mean, covariance : (q, r), (q, r, r) array
        To be filled with trend plus signal.
    """

    gps_time: np.ndarray
    clocks: np.ndarray
    design: np.ndarray
    mixing: np.ndarray
    trend: np.ndarray
    root: np.ndarray
    mean: np.ndarray
    covariance: np.ndarray


@njit(cache=True, nogil=True)
def neighbours(number: int, size: int, parameters: int) -> Neighbours:
    """No nodes.

    Parameters
    ----------
    number, size, parameters : int
        Of signals, of states, and of the trend.
    """
    return Neighbours(
        np.full(number, -np.inf),
        np.full(number, np.inf),
        np.zeros((number, 3, 3)),
        np.zeros((number, 3, 3)),
        np.zeros((number, 3, 3)),
        np.zeros((number, 6)),
        np.zeros(number),
        np.zeros((2 * size, parameters + 1)),
        np.zeros((2 * size, 2 * size)),
    )


@njit(cache=True, nogil=True, error_model="numpy")
def fill_spans(layout: Layout, about: Neighbours) -> None:
    """F, Q and Q^-1 between the nodes.

    Parameters
    ----------
    layout : Layout
    about : Neighbours
    """
    spans = about.after - about.before
    fill_transition(layout, spans, about.whole)
    fill_noise(layout, spans, about.spread)
    _invert(about.spread, layout.states, about.inverses)


@njit(cache=True, nogil=True, error_model="numpy")
def fill_gains(layout: Layout, about: Neighbours, clocks: np.ndarray) -> None:
    """Gains of all signals and what they leave, at an epoch between the nodes.

    Parameters
    ----------
    layout : Layout
    about : Neighbours
    clocks : (s,) array
    """
    before, after, whole, _, inverses, gains, remaining, _, _ = about
    for s in range(layout.states.size):
        remaining[s] = _gains(
            s, layout, clocks[s] - before[s], after[s] - clocks[s], whole, inverses, gains
        )


@njit(cache=True, nogil=True, error_model="numpy")
def predict_between(
    layout: Layout, about: Neighbours, epochs: Epochs, begin: int, end: int
) -> None:
    """Trend plus signal at the epochs from begin to end, which lie between the same nodes.

    Parameters
    ----------
    layout : Layout
    about : Neighbours
    epochs : Epochs
    begin, end : int
    """
    before, after, whole, _, inverses, gains, remaining, columns, joint = about
    _, clocks, design, mixing, trend, root, mean, covariance = epochs
    k = layout.first.size
    row = np.zeros(joint.shape[0])
    values = np.zeros((k, columns.shape[1]))
    processes = np.zeros((k, k))
    mixed = np.zeros(k)
    lacking = np.zeros(design.shape[1:])
    for e in range(begin, end):
        for s in range(layout.states.size):
            x = clocks[e, s] - before[s]
            y = after[s] - clocks[e, s]
            remaining[s] = _gains(s, layout, x, y, whole, inverses, gains)
        _processes(layout, gains, remaining, columns, joint, row, values, processes)
        if mixing.shape[1] == mixing.shape[2] == 1:
            covariance[e, 0, 0] = mixing[e, 0, 0] ** 2 * processes[0, 0]
        else:
            _mix(e, mixing, processes, mixed, covariance)
        _add_trend(e, design, mixing, values, trend, root, lacking, mean, covariance)


@njit(cache=True, nogil=True, error_model="numpy")
def _invert(matrices, states, out):
    """Inverses of covariances of d <= 3 states by elimination.

    It acts on the elements' ratios, so no small step harms it.
    """
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
def _gains(s, layout, before, after, whole, inverses, gains):
    """Gains a, b of signal s into gains (s, 2 d), and the variance that both states leave.

    before and after are the times to the neighbours by its clock, infinite at the ends.
    """
    kind = layout.kinds[s]
    states = layout.states[s]
    before = before * layout.rates[s]
    after = after * layout.rates[s]
    q0, q1, q2, _, _, _ = process_noise(kind, before)
    f = transition(kind, after)
    c0 = q0 * f[0] + q1 * f[1] + q2 * f[2]
    c1 = q0 * f[3] + q1 * f[4] + q2 * f[5]
    c2 = q0 * f[6] + q1 * f[7] + q2 * f[8]
    b0 = c0 * inverses[s, 0, 0] + c1 * inverses[s, 1, 0] + c2 * inverses[s, 2, 0]
    b1 = c0 * inverses[s, 0, 1] + c1 * inverses[s, 1, 1] + c2 * inverses[s, 2, 1]
    b2 = c0 * inverses[s, 0, 2] + c1 * inverses[s, 1, 2] + c2 * inverses[s, 2, 2]
    f = transition(kind, before)
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
def _processes(layout, gains, remaining, columns, joint, row, values, covariance):
    """Columns (k, c) and covariance (k, k) of the processes at one epoch."""
    k = layout.first.size
    for j in range(k):
        s = layout.signal[j]
        a = 2 * layout.first[j]
        d = 2 * layout.states[s]
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
