"""Numbers of the estimate that follow from a distribution are those of it."""

import numpy as np
import pytest
from scipy.stats import norm

from mlscorr.estimate import SETTINGS


def test_what_is_detectable_is_baardas():
    "4.13 sigmas: significance 0.1 % on both sides, power 80 %"
    factor = norm.isf(SETTINGS.significance / 2) + norm.isf(SETTINGS.undetected)
    assert factor == pytest.approx(4.13, abs=0.005)


def test_a_signal_has_faded_after_three_correlation_times():
    "An exponential one is 5 % of what it was"
    assert np.exp(-SETTINGS.faded_times) == pytest.approx(0.05, abs=0.001)


def test_a_majority_is_left_by_the_breakdown():
    "Of five targets one may be wrong, and never as many as are right"
    assert int(SETTINGS.breakdown * SETTINGS.screened_targets) == 1
    assert SETTINGS.breakdown < 0.5 and SETTINGS.smallest_targets < SETTINGS.screened_targets


def test_steps_of_derivatives_suit_their_spread():
    "A gradient's step is small beside a curvature's, which is small beside every prior"
    narrowest = np.log(min(SETTINGS.precise_factor, SETTINGS.time_factor, SETTINGS.scale_factor))
    assert 10 * SETTINGS.gradient_step < SETTINGS.curvature_step < narrowest / 2


def test_gross_sizes_span_misread_targets_to_wrong_setups():
    "0.1 to 2.5 m in equal ratios; scales of the search halve"
    sizes = SETTINGS.gross_sizes
    scales = SETTINGS.scale_factors
    np.testing.assert_allclose(np.diff(np.log(sizes)), np.log(5.0))
    np.testing.assert_allclose(np.diff(np.log2(scales)), -1.0)
