"""Pulses that met nothing are known from those beside them."""

import numpy as np

from mlscorr.gap.closure.surroundings import unreturned
from mlscorr.simulate.scan import RecordedPulses

START = 413_200.0  # s


def test_pulses_that_met_the_sky_are_known_from_those_beside_them():
    "Removed from regular lines they come back at their times and angles; from irregular ones not"
    n = 4000
    step = 1e-5
    rate = 0.004
    time = START + step * np.arange(n)
    angle = np.mod(rate * np.arange(n) + np.pi, 2 * np.pi) - np.pi
    zero = np.zeros(n)
    noise = 2e-4 * np.random.default_rng(1).standard_normal(n)
    pulses = RecordedPulses(time, angle + noise, zero, zero + 5.0, zero, zero)
    span = START - step / 2, START + (n - 0.5) * step
    about = np.abs(angle - 0.5) < 0.25
    sky = about & ((np.abs(angle - 0.5) < 0.05) | (time > START + 0.03))  # and whole lines
    found = unreturned(pulses[about & ~sky], span, 0.1)
    number = np.rint((found.gps_time - START) / step).astype(int)
    np.testing.assert_allclose(found.gps_time, time[number], atol=step / 100)
    np.testing.assert_allclose(found.angle, angle[number], atol=rate / 10)
    assert set(np.flatnonzero(sky)) <= set(number)
    assert not (about & ~sky)[number].any()
    assert np.isnan(found.range).all() and np.abs(found.angle - 0.5).max() < 0.36
    random = np.sort(np.random.default_rng(0).choice(n, n // 3, replace=False))
    assert len(unreturned(pulses[random], span, 0.5)) == 0
