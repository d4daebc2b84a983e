"""The blocks of a factor stand where elimination fills them in."""

import numpy as np
import pytest

from mlscorr.collocation._pattern import Pattern, diagonal, locate, panel_width


def random_graph(seed, count=25):
    "Sizes of nodes, and edges of a chain with some links across, some of them twice"
    rng = np.random.default_rng(seed)
    chain = np.column_stack([np.arange(count - 1), np.arange(1, count)])
    edges = np.vstack([chain, rng.integers(0, count, (12, 2)), chain[:3, ::-1]])
    return rng.integers(1, 5, count), edges


def filled(place, edges):
    "Blocks of the lower triangle that are nonzero after elimination, by the definition"
    count = len(place)
    full = np.eye(count, dtype=bool)
    for a, b in place[edges]:
        full[a, b] = full[b, a] = True
    for j in range(count):
        below = np.flatnonzero(full[:, j] & (np.arange(count) > j))
        full[np.ix_(below, below)] = True
    return np.tril(full)


def places(pattern, i, j):
    "Positions of the values (a, b) of block (i, j)"
    rows, columns = (np.arange(n) for n in np.diff(pattern.first)[[i, j]])
    return locate(pattern, i, j) + rows[:, None] * panel_width(pattern, j) + columns


@pytest.mark.parametrize("seed", range(5))
def test_a_pattern_is_that_of_elimination(seed):
    "A front's columns have the blocks that elimination fills in its last; none overlaps another"
    sizes, edges = random_graph(seed)
    pattern = Pattern.of(sizes, edges)
    assert sorted(pattern.place) == list(range(len(sizes)))
    expected = filled(pattern.place, edges)
    last = pattern.node[pattern.front + 1] - 1
    used = np.zeros(len(pattern.zeros), dtype=int)
    for i in range(len(sizes)):
        for j in range(len(sizes)):
            position = locate(pattern, i, j)
            is_inside = i >= j and pattern.front[i] == pattern.front[j]
            assert (position >= 0) == (is_inside or (expected[i, last[j]] and i > j))
            assert position >= 0 or not expected[i, j]
            if position >= 0:
                used[places(pattern, i, j)] += 1
    widths = np.diff(pattern.first[pattern.node])
    sizes_squared = np.bincount(pattern.front, np.diff(pattern.first) ** 2)
    above = ((widths**2 - sizes_squared) / 2).sum()  # blocks above the diagonal within a front
    assert (used <= 1).all() and (used == 0).sum() == above
    assert np.array_equal(np.diff(pattern.first)[pattern.place], sizes)


def test_two_passes_fill_in_little():
    "A ladder of 2 000 knots with rungs keeps four blocks a column, whatever its length"
    count = 2000
    chain = np.column_stack([np.arange(count - 1), np.arange(1, count)])
    rungs = np.column_stack([np.arange(count // 2), count - 1 - np.arange(count // 2)])
    pattern = Pattern.of(np.ones(count, int), np.vstack([chain, rungs]))
    assert len(pattern.row) < 4 * count


def test_small_nodes_are_taken_together():
    "Columns of few values are factored together, for some zeros; those of many stand alone"
    count = 2000
    chain = np.column_stack([np.arange(count - 1), np.arange(1, count)])
    small, large = (Pattern.of(np.full(count, size), chain) for size in (1, 30))
    assert len(small.zeros) < 4 * count
    assert len(small.node) < 0.7 * count
    assert len(large.node) > count / 2


def test_a_diagonal_is_read_in_the_order_of_states():
    "Identity blocks times the node's number"
    pattern = Pattern.of(np.array([2, 1, 3]), np.array([[0, 1], [1, 2]]))
    values = pattern.zeros
    for j, size in enumerate(np.diff(pattern.first)):
        values[places(pattern, j, j)] = (j + 1) * np.eye(size)
    expected = np.repeat([1.0, 2.0, 3.0], np.diff(pattern.first))
    assert np.array_equal(diagonal(pattern, values), expected)


def test_nothing_has_a_pattern_too():
    "Without nodes there is no state"
    pattern = Pattern.of(np.zeros(0, int), np.zeros((0, 2), int))
    assert pattern.states == 0
    assert pattern.zeros.size == 0
