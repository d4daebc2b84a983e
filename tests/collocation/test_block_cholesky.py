"""Factor, solution and selected inverse of sparse matrices are those of dense ones."""

import numpy as np
import pytest

from mlscorr.collocation._block_cholesky import factorise, invert_in_place, solve_in_place
from mlscorr.collocation._pattern import Pattern, diagonal, locate
from tests.collocation.test_pattern import places, random_graph


def blocks(pattern):
    "(rows, columns, where) of each block in the lower triangle"
    first = pattern.first
    for i in range(len(first) - 1):
        for j in range(i + 1):
            if locate(pattern, i, j) >= 0:
                rows, columns = (slice(first[k], first[k + 1]) for k in (i, j))
                yield rows, columns, places(pattern, i, j)


def random_matrix(seed):
    "A pattern, values of a positive definite matrix, and the same dense"
    rng = np.random.default_rng(seed)
    sizes, edges = random_graph(seed)
    pattern = Pattern.of(sizes, edges)
    values = pattern.zeros
    n = pattern.states
    dense = np.zeros((n, n))
    for a, b in np.vstack([edges, np.tile(np.arange(len(sizes))[:, None], 2)]):
        i, j = sorted((pattern.place[a], pattern.place[b]))
        rows, columns = (slice(pattern.first[k], pattern.first[k + 1]) for k in (j, i))
        block = rng.normal(size=dense[rows, columns].shape)
        dense[rows, columns] += block
        dense[columns, rows] += block.T
    dense += (1.0 - np.linalg.eigvalsh(dense)[0]) * np.eye(n)
    for rows, columns, where in blocks(pattern):
        values[where] = dense[rows, columns]
    return pattern, values, dense


@pytest.mark.long
@pytest.mark.parametrize("seed", range(6))
def test_everything_is_that_of_the_dense_matrix(seed):
    "Determinant, solution of five columns, and each block of the inverse, to 1e-10"
    pattern, values, dense = random_matrix(seed)
    assert factorise(pattern, values) == -1
    determinant = 2 * np.log(diagonal(pattern, values)).sum()
    assert determinant == pytest.approx(np.linalg.slogdet(dense)[1], abs=1e-9)
    columns = np.random.default_rng(1).normal(size=(len(dense), 5))
    x = columns.copy()
    solve_in_place(pattern, values, x)
    assert np.abs(dense @ x - columns).max() < 1e-10
    invert_in_place(pattern, values)
    inverse = np.linalg.inv(dense)
    for rows, columns, where in blocks(pattern):
        assert np.abs(values[where] - inverse[rows, columns]).max() < 1e-10


def test_a_pivot_that_is_not_positive_is_named():
    "The state at which an indefinite matrix fails"
    pattern, values, dense = random_matrix(0)
    node = len(pattern.place) // 2
    state = pattern.first[node]
    values[locate(pattern, node, node)] -= 1e3
    dense[state, state] -= 1e3
    assert factorise(pattern, values) == state


def test_a_matrix_of_blocks_alone_needs_no_fill():
    "Two nodes without an edge are factored each by itself"
    pattern = Pattern.of(np.array([2, 2]), np.zeros((0, 2), int))
    values = np.tile([4.0, 0.0, 2.0, 5.0], 2)
    assert factorise(pattern, values) == -1
    assert values == pytest.approx(np.tile([2.0, 0.0, 1.0, 2.0], 2))


def test_no_value_is_so_small_that_its_products_are_slow():
    "Links of 1e-100 fill in 1e-200, of which neither factor nor inverse keeps anything"
    pattern, values, _ = random_matrix(1)
    off = np.concatenate(
        [where.ravel() for rows, columns, where in blocks(pattern) if rows != columns]
    )
    values[off] *= 1e-100
    for work in (factorise, invert_in_place):
        work(pattern, values)
        left = np.abs(values[values != 0.0])
        assert left.min() > 1e-150
        assert 0 < np.count_nonzero(left < 1e-50) < np.count_nonzero(off)
