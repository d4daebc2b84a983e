"""Signal at any epoch from the states at the two nodes about it.

Nodes are the epochs of the observations in the recursion, and knots in the information form.
"""

from collections.abc import Callable

import numpy as np
from numba import njit

from mlscorr.collocation._conditional import Epochs, fill_spans, neighbours, predict_between
from mlscorr.collocation._knots import Knots, enter_cell
from mlscorr.collocation._pattern import Pattern, locate, panel_width
from mlscorr.collocation._states import Layout

CHUNK = 1 << 16  # epochs predicted at once: copies of broadcast designs and mixings stay small


@njit(cache=True, nogil=True)
def run_end(times: np.ndarray, cell: int, gps_time: np.ndarray, begin: int) -> int:
    """End of the run of epochs from begin on that lie in the same cell.

    Parameters
    ----------
    times : (u,) array
        Sorted; cell i lies before times[i], and at or after the time before that.
    cell, begin : int
    gps_time : (q,) array
    """
    first = times[cell - 1] if cell > 0 else -np.inf
    last = times[cell] if cell < times.size else np.inf
    end = begin + 1
    while end < gps_time.size and first <= gps_time[end] < last:
        end += 1
    return end


@njit(cache=True, nogil=True, error_model="numpy")
def _gather(layout, i, states, same, following, columns, joint):
    """Columns (2 d, c) and joint covariance (2 d, 2 d) of the states at nodes i and i + 1.

    Process by process, its states at i before those at i + 1; zeros where there is no node.
    """
    has_left = i >= 0
    has_right = i + 1 < states.shape[0]
    for j in range(layout.first.size):
        a = layout.first[j]
        d = layout.states[layout.signal[j]]
        for p in range(d):
            u = 2 * a + p
            v = 2 * a + d + p
            for c in range(columns.shape[1]):
                columns[u, c] = states[i, a + p, c] if has_left else 0.0
                columns[v, c] = states[i + 1, a + p, c] if has_right else 0.0
            for other in range(layout.first.size):
                b = 2 * layout.first[other]
                e = layout.states[layout.signal[other]]
                for q in range(e):
                    to = layout.first[other] + q
                    if has_left and has_right:
                        cross = following[i, a + p, to]
                    else:
                        cross = 0.0
                    joint[u, b + q] = same[i, a + p, to] if has_left else 0.0
                    joint[v, b + e + q] = same[i + 1, a + p, to] if has_right else 0.0
                    joint[u, b + e + q] = joint[b + e + q, u] = cross


@njit(cache=True, nogil=True, error_model="numpy")
def interpolate(
    nodes: np.ndarray,
    clocks: np.ndarray,
    layout: Layout,
    states: np.ndarray,
    same: np.ndarray,
    following: np.ndarray,
    epochs: Epochs,
) -> None:
    """Fill epochs with trend plus signal.

    Parameters
    ----------
    nodes : (n,) array
        Times of the observations, sorted.
    clocks : (n, s) array
        The signals' clocks there.
    states : (n, d, p + 1) array
        Smoothed states of the columns [A, l - A x].
    same, following : (n, d, d), (n - 1, d, d) array
        Covariances of the smoothed states, and with those of the next node.
    epochs : Epochs
    """
    n, size, columns = states.shape
    about = neighbours(layout.states.size, size, columns - 1)
    begin = 0
    while begin < epochs.gps_time.size:
        cell = np.searchsorted(nodes, epochs.gps_time[begin], side="right")
        end = run_end(nodes, cell, epochs.gps_time, begin)
        for signal in range(clocks.shape[1]):  # assigning arrays would take seconds to compile
            about.before[signal] = clocks[cell - 1, signal] if cell > 0 else -np.inf
            about.after[signal] = clocks[cell, signal] if cell < n else np.inf
        fill_spans(layout, about)
        _gather(layout, cell - 1, states, same, following, about.columns, about.joint)
        predict_between(layout, about, epochs, begin, end)
        begin = end


@njit(cache=True, nogil=True)
def _slots(layout):
    """Slot (signal, before or after) of each state in Neighbours.joint, and its place in a knot."""
    slot, local = np.zeros((2, 2 * layout.states[layout.signal].sum()), dtype=np.int64)
    u = begin = 0
    for j in range(layout.signal.size):
        s = layout.signal[j]
        d = layout.states[layout.signal[j]]
        if j > 0 and s != layout.signal[j - 1]:
            begin = layout.first[j]
        for end in range(2):
            for p in range(d):
                slot[u] = 2 * s + end
                local[u] = layout.first[j] - begin + p
                u += 1
    return slot, local


