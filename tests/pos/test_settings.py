"""Beliefs about the POS are in the order of what they tell apart."""

import numpy as np

from mlscorr.pos import SETTINGS
from mlscorr.survey import SEARCH_RADIUS


def test_gnss_is_an_array_of_three_axes():
    "Centimetres, height worse than plan"
    assert SETTINGS.gnss.shape == (3,) and SETTINGS.gnss.dtype == float
    np.testing.assert_array_equal(SETTINGS.gnss, SETTINGS.gnss_sigma)
    assert SETTINGS.gnss[2] > SETTINGS.gnss[0] == SETTINGS.gnss[1]


def test_a_step_is_larger_than_two_fixes_differ():
    "0.1 m: beyond three sigmas of the difference of two fixed solutions, below a fall-back's gate"
    between = np.sqrt(2.0) * np.linalg.norm(SETTINGS.gnss[:2])
    assert 2 * between < SETTINGS.smallest_step < SEARCH_RADIUS


def test_times_are_in_their_order():
    "A fall-back lasts less than a second, ambiguities seconds, an outage a minute"
    assert SETTINGS.step_duration < 1.0 < SETTINGS.reacquisition_time < SETTINGS.outage


def test_shares_are_shares():
    "What a steady sigma and a fall are told by"
    assert 0 < SETTINGS.whole_step < 1 < SETTINGS.steady_ratio
    assert 0 < SETTINGS.held_percentile < 50
