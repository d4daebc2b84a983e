"""Noise of the clock, the ranges and the angles: as large as stated, and white."""

import numpy as np
import pytest

from tests.effects.bed import (
    RETURNS,
    applied,
)


@pytest.mark.parametrize(
    ("name", "change", "sigma"),
    [
        ("time_jitter", lambda r: r.gps_time - RETURNS.gps_time, 1e-4),
        ("range_noise", lambda r: r.range - RETURNS.range, 0.005),
        ("angle_noise", lambda r: r.angle - RETURNS.angle, np.radians(0.002)),
    ],
)
def test_noise_has_the_stated_sigma_and_no_mean(name, change, sigma):
    "8000 independent pulses: sigma to 4 %, mean below 5 sigma of itself, neighbours unrelated"
    noise = change(applied(name))
    assert noise.std() == pytest.approx(sigma, rel=0.04)
    assert abs(noise.mean()) < 5 * sigma / np.sqrt(len(noise))
    assert abs(np.corrcoef(noise[1:], noise[:-1])[0, 1]) < 0.05
