"""Numbers of the effects are those of the geometry and distribution behind them."""

import numpy as np
import pytest
from scipy.stats import norm

from mlscorr.effects._settings import SETTINGS


def test_a_grazing_footprint_is_ten_times_as_long_as_wide():
    "At 84 deg of incidence"
    assert 1.0 / SETTINGS.grazing_cosine == pytest.approx(10.0)
    assert np.degrees(np.arccos(SETTINGS.grazing_cosine)) == pytest.approx(84.3, abs=0.1)


def test_what_is_certain_holds_95_percent():
    "Two sigmas of a normal distribution, both sides"
    inside = 1 - 2 * norm.sf(SETTINGS.certain_sigmas)
    assert inside == pytest.approx(0.95, abs=0.005)
