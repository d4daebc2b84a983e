"""Between two nodes their states say all that is known of a process."""

import numpy as np
import pytest

from mlscorr.collocation import Covariance, Signal
from mlscorr.collocation._conditional import (
    Epochs,
    _invert,
    fill_gains,
    fill_spans,
    neighbours,
    predict_between,
)
from mlscorr.collocation._states import Layout, fill_noise
from tests.collocation.joint_states import ALL_FAMILIES, carried, stationary


def layout_of(family):
    "The layout of one process, and its covariance function"
    covariance = Covariance(family, 10.0)
    return Layout.of([Signal(np.ones((1, 1, 1)), covariance)]), covariance


@pytest.mark.parametrize("at", [0.0, 0.3, 4.0, 7.0])
@pytest.mark.parametrize("family", ALL_FAMILIES)
def test_gains_are_those_of_the_joint_covariance(family, at):
    "Least squares prediction from the states at both nodes, and the variance that it leaves"
    layout, covariance = layout_of(family)
    d = covariance.states
    rate = covariance.rate
    prior = stationary(family)
    about = neighbours(1, d, 0)
    about.before[0] = 0.0
    about.after[0] = 7.0
    fill_spans(layout, about)
    fill_gains(layout, about, np.array([at]))
    whole = carried(family, 7.0 * rate) @ prior
    joint = np.block([[prior, whole.T], [whole, prior]])
    across = np.append(
        (carried(family, at * rate) @ prior)[0], (carried(family, (7.0 - at) * rate) @ prior)[:, 0]
    )
    gains = np.linalg.solve(joint, across)
    assert about.gains[0, : 2 * d] == pytest.approx(gains, abs=1e-9)
    assert about.remaining[0] == pytest.approx(1.0 - across @ gains, abs=1e-9)


@pytest.mark.parametrize("family", ALL_FAMILIES)
def test_where_no_node_is_the_prior_remains(family):
    "Gains of zero and a variance of one"
    layout, covariance = layout_of(family)
    about = neighbours(1, covariance.states, 0)
    fill_spans(layout, about)
    fill_gains(layout, about, np.array([5.0]))
    assert np.abs(about.gains).max() < 1e-100
    assert about.remaining == pytest.approx([1.0])


def test_an_epoch_takes_mean_and_covariance_from_the_nodes():
    "At the node before, mean and variance of two quantities are those of its first state"
    layout, _ = layout_of("matern32")
    about = neighbours(1, 2, 0)
    about.before[0] = 0.0
    about.after[0] = 7.0
    fill_spans(layout, about)
    about.columns[:, 0] = (0.4, 0.0, 9.0, 9.0)
    about.joint[0, 0] = 0.09
    mean = np.empty((1, 2))
    covariance = np.empty((1, 2, 2))
    mixing = np.array([[[1.0], [2.0]]])
    epochs = Epochs(
        np.zeros(1),
        np.zeros((1, 1)),
        np.zeros((1, 2, 0)),
        mixing,
        np.zeros(0),
        np.zeros((0, 0)),
        mean,
        covariance,
    )
    predict_between(layout, about, epochs, 0, 1)
    assert mean[0] == pytest.approx([0.4, 0.8])
    assert covariance[0] == pytest.approx(np.array([[0.09, 0.18], [0.18, 0.36]]))


@pytest.mark.parametrize("step", [1e-4, 1e-2, 1.0, 30.0])
@pytest.mark.parametrize("family", ALL_FAMILIES)
def test_covariances_of_short_steps_are_inverted(family, step):
    "Q^-1 Q = 1 to 1e-6 even of a step of 0.1 ms, whose elements fall by 20 orders of magnitude"

    covariance = Covariance(family, 10.0)
    layout = Layout.of([Signal(np.ones((1, 1, 1)), covariance)])
    spread = np.zeros((1, 3, 3))
    inverse = np.zeros((1, 3, 3))
    fill_noise(layout, np.array([step]), spread)
    _invert(spread, layout.states, inverse)
    d = covariance.states
    sigma = np.sqrt(np.diag(spread[0])[:d])
    scale = np.outer(sigma, sigma)
    product = (inverse[0, :d, :d] * scale) @ (spread[0, :d, :d] / scale)
    np.testing.assert_allclose(product, np.eye(d), atol=1e-6)