@njit(cache=True, nogil=True)
def _gather_knots(pattern, nodes, slots, states, inverse, about):
    """States at the knots (2 s,) about a cell, as of _gather, by the selected inverse."""
    columns = about.columns
    joint = about.joint
    slot, local = slots
    positions = np.zeros((nodes.size, nodes.size), dtype=np.int64)
    for a in range(nodes.size):
        for b in range(nodes.size):
            if nodes[a] >= nodes[b] >= 0:
                positions[a, b] = locate(pattern, nodes[a], nodes[b])
    for u in range(slot.size):
        node = nodes[slot[u]]
        for c in range(columns.shape[1]):
            columns[u, c] = 0.0 if node < 0 else states[pattern.first[node] + local[u], c]
        for v in range(slot.size):
            other = nodes[slot[v]]
            if node < 0 or other < 0 or inverse.size == 0:
                joint[u, v] = 0.0
            elif node >= other:
                width = panel_width(pattern, other)
                joint[u, v] = inverse[positions[slot[u], slot[v]] + local[u] * width + local[v]]
                joint[v, u] = joint[u, v]


@njit(cache=True, nogil=True)
def interpolate_knots(
    layout: Layout,
    knots: Knots,
    pattern: Pattern,
    cells: np.ndarray,
    states: np.ndarray,
    inverse: np.ndarray,
    epochs: Epochs,
) -> None:
    """Fill epochs with trend plus signal.

    Parameters
    ----------
    layout : Layout
    knots : Knots
    pattern : Pattern
    cells : (u + 1, s, 2) int array
        Knots.cells in the order of elimination.
    states : (n, p + 1) array
        Estimated from the columns [A, l - A x].
    inverse : (v,) array
        Values of the selected inverse; none where only means are asked for.
    epochs : Epochs
    """
    size = layout.states[layout.signal].sum()
    about = neighbours(layout.states.size, size, states.shape[1] - 1)
    slots = _slots(layout)
    begin = 0
    while begin < epochs.gps_time.size:
        cell = np.searchsorted(knots.times, epochs.gps_time[begin], side="right")
        end = run_end(knots.times, cell, epochs.gps_time, begin)
        enter_cell(layout, knots, cell, about)
        _gather_knots(pattern, cells[cell].ravel(), slots, states, inverse, about)
        predict_between(layout, about, epochs, begin, end)
        begin = end


def predictor_by(
    fill: Callable, layout: Layout, trend: np.ndarray, trend_root: np.ndarray
) -> Callable:
    """A predictor as ``Collocation.predict`` calls it, in chunks: mean and covariance.

    Parameters
    ----------
    fill : function of Epochs
        Which fills them.
    layout : Layout
    trend, trend_root : (p,), (p, p) array
        The root is None where only means are asked for.
    """
    if trend_root is None:
        root = np.zeros((len(trend), len(trend)))
    else:
        root = trend_root
    processes = np.bincount(layout.signal, minlength=layout.states.size).tolist()

    def predict(gps_time, clocks, design, mixings):
        q, r = design.shape[:2]
        shapes = [np.shape(values) for values in (design, *mixings)]
        if shapes != [(len(gps_time), r, k) for k in (len(trend), *processes)]:
            raise ValueError(
                f"{len(gps_time)} epochs are asked with a design and mixings of shapes "
                f"{shapes}: they should be (epochs, quantities, trend parameters) and (epochs, "
                f"quantities, processes), of {len(trend)} and {processes} columns."
            )
        mean = np.empty((q, r))
        covariance = np.empty((q, r, r))
        for i in range(0, q, CHUNK):
            part = slice(i, i + CHUNK)
            blocks = [np.zeros((len(gps_time[part]), r, 0)), *(m[part] for m in mixings)]
            epochs = Epochs(
                np.ascontiguousarray(gps_time[part]),
                np.ascontiguousarray(clocks[part]),
                np.ascontiguousarray(design[part], dtype=float),
                np.concatenate(blocks, axis=2),
                trend,
                root,
                mean[part],
                covariance[part],
            )
            fill(epochs)
        if trend_root is None:
            return (mean,)
        return (mean, covariance)

    return predict
