"""Parameters of causes against plain least squares and Fisher information."""

import numpy as np
import pytest

from mlscorr.gap.evidence import SETTINGS, Observations
from mlscorr.gap.evidence._windows import Window
from mlscorr.gap.evidence.causes import (
    fit_amplitudes,
    most_probable_size,
    window_parameters,
)
from mlscorr.gap.evidence.observations import STATED
from tests.gap.inference import dense


def test_amplitudes_are_those_of_least_squares(with_surface):
    "The generalised least squares with the covariance written out, to 1e-6 of a sigma"
    g, signs = with_surface
    observed = Observations.of(g.rows, g.background)
    jacobian = next(s for s in signs if s.name == "lever_arm").jacobian
    residual = np.random.default_rng(1).normal(scale=0.02, size=len(g.rows))
    columns = observed.columns(np.column_stack([jacobian, residual]))
    fit = fit_amplitudes(observed, [STATED], np.zeros(1), columns[:, 3], columns[:, :3])
    metric = g.rows.metric
    weighed = np.linalg.solve(dense(g, STATED), jacobian[metric])
    normal = jacobian[metric].T @ weighed
    covariance = np.linalg.inv(normal + np.eye(3) / SETTINGS.free_sigma**2)
    expected = covariance @ weighed.T @ residual[metric]
    sigma = np.sqrt(np.diag(covariance))
    assert np.abs(fit.estimate - expected).max() < 1e-6 * sigma.min()
    assert np.allclose(fit.covariance, covariance, rtol=1e-6)
    assert np.allclose(fit.information, np.diag(normal), rtol=1e-6)


def test_two_models_that_disagree_widen_the_covariance(with_surface):
    "The mean lies between, and the spread of the two is in the covariance"
    g, signs = with_surface
    observed = Observations.of(g.rows, g.background)
    jacobian = next(s for s in signs if s.name == "range_bias").jacobian
    residual = np.random.default_rng(2).normal(scale=0.05, size=len(g.rows))
    column = observed.columns(jacobian)
    r = observed.columns(residual[:, None])[:, 0]
    models = [STATED, STATED.__class__(scale=0.4, time=0.1)]
    first, second = (fit_amplitudes(observed, [m], np.zeros(1), r, column) for m in models)
    both = fit_amplitudes(observed, models, np.zeros(2), r, column)
    mean = (first.estimate + second.estimate) / 2
    spread = ((first.estimate - second.estimate) / 2) ** 2
    assert both.estimate == pytest.approx(mean)
    assert both.covariance[0] == pytest.approx(
        (first.covariance[0] + second.covariance[0]) / 2 + spread
    )


def test_the_top_of_a_parabola_is_found_between_the_sizes():
    "A log evidence that is a parabola by log size: its top and its curvature, to 1e-9"
    size = np.array([0.5, 1.0, 2.0, 4.0, 8.0])
    value, sigma = most_probable_size(size, -0.5 * (np.log(size / 3.0) / 0.2) ** 2)
    assert value == pytest.approx(3.0, rel=1e-9)
    assert sigma == pytest.approx(3.0 * 0.2, rel=1e-9)


def test_a_score_without_a_top_says_how_little_it_knows():
    "A straight line has its largest value at the end, and a sigma of the whole"
    size = np.array([0.5, 1.0, 2.0, 4.0])
    assert most_probable_size(size, -np.log(size))[1] > 0.2


def test_windows_are_numbered_where_there_are_several():
    "Start, length and factor, with units"
    windows = (Window(10.0, 5.0, 4.0, "rise"), Window(40.0, 9.0, 12.0, "hump"))
    (start, length, factor) = window_parameters(windows[:1])
    assert (start.name, start.unit, start.estimate) == ("start", "s", 10.0)
    assert (length.unit, factor.unit) == ("s", "ratio")
    assert [p.name.split()[-1] for p in window_parameters(windows)] == ["1"] * 3 + ["2"] * 3
