"""The rows as observations, and V of them against the covariance written out."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.gap.evidence import ErrorModel, Observations
from mlscorr.gap.evidence.observations import STATED
from mlscorr.gap.residuals import background
from tests.gap.inference import dense


@pytest.mark.parametrize("bed", ["with_surface", "with_planes"])
def test_whitens_as_the_covariance_written_out_does(bed, request):
    "Products c^T V^-1 c and log det V up to a constant, also for planes that were seen twice"
    g, signs = request.getfixturevalue(bed)
    observed = Observations.of(g.rows, g.background)
    columns = np.hstack([one.jacobian for one in signs[:8] if one.jacobian.any()])
    others = (
        STATED,
        ErrorModel(1.5, "exponential", 0.3, (0.7, "matern32", 2.0), (2.0,), 1.6, 0.01),
    )
    determinants = []
    for model in others:
        factor = observed.whitener(model)
        white = factor.whiten(observed.columns(columns))
        v = dense(g, model)
        plain = columns[g.rows.metric].T @ np.linalg.solve(v, columns[g.rows.metric])
        scale = np.sqrt(np.diag(plain))
        assert np.allclose(
            white.product(white) / np.outer(scale, scale), plain / np.outer(scale, scale), atol=2e-3
        )
        determinants.append([factor.log_determinant, np.linalg.slogdet(v)[1]])
    fast, plain = np.diff(determinants, axis=0)[0]
    assert fast == pytest.approx(plain, abs=0.2)


def test_innovations_are_those_of_the_rows_in_their_order(with_surface):
    "u and sigma are the Cholesky factor's, each row against all earlier ones"
    g, _ = with_surface
    observed = Observations.of(g.rows, g.background)
    residual = np.random.default_rng(1).standard_normal((len(g.rows), 2))
    u, sigma = observed.whitener().innovations(observed.columns(residual))
    place = np.searchsorted(np.flatnonzero(g.rows.metric), observed.row)
    lower = np.linalg.cholesky(dense(g, STATED)[np.ix_(place, place)])
    assert np.allclose(sigma, np.diag(lower))
    assert np.allclose(u, np.linalg.solve(lower, residual[observed.row]))


def test_replicas_have_the_covariance_that_they_are_drawn_from(with_surface):
    "The mean of r^T V^-1 r over many replicas is the number of rows"
    g, _ = with_surface
    factor = Observations.of(g.rows, g.background).whitener()
    squares = factor.whiten(factor.draw(np.random.default_rng(2), 400)).squares
    n = len(factor.common)
    assert squares.mean() == pytest.approx(n, abs=4 * np.sqrt(2 * n / 400))


def test_rows_without_a_metre_are_refused(with_surface):
    "Roughness alone can't say where anything is"
    g, _ = with_surface
    rough = g.rows.select(g.rows.channel == "roughness")
    with pytest.raises(ValueError, match="residuals is in m"):
        Observations.of(rough, background(rough, g.survey))


def test_a_sigma_of_zero_is_refused(with_surface):
    "V must be positive definite"
    g, _ = with_surface
    exact = replace(g.rows, noise=np.zeros(len(g.rows)), survey_factor=np.zeros((len(g.rows), 3)))
    none = replace(
        g.background, position=0 * g.background.position, attitude=0 * g.background.attitude
    )
    with pytest.raises(ValueError, match="a sigma is zero"):
        Observations.of(exact, none).whitener()
