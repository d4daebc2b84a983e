"""Stages stand in the order of a measurement, and every effect acts at one."""

from dataclasses import fields

import numpy as np
import pytest

from mlscorr.effects import EFFECTS, STAGES, Returns
from mlscorr.effects.stages import BODY, EAST_NORTH_UP, MAP
from mlscorr.survey import ControlPoints, Trajectory

VALUES = {"clock": Returns, "range": Returns, "angle": Returns}
VALUES |= {"pos": Trajectory, "control": ControlPoints}


@pytest.mark.parametrize("stage, field", [pair for pair in STAGES.items() if pair[1] is not None])
def test_a_stage_names_a_field_of_its_value(stage, field):
    "The field to which errors are added exists: time, range, angle, position"
    assert field in {each.name for each in fields(VALUES[stage])}


def test_every_effect_acts_at_a_stage():
    "And no stage is without one"
    assert {kind.stage for kind in EFFECTS} == set(STAGES)


def test_the_order_is_that_of_a_pulse():
    "Beam, clock, range, angle, return; then the pose, the mounting, and what was surveyed"
    order = list(STAGES)
    assert order.index("range") < order.index("return") < order.index("pos")
    assert order[0] == "beam" and order[-1] == "control"


def test_axes_have_a_word_for_each_sign():
    "Three of the body, three of the map, two words for each of these, all different"
    assert len(BODY) == len(MAP) == len(EAST_NORTH_UP) == 3
    words = [word for pair in EAST_NORTH_UP for word in pair]
    assert len(set(words)) == 6 and not set(BODY) & set(MAP)


def test_returns_are_chosen_and_joined_like_columns():
    "Halves joined are the whole, in all six columns"
    rng = np.random.default_rng(1)
    returns = Returns(*rng.normal(size=(5, 20)), rng.random(20) < 0.5)
    again = Returns.concatenate([returns[:8], returns[8:]])
    for each in fields(Returns):
        np.testing.assert_array_equal(getattr(again, each.name), getattr(returns, each.name))
