"""Signals on clocks of their own, and the integrated random walk on a logarithmic one."""

import numpy as np
import pytest

from mlscorr.collocation import Covariance, Noise, Signal, collocate
from tests.collocation.dense import collocate_dense

START = 413200.0  # s
RESTARTS = START + np.array([100.0, 180.0])
EYE = np.eye(3)


def grown(gps_time):
    "Clock and sigma (m) of an integrated random walk that starts anew twice"
    number = np.searchsorted(RESTARTS, gps_time, side="right")
    since = np.maximum(gps_time - np.append(START - 1.0, RESTARTS)[number], 0.1)
    return np.log(since) + 1000.0 * number, 0.01 * since**1.5, since, number


def test_the_covariance_is_that_of_an_integrated_random_walk():
    "a^2 (3 b - a) / 6 times the intensity, for times a < b since a start; nothing across one"
    gps_time = START + np.sort(np.random.default_rng(1).uniform(0.0, 300.0, 50))
    clock, sigma, since, number = grown(gps_time)
    covariance = Covariance("integrated", 1.0)(np.abs(clock[:, None] - clock))
    early = np.minimum(since[:, None], since)
    late = np.maximum(since[:, None], since)
    intensity = 3 * 0.01**2  # m^2/s^3: the variance is intensity t^3 / 3
    walk = np.where(number[:, None] == number, early**2 * (3 * late - early) / 6, 0.0)
    assert np.outer(sigma, sigma) * covariance == pytest.approx(intensity * walk, abs=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_the_recursion_equals_the_dense_formula_on_clocks(seed):
    "Prediction and its covariance to 1e-9 m, with one signal on its own clock and one on time"
    rng = np.random.default_rng(seed)
    n = 30
    gps_time = START + rng.uniform(0.0, 300.0, n)
    at = START + np.linspace(-5.0, 310.0, 150)

    def signals(times):
        clock, sigma, *_ = grown(times)
        steady = np.tile(0.1 * EYE, (len(times), 1, 1))
        return [
            Signal(sigma[:, None, None] * EYE, Covariance("integrated", 1.0), clock),
            Signal(steady, Covariance("matern32", 30.0)),
        ]

    observed = signals(gps_time)
    predicted = signals(at)
    given = rng.normal(size=(n, 3)), Noise(np.tile(1e-4 * EYE, (n, 1, 1))), np.tile(EYE, (n, 1, 1))
    wanted = np.tile(EYE, (150, 1, 1)), [s.mixing for s in predicted], [s.clock for s in predicted]
    fast = collocate(gps_time, *given, observed)
    plain = collocate_dense(gps_time, *given, observed)
    assert fast.log_likelihood == pytest.approx(plain.log_likelihood, rel=1e-9)
    for value, expected in zip(fast.predict(at, *wanted), plain.predict(at, *wanted), strict=True):
        assert value == pytest.approx(expected, abs=1e-8, rel=1e-7)
