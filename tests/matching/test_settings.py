"""Priors of the matching are shares, and its limits are in their order."""

import numpy as np

from mlscorr.matching import SETTINGS


def test_shares_leave_most_targets_sound():
    "Visible, neither moved nor exchanged: three of four and more"
    sound = SETTINGS.visible_share * (1 - SETTINGS.moved_share - SETTINGS.exchanged_share)
    assert 0.7 < sound < SETTINGS.visible_share < 1


def test_scales_of_sigma_are_symmetric_about_what_is_stated():
    "A tenth to ten times, as far down as up to a tenth, the stated one in the middle"
    logarithms = np.log(SETTINGS.sigma_scales)
    np.testing.assert_allclose(logarithms, -logarithms[::-1], atol=0.11)
    assert SETTINGS.sigma_scales[len(SETTINGS.sigma_scales) // 2] == 1.0


def test_probabilities_are_in_their_order():
    "A rival is named long before a match is refused, and what is dropped is no rival"
    dropped = np.exp(SETTINGS.least_log_weight)
    assert dropped < 1e-6 < SETTINGS.smallest_rival
    assert SETTINGS.smallest_rival < 1 - SETTINGS.smallest_probability
    assert SETTINGS.smallest_sound < SETTINGS.smallest_probability < 1


def test_a_street_holds_a_few_look_alikes():
    "Within 30 m by 30 m one or two for each target, not hundreds"
    assert 0.5 < SETTINGS.lookalike_density * SETTINGS.street_length**2 < 5
