"""Interpolation of the signal at any epoch from the states at the two adjacent nodes.

Nodes are the epochs of the observations in the recursion, and knots in the information form.
"""

from collections.abc import Callable

import numpy as np

from mlscorr.collocation._conditional import conditional_gains, process_moments
from mlscorr.collocation._knots import Knots, cell_clocks
from mlscorr.collocation._pattern import Pattern, locate, panel_width
from mlscorr.collocation._states import Layout
from mlscorr.compiled_loops import loop

CHUNK = 1 << 13  # epochs predicted at once, which keeps the covariances of their states small


def interpolate(
    nodes: np.ndarray,
    clocks: np.ndarray,
    layout: Layout,
    states: np.ndarray,
    same: np.ndarray,
    following: np.ndarray,
    gps_time: np.ndarray,
    asked: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Estimates (q, k, p + 1) and covariances (q, k, k) of the processes at q epochs.

    Parameters
    ----------
    nodes : (n,) array
        Times of the observations, sorted.
    clocks : (n, s) array
        The signals' clocks at the nodes.
    layout : Layout
    states : (n, d, p + 1) array
        Smoothed states of the columns [A, l - A x].
    same, following : (n, d, d), (n - 1, d, d) array
        Covariances of the smoothed states at a node, and with those at the next node.
    gps_time, asked : (q,), (q, s) array
        The queried epochs, and the signals' clocks there.
    """
    n, size, columns = states.shape
    after, cell = np.unique(np.searchsorted(nodes, gps_time, side="right"), return_inverse=True)
    has_before = after > 0
    has_after = after < n
    has_both = has_before & has_after
    infinite = np.full((1, clocks.shape[1]), np.inf)
    gains, remaining = conditional_gains(
        layout,
        np.concatenate([-infinite, clocks])[after],
        np.concatenate([clocks, infinite])[after],
        cell,
        asked,
    )
    earlier, later = _places(layout)
    about = np.zeros((len(after), 2 * size, columns))
    about[np.ix_(has_before, earlier)] = states[after[has_before] - 1]
    about[np.ix_(has_after, later)] = states[after[has_after]]
    across = following[after[has_both] - 1]
    joint = np.zeros((len(after), 2 * size, 2 * size))
    joint[np.ix_(has_before, earlier, earlier)] = same[after[has_before] - 1]
    joint[np.ix_(has_after, later, later)] = same[after[has_after]]
    joint[np.ix_(has_both, earlier, later)] = across
    joint[np.ix_(has_both, later, earlier)] = across.swapaxes(1, 2)
    return process_moments(layout, cell, gains, remaining, about, joint)


def _places(layout):
    """Positions (d,) of the states before and after a cell, process by process."""
    states = layout.states[layout.signal]
    first = np.repeat(layout.first, states)
    earlier = np.arange(len(first)) + first
    return earlier, earlier + np.repeat(states, states)


def _slots(layout):
    """Signal (2 d,) of each state of a cell, its side (0 before), and its position in a knot."""
    earlier, later = _places(layout)
    processes = layout.signal
    states = layout.states[processes]
    signal = np.repeat(processes, states)
    begin = layout.first[np.searchsorted(processes, processes)]  # first process of each signal
    local = np.arange(len(signal)) - np.repeat(begin, states)
    slots = np.empty((3, 2 * len(signal)), dtype=np.int64)
    slots[:, earlier] = [signal, np.zeros_like(signal), local]
    slots[:, later] = [signal, np.ones_like(signal), local]
    return slots


@loop
def _selected(pattern, nodes, place, inverse, joint):
    """Copy the selected inverse at states of nodes (u, v), -1 for none, to joint (u, v, v)."""
    for u in range(nodes.shape[0]):
        for a in range(nodes.shape[1]):
            position = -1
            width = 0
            for b in range(nodes.shape[1]):
                node = nodes[u, a]
                other = nodes[u, b]
                if other < 0 or node < other:
                    continue
                if b == 0 or other != nodes[u, b - 1]:
                    position = locate(pattern, node, other)
                    width = panel_width(pattern, other)
                joint[u, a, b] = inverse[position + place[a] * width + place[b]]
                joint[u, b, a] = joint[u, a, b]


def interpolate_knots(
    layout: Layout,
    knots: Knots,
    pattern: Pattern,
    cells: np.ndarray,
    states: np.ndarray,
    inverse: np.ndarray,
    gps_time: np.ndarray,
    asked: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Estimates (q, k, p + 1) and covariances (q, k, k) of the processes at q epochs, from knots.

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
        Values of the selected inverse; empty if only means are needed.
    gps_time, asked : (q,), (q, s) array
        The queried epochs, and the signals' clocks there.
    """
    entered, cell = np.unique(
        np.searchsorted(knots.times, gps_time, side="right"), return_inverse=True
    )
    before, after = cell_clocks(knots)
    gains, remaining = conditional_gains(layout, before[entered], after[entered], cell, asked)
    signal, side, place = _slots(layout)
    nodes = cells[entered][:, signal, side]
    rows = np.append(pattern.first[:-1], -1)[nodes] + place
    about = np.where((nodes >= 0)[..., None], states[rows], 0.0)
    joint = np.zeros((*nodes.shape, nodes.shape[1]))
    if inverse.size > 0:
        _selected(pattern, nodes, place, inverse, joint)
    return process_moments(layout, cell, gains, remaining, about, joint)


def predictor_by(
    moments: Callable, layout: Layout, trend: np.ndarray, trend_root: np.ndarray
) -> Callable:
    """Make a predictor for ``Collocation.predict``, which returns mean and covariance in chunks.

    Parameters
    ----------
    moments : function
        Estimates (q, k, p + 1) of the processes from the columns [A, l - A x], and their
        covariance (q, k, k), at epochs gps_time (q,) and clocks (q, s).
    layout : Layout
    trend, trend_root : (p,), (p, p) array
        The root is None if only means are needed.
    """
    processes = np.bincount(layout.signal, minlength=layout.states.size).tolist()

    def predict(gps_time, clocks, design, mixings):
        q, r = design.shape[:2]
        shapes = [np.shape(values) for values in (design, *mixings)]
        if shapes != [(len(gps_time), r, k) for k in (len(trend), *processes)]:
            raise ValueError(
                f"{len(gps_time)} epochs were requested with a design and mixings of shapes "
                f"{shapes}. They must be (epochs, quantities, trend parameters) and (epochs, "
                f"quantities, processes), with {len(trend)} and {processes} columns."
            )
        mean = np.empty((q, r))
        covariance = np.empty((q, r, r))
        for i in range(0, q, CHUNK):
            part = slice(i, i + CHUNK)
            count = len(gps_time[part])
            mixing = np.concatenate([np.zeros((count, r, 0)), *(m[part] for m in mixings)], axis=2)
            values, spread = moments(
                np.ascontiguousarray(gps_time[part]), np.ascontiguousarray(clocks[part])
            )
            mean[part] = design[part] @ trend + (mixing @ values[..., -1:])[..., 0]
            if trend_root is None:
                continue
            # the part of the trend's covariance that the signal does not absorb
            left = (design[part] - mixing @ values[..., :-1]) @ trend_root
            covariance[part] = mixing @ spread @ mixing.swapaxes(1, 2) + left @ left.swapaxes(1, 2)
        if trend_root is None:
            return (mean,)
        return (mean, covariance)

    return predict
