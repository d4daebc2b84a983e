"""Scalar observations need no states kept, and errors in common are estimated as they come."""

import numpy as np
import pytest

from mlscorr.collocation._recursion import Recursion, filter_columns
from mlscorr.collocation._scalar import common_innovations, whiten_columns
from tests.collocation.joint_states import Bed


def scalar_recursion(bed):
    "The recursion without the axis of observations"
    recursion, _ = bed.filtered()
    parts = recursion.mixing[:, 0], recursion.gains[:, 0], recursion.whiteners[:, 0, 0]
    return Recursion(recursion.layout, recursion.transitions, *map(np.ascontiguousarray, parts))


@pytest.mark.parametrize("seed", range(5))
def test_white_columns_are_those_of_the_recursion(seed):
    "Whitened without states they equal what the filter of vectors gives, and V becomes one"
    bed = Bed(seed, n=12, r=1)
    expected = filter_columns(bed.filtered()[0], bed.columns)[0][:, 0]
    out = np.empty_like(expected)
    whiten_columns(scalar_recursion(bed), bed.columns[:, 0], out)
    np.testing.assert_allclose(out, expected, atol=1e-10)
    w = np.empty((12, 12))
    whiten_columns(scalar_recursion(bed), np.eye(12), w)
    np.testing.assert_allclose(w @ bed.total @ w.T, np.eye(12), atol=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_coloured_columns_are_a_root_of_the_covariance(seed):
    "L of unit columns has L L^T = V, and whitening takes it back"
    bed = Bed(seed, n=12, r=1)
    root = np.empty((12, 12))
    back = np.empty((12, 12))
    whiten_columns(scalar_recursion(bed), np.eye(12), root, True)
    np.testing.assert_allclose(root @ root.T, bed.total, atol=1e-9)
    np.testing.assert_allclose(root, np.tril(root), atol=1e-12)
    whiten_columns(scalar_recursion(bed), root, back)
    np.testing.assert_allclose(back, np.eye(12), atol=1e-8)


def test_drawn_values_have_the_stated_covariance():
    "20 000 coloured draws vary and covary as V says, to 4 standard errors"
    bed = Bed(7, n=6, r=1)
    number = 20_000
    drawn = np.empty((6, number))
    whiten_columns(
        scalar_recursion(bed), np.random.default_rng(1).normal(size=(6, number)), drawn, True
    )
    sigma = np.sqrt(np.diag(bed.total))
    error = np.sqrt((np.outer(sigma, sigma) ** 2 + bed.total**2) / number)
    assert (np.abs(drawn @ drawn.T / number - bed.total) < 4 * error).all()


def passes(n, targets, rng):
    "Sigmas by which errors of targets enter observations of several passes, some of none"
    shared = np.zeros((n, targets))
    shared[np.arange(n), rng.integers(0, targets, n)] = rng.uniform(0.5, 3.0, n)
    shared[::4] = 0.0
    return shared


@pytest.mark.parametrize("dense", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_errors_in_common_are_whitened(seed, dense):
    "Innovations of I + U U^T are those of its Cholesky factor, whether U is sparse or full"
    rng = np.random.default_rng(seed)
    if dense:
        shared = rng.normal(size=(15, 3))
    else:
        shared = passes(15, 3, rng)
    columns = rng.normal(size=(15, 4))
    lower = np.linalg.cholesky(np.eye(15) + shared @ shared.T)
    innovations, growth = common_innovations(shared, columns)
    np.testing.assert_allclose(innovations, np.linalg.solve(lower, columns), atol=1e-12)
    np.testing.assert_allclose(growth, np.diag(lower), atol=1e-12)


def test_without_errors_in_common_nothing_changes():
    "White observations stay as they are, bit for bit"
    columns = np.random.default_rng(2).normal(size=(8, 3))
    for shared in (np.zeros((8, 0)), np.zeros((8, 2))):
        innovations, growth = common_innovations(shared, columns)
        np.testing.assert_array_equal(innovations, columns)
        np.testing.assert_array_equal(growth, np.ones(8))


def test_what_is_in_common_is_learnt():
    "Of a large error seen k times before, what isn't known of it has the variance 1 / k"
    innovations, growth = common_innovations(np.full((50, 1), 1e4), np.full((50, 1), 7.0))
    k = np.arange(1, 50)
    np.testing.assert_allclose(growth[1:] ** 2, 1.0 + 1.0 / k, rtol=1e-6)
    assert growth[0] == pytest.approx(1e4) and np.abs(innovations[1:]).max() < 1e-6
