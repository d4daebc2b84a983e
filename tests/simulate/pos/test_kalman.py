"""Filter and smoother say what the joint normal distribution of all epochs says."""

import numpy as np
import pytest

from mlscorr.simulate.pos._inertial import STATES
from mlscorr.simulate.pos._kalman import Measurement, kalman_filter, smooth

EPOCHS = 6


class Case:
    "States that drift and mix, measured at some epochs, at one of them twice"

    def __init__(self, seed):
        rng = np.random.default_rng(seed)
        self.transition = np.eye(STATES) + 0.1 * rng.normal(size=(EPOCHS - 1, STATES, STATES))
        self.noise = rng.uniform(0.01, 0.1, STATES)
        self.start = rng.uniform(0.5, 2.0, STATES)
        self.measurements = {
            k: tuple(self.measurement(rng) for _ in range(count))
            for k, count in ((0, 1), (2, 2), (5, 1))
        }

    def measurement(self, rng, m=3):
        root = rng.normal(size=(m, m))
        covariance = 0.1 * root @ root.T + 0.05 * np.eye(m)
        return Measurement(rng.normal(size=(m, STATES)), rng.normal(size=m), covariance)

    def joint(self):
        "Covariance (n, d, n, d) of the states at all epochs, before any measurement"
        total = np.zeros((EPOCHS, STATES, EPOCHS, STATES))
        here = np.diag(self.start)
        for k in range(EPOCHS):
            if k:
                f = self.transition[k - 1]
                for j in range(k):
                    total[k, :, j] = f @ total[k - 1, :, j]
                    total[j, :, k] = total[k, :, j].T
                here = f @ here @ f.T + np.diag(self.noise)
            total[k, :, k] = here
        return total.reshape(EPOCHS * STATES, -1)

    def posterior(self, last):
        "Mean (n, d) and covariance (n d, n d) of all states by the measurements up to an epoch"
        joint = self.joint()
        rows = []
        values = []
        blocks = []
        for k, several in self.measurements.items():
            for each in several if k <= last else ():
                row = np.zeros((len(each.measured), EPOCHS, STATES))
                row[:, k] = each.design
                rows.append(row.reshape(len(row), -1))
                values.append(each.measured)
                blocks.append(each.covariance)
        h = np.vstack(rows)
        n = sum(map(len, values))
        noise = np.zeros((n, n))
        at = 0
        for block in blocks:
            noise[at : at + len(block), at : at + len(block)] = block
            at += len(block)
        gain = np.linalg.solve(h @ joint @ h.T + noise, h @ joint).T
        mean = gain @ np.concatenate(values)
        return mean.reshape(EPOCHS, STATES), joint - gain @ h @ joint

    def filtered(self):
        return kalman_filter(self.transition, self.noise, self.start, self.measurements)


def block(covariance, k):
    "Of one epoch"
    return covariance[k * STATES : (k + 1) * STATES, k * STATES : (k + 1) * STATES]


@pytest.mark.parametrize("seed", range(3))
def test_the_filter_knows_all_measurements_so_far(seed):
    "State and covariance at each epoch are those of the normal distribution given the past"
    case = Case(seed)
    filtered, predicted = case.filtered()
    for k in range(EPOCHS):
        mean, covariance = case.posterior(k)
        np.testing.assert_allclose(filtered.state[k], mean[k], atol=1e-9)
        np.testing.assert_allclose(filtered.covariance[k], block(covariance, k), atol=1e-9)
        if k:
            mean, covariance = case.posterior(k - 1)
            np.testing.assert_allclose(predicted.state[k], mean[k], atol=1e-9)
            np.testing.assert_allclose(predicted.covariance[k], block(covariance, k), atol=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_the_smoother_knows_all_measurements(seed):
    "Later ones too: mean and covariance at every epoch are those given all"
    case = Case(seed)
    smoothed = smooth(case.transition, *case.filtered())
    mean, covariance = case.posterior(EPOCHS)
    np.testing.assert_allclose(smoothed.state, mean, atol=1e-8)
    for k in range(EPOCHS):
        np.testing.assert_allclose(smoothed.covariance[k], block(covariance, k), atol=1e-8)


def test_without_measurements_variances_grow():
    "Nothing is known of the state, and each step adds what it adds"
    still = np.tile(np.eye(STATES), (4, 1, 1))
    filtered, predicted = kalman_filter(still, np.full(STATES, 0.5), np.ones(STATES), {})
    assert not filtered.state.any()
    variance = np.einsum("kii->ki", filtered.covariance)
    np.testing.assert_allclose(variance, np.outer(1.0 + 0.5 * np.arange(5), np.ones(STATES)))
    np.testing.assert_array_equal(filtered.covariance, predicted.covariance)


def test_a_smoothed_state_is_never_less_sure():
    "No variance of the smoother exceeds the filter's, and at the last epoch they are the same"
    case = Case(7)
    filtered, predicted = case.filtered()
    smoothed = smooth(case.transition, filtered, predicted)
    before, after = (np.einsum("kii->ki", e.covariance) for e in (filtered, smoothed))
    assert (after <= before + 1e-10).all() and (after[0] < before[0]).any()
    np.testing.assert_array_equal(smoothed.state[-1], filtered.state[-1])
