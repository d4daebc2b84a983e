"""Small products and roots by plain loops are those of linear algebra."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mlscorr.collocation._matrices import multiply, multiply_transposed, whitening_root

SHAPES = [(1, 1, 1), (3, 6, 1), (2, 3, 4), (6, 6, 6), (3, 0, 2)]
sizes = st.integers(1, 5)


@pytest.mark.parametrize("rows, inner, columns", SHAPES)
def test_products_are_those_of_matrices(rows, inner, columns):
    "A b and a^T b to the last digits, in shapes of no, one and several elements"
    rng = np.random.default_rng(rows + 10 * inner)
    a = rng.normal(size=(rows, inner))
    b = rng.normal(size=(inner, columns))
    np.testing.assert_allclose(multiply(a, b), a @ b, atol=1e-14)
    np.testing.assert_allclose(multiply_transposed(a.T.copy(), b), a @ b, atol=1e-14)


@settings(max_examples=100, deadline=None)
@given(size=sizes, seed=st.integers(0, 10_000), scale=st.sampled_from([1e-6, 1e-3, 1.0, 1e3]))
def test_the_root_whitens(size, seed, scale):
    "W S W^T = I with W lower triangular, for variances from um^2 to km^2"
    a = np.random.default_rng(seed).normal(size=(size, size))
    s = scale**2 * (a @ a.T + 0.1 * np.eye(size))
    white = whitening_root(s, np.diag(s).copy())
    np.testing.assert_allclose(white @ s @ white.T, np.eye(size), atol=1e-9)
    np.testing.assert_allclose(white, np.tril(white))
    expected = np.linalg.inv(np.linalg.cholesky(s))
    np.testing.assert_allclose(white, expected, rtol=1e-7, atol=1e-9 / scale)


@pytest.mark.parametrize(
    "s",
    [
        np.zeros((1, 1)),
        np.array([[1.0, 1.0], [1.0, 1.0]]),
        np.array([[1.0, 2.0], [2.0, 1.0]]),
        np.diag([1.0, 1.0, -1e-3]),
    ],
    ids=["zero", "twice the same", "indefinite", "negative"],
)
def test_a_matrix_without_a_root_says_so(s):
    "Of a covariance that is singular or worse the first element is no number"
    assert np.isnan(whitening_root(s, np.abs(np.diag(s)) + 1.0)[0, 0])


def test_what_rounding_leaves_of_a_variance_is_nothing():
    "1e-16 of an observation's prior variance is no variance; 1e-12 of it is"
    prior = np.array([4.0])
    assert np.isnan(whitening_root(np.array([[4e-16]]), prior)[0, 0])
    assert whitening_root(np.array([[4e-12]]), prior)[0, 0] == pytest.approx(5e5)
