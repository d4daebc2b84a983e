"""Whitening of scalar observations against the covariance written out."""

import numpy as np
import pytest

from mlscorr.collocation import FAMILIES, Covariance, Signal, factor

START = 413_200.0  # s of week
N = 90
SHARED = 4


@pytest.fixture(scope="module", params=FAMILIES)
def bed(request):
    "A Whitener of 90 observations at GPS times, two of them at one moment, and V written out"
    rng = np.random.default_rng(3)
    time = START + np.sort(rng.uniform(0.0, 300.0, N))
    time[11] = time[10]
    variance = rng.uniform(1e-6, 4e-6, N)
    common = np.where(rng.random((N, SHARED)) < 0.3, 0.01, 0.0)
    signals = [
        Signal(0.02 * rng.normal(size=(N, 1, 3)), Covariance(request.param, 20.0)),
        Signal(0.01 * rng.normal(size=(N, 1, 2)), Covariance("exponential", 3.0)),
    ]
    lag = np.subtract.outer(time, time)
    v = np.diag(variance) + common @ common.T
    for signal in signals:
        v += signal.covariance(lag) * (signal.mixing[:, 0] @ signal.mixing[:, 0].T)
    return factor(time, signals, variance, common), v, rng.standard_normal((N, 130))


def test_products_are_those_of_the_inverse(bed):
    "a^T V^-1 b, their diagonal and their blocks, of more columns than are filtered at once"
    whitener, v, columns = bed
    expected = columns.T @ np.linalg.solve(v, columns)
    white = whitener.whiten(columns)
    scale = np.abs(expected).max()
    assert np.abs(white.product(white) - expected).max() < 1e-9 * scale
    assert np.abs(white.squares - np.diag(expected)).max() < 1e-9 * scale
    index = np.array([[0, 5, 9], [2, 128, 7]])
    blocks = white.blocks(index)
    for block, numbers in zip(blocks, index, strict=True):
        assert np.abs(block - expected[np.ix_(numbers, numbers)]).max() < 1e-9 * scale


def test_the_likelihood_is_that_of_the_normal_density(bed):
    "log det V and the likelihood, without the constant of 2 pi"
    whitener, v, columns = bed
    determinant = np.linalg.slogdet(v)[1]
    assert whitener.log_determinant == pytest.approx(determinant, abs=1e-8)
    squares = (columns * np.linalg.solve(v, columns)).sum(axis=0)
    assert np.allclose(whitener.log_likelihood(columns), -0.5 * (squares + determinant))


def test_innovations_are_those_of_the_cholesky_factor(bed):
    "Each observation against all earlier ones"
    whitener, v, columns = bed
    lower = np.linalg.cholesky(v)
    innovations, sigma = whitener.innovations(columns)
    assert np.allclose(sigma, np.diag(lower), rtol=1e-7)
    assert np.allclose(innovations, np.linalg.solve(lower, columns), atol=1e-6)


def test_solves_by_the_inverse(bed):
    "V^-1 c and the diagonal of V^-1"
    whitener, v, columns = bed
    inverse = np.linalg.inv(v)
    weights, precision = whitener.solve(columns)
    assert np.allclose(weights, inverse @ columns, atol=1e-9 * np.abs(inverse).max())
    assert np.allclose(precision, np.diag(inverse), rtol=1e-7)


def test_other_errors_in_common_need_no_new_factor(bed):
    "Without errors in common V0 is left, and the recursion is the same object"
    whitener, v, columns = bed
    separate = whitener.with_common(np.zeros((N, 0)))
    v0 = v - whitener.common @ whitener.common.T
    assert separate.recursion is whitener.recursion
    assert separate.log_determinant == pytest.approx(np.linalg.slogdet(v0)[1], abs=1e-8)
    expected = np.diag(columns.T @ np.linalg.solve(v0, columns))
    assert np.allclose(separate.whiten(columns).squares, expected)


@pytest.mark.parametrize("tails", [None, np.array([-3.0, 0.1, 0.2, -0.1, 2.8, 0.0])])
def test_draws_have_the_covariance_that_they_are_drawn_from(bed, tails):
    "The mean of c^T V^-1 c over many draws is their number of observations, heavy tails or not"
    whitener = bed[0]
    squares = whitener.whiten(whitener.draw(np.random.default_rng(2), 600, tails)).squares
    assert squares.mean() == pytest.approx(N, abs=5 * squares.std() / np.sqrt(600))


def test_the_zero_of_time_does_not_matter(bed):
    "Another zero of time gives the same products to rounding"
    signals = [Signal(np.ones((3, 1, 1)), Covariance("matern32", 10.0))]
    time = np.array([0.0, 2.0, 7.0])
    columns = np.eye(3)
    some, others = (
        factor(time + zero, signals, np.full(3, 0.1)).whiten(columns).squares
        for zero in (0.0, START)
    )
    assert np.allclose(some, others, rtol=1e-9)


def test_a_singular_covariance_is_refused():
    "Two observations of one time without noise"
    signals = [Signal(np.ones((2, 1, 1)), Covariance("matern32", 10.0))]
    with pytest.raises(ValueError, match="2 misclosures is not positive definite"):
        factor(np.array([START, START]), signals, np.zeros(2))


def test_observations_out_of_order_are_refused():
    "The recursion runs forward in time"
    signals = [Signal(np.ones((2, 1, 1)), Covariance("matern32", 10.0))]
    with pytest.raises(ValueError, match="1 of 2 observations are earlier"):
        factor(np.array([START, START - 1.0]), signals, np.ones(2))
