"""Knots know of each other where an observation or an epoch sees both."""

from itertools import combinations

import numpy as np

from mlscorr.collocation._knots import Knots, knot_step
from mlscorr.collocation._states import Layout
from mlscorr.collocation.linked import information_edges
from mlscorr.collocation.sparse_rows import Sides
from tests.collocation.linked_rows import Street


def sides_of(street, nodes=1000):
    "Layout, knots, and Sides of control and ties"
    rows = street.rows
    times, clocks = (np.concatenate(part) for part in zip(*(r.epochs for r in rows), strict=True))
    layout = Layout.of(rows[0].signals)
    knots = Knots.of(times, clocks, [knot_step(signal.covariance) for signal in rows[0].signals])
    return layout, knots, [Sides.of(part, layout, knots, nodes) for part in rows]


def test_knots_about_a_time_and_those_of_a_tie_are_linked():
    "All pairs about each cell, all across a tie, each target's error with its knots; no others"
    layout, knots, sides = sides_of(Street("matern52", 60.0, targets=4, ties=9), 500)
    edges = information_edges(layout, knots, sides)
    linked = {frozenset(pair) for pair in edges.tolist()}
    expected = set()
    for cell in knots.cells:
        expected |= {frozenset(pair) for pair in combinations(cell[cell >= 0].tolist(), 2)}
    assert expected <= linked
    control, ties = sides
    for cells in ties.cell:
        first, second = (knots.cells[cell, :, 0].tolist() for cell in cells)
        assert all(frozenset((a, b)) in linked for a in first for b in second if a != b)
    for cell, unknown in zip(control.cell[:, 0], control.unknown, strict=True):
        assert all(frozenset((a, unknown)) in linked for a in knots.cells[cell, :, 0].tolist())
    about = {int(cell): set(knots.cells[cell].ravel()) for cell in np.unique(ties.cell)}
    across = {(a, b) for row in ties.cell for a in about[row[0]] for b in about[row[1]]}
    targets = {
        (a, u)
        for row, u in zip(control.cell, control.unknown, strict=True)
        for a in knots.cells[row[0]].ravel()
    }
    allowed = expected | {frozenset(map(int, pair)) for pair in across | targets}
    assert linked <= allowed


def test_at_a_knot_the_next_one_is_not_seen():
    "Exponential signals have knots at all epochs: a tie links two of each, not four"
    layout, knots, sides = sides_of(Street("exponential", 60.0, targets=4, ties=9), 500)
    edges = information_edges(layout, knots, sides)
    linked = {frozenset(pair) for pair in edges.tolist()}
    about = {frozenset(pair) for c in knots.cells for pair in combinations(c.ravel().tolist(), 2)}
    ties = sides[1]
    seen = {
        frozenset((int(a), int(b)))
        for first, second in ties.cell
        for a in knots.cells[first, :, 0]
        for b in knots.cells[second, :, 0]
    }
    errors = {pair for pair in linked if max(pair) >= 500}
    assert linked - about - errors <= seen
