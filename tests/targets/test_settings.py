"""Limits of targets do not contradict each other."""

from math import comb, sqrt

from mlscorr.targets import SETTINGS


def test_triples_find_the_plane_of_a_third_of_the_points():
    "100 of them hold one that lies on it with a probability of 0.98, were they of all points"
    assert 1 - (1 - (1 / 3) ** 3) ** SETTINGS.plane_trials > 0.97
    assert comb(SETTINGS.smallest_count, 3) > SETTINGS.plane_trials


def test_guesses_meet():
    "Each guess serves half to twice of it: 0.1 to 1.6 m without a gap"
    for small, large in zip(SETTINGS.size_guesses, SETTINGS.size_guesses[1:], strict=False):
        assert 2 * small >= large / 2
    assert 2 * SETTINGS.size_guesses[-1] >= SETTINGS.largest_size


def test_what_is_accepted_was_plausible():
    "A rough fit may miss the limits that the exact one must keep, and closeness asks for more"
    assert 0 < SETTINGS.rough_play < SETTINGS.smallest_support < SETTINGS.good_support
    assert SETTINGS.smallest_overlap < SETTINGS.close_overlap < 1
    assert SETTINGS.smallest_width < SETTINGS.smallest_length < 1 < SETTINGS.bloom


def test_the_rim_lies_beyond_the_corner():
    "Of a square, whose half diagonal is one: its end, and where the background is looked at"
    end, border = SETTINGS.rim
    assert 1 < end < border and SETTINGS.hidden_share <= 0.5
    assert SETTINGS.outside_middle > 0.5 and SETTINGS.core < 0.4 / sqrt(2)
