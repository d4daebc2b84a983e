"""Signals on clocks of their own, and the integrated random walk on a logarithmic one."""

import numpy as np
import pytest

from mlscorr.collocation import Covariance

START = 413200.0  # s
RESTARTS = START + np.array([100.0, 180.0])


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
