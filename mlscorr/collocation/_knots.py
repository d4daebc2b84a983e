"""Knots: epochs at which the states of a signal are unknowns, and the prior of these states.

Given its states at two knots, a process between them is independent of the rest (``conditional``).
A row then depends on f(t) = a f_k + b f_k+1 + r, and as long as r is far below any noise, each row
of an interval may have an independent r. The prior of the states is a sum of squares of

    W (f_k+1 - F f_k),   W Q W^T = I,      so L0 is block tridiagonal in Q^-1, F^T Q^-1 F, -Q^-1 F

(Särkkä and Solin 2019, section 12.3). Q decreases as the step to the power 2 d - 1, and L0 loses
all digits if the steps of smooth signals are too small. Each signal therefore has its own knots.
After one step, r in the middle, Q_11(step / 4), is ``SHARE`` of the signal's sigma: 1/22 of the
correlation time for Matern 5/2, 1/350 for Matern 3/2, 1/184 on the clock of an integrated random
walk. The exponential signal has knots at all epochs. If rows carry less information, longer steps
suffice (``sufficient_steps``). Epochs within a quarter of a step of a knot need none, as r is no
larger there.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from mlscorr.collocation._conditional import conditional_gains
from mlscorr.collocation._matrices import multiply, multiply_transposed, whitening_root
from mlscorr.collocation._pattern import Pattern, locate, panel_width
from mlscorr.collocation._states import Layout, fill_noise, fill_transition
from mlscorr.collocation.covariance import Covariance, process_noise
from mlscorr.compiled_loops import loop

SHARE = 5e-5  # of a signal's sigma as interpolation error between knots: 0.05 mm of a drift of 1 m


class Knots(NamedTuple):
    """Knots of s signals, numbered signal after signal.

    Parameters
    ----------
    first : (s + 1,) int array
        Index of each signal's first knot.
    clock : (k,) array
        Of each knot, by its signal's clock.
    times : (u,) array
        All knots' times, sorted and distinct. Units: s.
    cells : (u + 1, s, 2) int array
        Indices of each signal's knots before and after an interval of ``times``, -1 if there is
        none.
    """

    first: np.ndarray
    clock: np.ndarray
    times: np.ndarray
    cells: np.ndarray

    @classmethod
    def of(cls, gps_time: np.ndarray, clocks: np.ndarray, steps: Sequence[float]) -> Knots:
        """Choose the knots that signals need at given epochs.

        Parameters
        ----------
        gps_time, clocks : (q,), (q, s) array
            Of the epochs, in any order, with repetitions. Units: s.
        steps : sequence of float
            Largest step of each signal between its knots, on its clock.
        """
        epochs, rows = np.unique(gps_time, return_index=True)
        kept = [thinned(clock, step) for clock, step in zip(clocks[rows].T, steps, strict=True)]
        first = np.concatenate([[0], np.cumsum([len(k) for k in kept])]).astype(np.int64)
        times = np.unique(np.concatenate([epochs[:0], *(epochs[k] for k in kept)]))
        edges = np.append(-np.inf, times)
        cells = np.empty((len(edges), len(kept), 2), dtype=np.int64)
        for s, k in enumerate(kept):
            after = np.searchsorted(epochs[k], edges, side="right")
            cells[:, s, 0] = np.where(after > 0, first[s] + after - 1, -1)
            cells[:, s, 1] = np.where(after < len(k), first[s] + after, -1)
        parts = [clocks[rows[k], s] for s, k in enumerate(kept)]
        return cls(first, np.concatenate([epochs[:0], *parts]), times, cells)


def knot_step(covariance: Covariance, share: float = SHARE) -> float:
    """Largest step between knots at epochs, on the signal's clock.

    Parameters
    ----------
    covariance : Covariance
    share : float
        Allowed interpolation error as a share of the signal's sigma.
    """
    small = 1e-3  # below it Q_11 has only its first power
    power = 1.0 / (2 * covariance.states - 1)
    variance = process_noise(covariance.kind, small)[0]
    return float(4 * small * (share**2 / variance) ** power / covariance.rate)


@loop
def thinned(clock: np.ndarray, step: float) -> np.ndarray:
    """Indices of the epochs that are knots.

    Two adjacent knots are at most one step apart, or all epochs between them are within a quarter
    of a step of the first.

    Parameters
    ----------
    clock : (n,) array
        Non-decreasing.
    step : float
    """
    knots = np.empty(clock.size, dtype=np.int64)
    count = last = 0
    for i in range(clock.size):
        if count > 0:
            if clock[i] - clock[knots[count - 1]] <= step:
                last = i
                continue
            if clock[last] - clock[knots[count - 1]] > 0.25 * step:
                knots[count] = last
                count += 1
                if clock[i] - clock[last] <= step:
                    last = i
                    continue
        knots[count] = last = i
        count += 1
    if count > 0 and clock[last] - clock[knots[count - 1]] > 0.25 * step:
        knots[count] = last
        count += 1
    return knots[:count].copy()


@loop
def prior_roots(layout: Layout, knots: Knots) -> tuple[np.ndarray, np.ndarray]:
    """W and W F of the step to each knot; for a first knot W of the stationary prior, and zero.

    Parameters
    ----------
    layout : Layout
    knots : Knots

    Returns
    -------
    roots, carried : (k, 3, 3) array
    """
    roots, carried = np.zeros((2, knots.clock.size, 3, 3))
    number = layout.states.size
    f, q = np.zeros((2, 1, number, 3, 3))
    for s in range(number):
        d = layout.states[s]
        for j in range(knots.first[s], knots.first[s + 1]):
            span = np.inf
            if j > knots.first[s]:
                span = knots.clock[j] - knots.clock[j - 1]
                fill_transition(layout, np.full((1, number), span), f)
            fill_noise(layout, np.full((1, number), span), q)
            block = q[0, s, :d, :d].copy()
            roots[j, :d, :d] = whitening_root(block, np.diag(block))
            if j > knots.first[s]:
                carried[j] = multiply(roots[j], f[0, s])
    return roots, carried


@loop
def add_prior(
    layout: Layout,
    knots: Knots,
    pattern: Pattern,
    roots: np.ndarray,
    carried: np.ndarray,
    values: np.ndarray,
) -> None:
    """Add L0 to the values of a matrix: prior of the knots, and 1 for each state of other nodes.

    Parameters
    ----------
    layout : Layout
    knots : Knots
    pattern : Pattern
    roots, carried : (k, 3, 3) array
        See prior_roots.
    values : (v,) array
    """
    place = pattern.place
    first = pattern.first
    for s in range(layout.states.size):
        d = layout.states[s]
        for j in range(knots.first[s], knots.first[s + 1]):
            here = place[j]
            root = roots[j, :d, :d]
            before = -carried[j, :d, :d]
            _add_to_processes(pattern, values, here, here, multiply_transposed(root, root))
            if j > knots.first[s]:
                there = place[j - 1]
                across = multiply_transposed(root, before)
                _add_to_processes(
                    pattern, values, there, there, multiply_transposed(before, before)
                )
                _add_to_processes(pattern, values, here, there, across)
                _add_to_processes(pattern, values, there, here, across.T)
    for j in range(knots.clock.size, place.size):
        size = first[place[j] + 1] - first[place[j]]
        _add_to_processes(pattern, values, place[j], place[j], np.eye(size))


@loop
def _add_to_processes(pattern, values, i, j, block):
    """Add a block to that of each process in block (i, j), if it is in the lower triangle."""
    position = locate(pattern, i, j)
    d = block.shape[0]
    if position < 0:
        return
    width = panel_width(pattern, j)
    for begin in range(0, pattern.first[j + 1] - pattern.first[j], d):
        for a in range(d):
            row = position + (begin + a) * width + begin
            target = values[row : row + d]
            for b in range(d):
                target[b] += block[a, b]


def cell_clocks(knots: Knots) -> tuple[np.ndarray, np.ndarray]:
    """Clocks (u + 1, s) of each signal's knots before and after each cell, infinite if none.

    Parameters
    ----------
    knots : Knots
    """
    clock = np.append(knots.clock, np.nan)  # NaN for index -1
    before = np.where(knots.cells[..., 0] >= 0, clock[knots.cells[..., 0]], -np.inf)
    after = np.where(knots.cells[..., 1] >= 0, clock[knots.cells[..., 1]], np.inf)
    return before, after


def knot_gains(
    layout: Layout, knots: Knots, cell: np.ndarray, clocks: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Gains of each signal's states at the knots adjacent to q epochs; see ``conditional_gains``.

    Parameters
    ----------
    layout : Layout
    knots : Knots
    cell : (q,) int array
        Cell of each epoch.
    clocks : (q, s) array

    Returns
    -------
    gains, remaining : (q, s, 2 d), (q, s) array
    """
    order = np.argsort(cell, kind="stable")
    ordered = conditional_gains(layout, *cell_clocks(knots), cell[order], clocks[order])
    gains, remaining = (np.empty_like(part) for part in ordered)
    gains[order] = ordered[0]
    remaining[order] = ordered[1]
    return gains, remaining
