"""What is planned with is what a drive and its targets can give."""

import numpy as np

from mlscorr.gap.plan._settings import SETTINGS
from mlscorr.gap.residuals import SETTINGS as OBSERVE
from mlscorr.simulate import SETTINGS as SIMULATION


def test_planned_passes_are_as_far_apart_as_compared_ones():
    "Two visits are compared from 10 s on; a planned pause is longer"
    assert SETTINGS.pass_interval > OBSERVE.pause


def test_planned_patches_are_like_those_of_a_street():
    "Enough points for a plane, fewer than are fired again, of facets that fit among patches"
    assert OBSERVE.plane_points < SETTINGS.facet_points <= OBSERVE.patch_pulses
    assert SETTINGS.facets <= OBSERVE.patches


def test_a_target_at_the_farthest_has_points():
    "At 40 m beams of 0.1 deg are 7 cm apart: eight across a disc of 0.6 m"
    apart = SETTINGS.farthest_target * np.radians(0.1)
    assert 0.6 / apart > 8
    assert 0.0 < SETTINGS.centre_sigma < OBSERVE.odd_distance


def test_an_addition_is_what_can_be_done_at_once():
    "Twice the speed and distance; a fall of the squared correlation from 5 % on"
    assert SETTINGS.factor == 2.0 and 0.0 < SETTINGS.smallest_fall < 0.1
    assert 0 < SETTINGS.brightness <= 65_535 and SIMULATION.white > SIMULATION.black
