"""Odd values are allowed for."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.effects import make_effect
from mlscorr.gap.evidence import Observations, without_tails
from mlscorr.gap.evidence.tails import fit_mixture
from tests.gap.inference import named, surveyed


def test_the_likelihood_with_odd_values_is_that_of_the_mixture():
    "Without an offset the closed form; a value far away costs no more than its share"
    rng = np.random.default_rng(6)
    values = 0.2 * rng.standard_normal((300, 1))
    values[:15] = rng.uniform(2.0, 6.0, (15, 1))
    variance = np.full(300, 0.04)
    told = fit_mixture(values, np.zeros(300), variance, 1 / 6)
    share = told.share[0]
    assert share == pytest.approx(0.05, abs=0.02)
    normal = np.exp(-0.5 * values[:, 0] ** 2 / variance) / np.sqrt(2 * np.pi * variance)
    plain = np.log((1 - share) * normal + share / 6).sum()
    assert told.log_likelihood(1e-6)[0] == pytest.approx(plain, abs=0.1)
    values[0] = 100.0
    farther = fit_mixture(values, np.zeros(300), variance, 1 / 6)
    assert farther.best[0] == pytest.approx(told.best[0], abs=1e-6)


def test_an_offset_that_all_share_is_integrated_over():
    "Laplace's approximation against the normal density with the offset in its covariance"
    rng = np.random.default_rng(7)
    values = 0.3 + 0.1 * rng.standard_normal((60, 1))
    variance = np.full(60, 0.01)
    told = fit_mixture(values, np.zeros(60), variance, 1e-9)
    v = np.diag(variance) + 0.2**2
    plain = -0.5 * (
        np.linalg.slogdet(2 * np.pi * v)[1] + values[:, 0] @ np.linalg.solve(v, values[:, 0])
    )
    plain += 60 * np.log(1 - told.share[0])  # nothing is odd, but it might have been
    assert told.log_likelihood(0.2)[0] == pytest.approx(plain, abs=0.02)


@pytest.mark.long
def test_a_wrong_target_is_named_before_it_is_taken_for_a_tail(with_surface):
    "Both passes find the target off; a single row that is off is noise"
    g, signs = with_surface
    effect = make_effect("target_outlier", magnitude=[0.08, -0.05, 0.0], target="T05")
    rows = surveyed(g, 38, effect)
    assert named(rows, g, signs).label == "target_outlier"
    clean = surveyed(g, 38)
    one = np.flatnonzero((clean.channel == "target") & (clean.survey_item == 7))[0]
    residual = clean.residual.copy()
    residual[one] += 0.08
    odd = replace(clean, residual=residual)
    observed = Observations.of(odd, g.background)
    assert one in without_tails(observed, odd, np.zeros((len(observed), 0)))[1]
    assert named(odd, g, signs).label in ("none", "target_outlier")
