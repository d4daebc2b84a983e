"""A survey as a simulator believes in it."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.effects import make_effect
from mlscorr.gap.signatures import as_assumed, joined
from mlscorr.simulate import beliefs_of


def test_what_survey_toml_says_changes_nothing(clean):
    "The simulator of a survey's own beliefs has no effects and leaves sigmas as they are"
    survey = clean[0]
    assumed, effects = as_assumed(survey, beliefs_of(survey))
    assert not effects
    assert (assumed.scanner == survey.scanner and assumed.trajectory.position_sigma is None) or (
        assumed.trajectory.position_sigma == pytest.approx(survey.trajectory.position_sigma)
    )


def test_a_pos_believed_twice_as_bad_has_twice_the_sigmas_of_its_file(clean):
    "The simulator's factor on the sigmas of survey.toml goes to those of the trajectory"
    survey = clean[0]
    sigma = np.full((len(survey.trajectory), 3), 0.02)
    survey = replace(survey, trajectory=replace(survey.trajectory, position_sigma=sigma))
    simulator = beliefs_of(survey)
    pos = replace(simulator.pos, position_sigma=2 * simulator.pos.position_sigma)
    assumed, _ = as_assumed(survey, replace(simulator, pos=pos))
    np.testing.assert_allclose(assumed.trajectory.position_sigma, 0.04)


def test_a_mounting_that_the_survey_lacks_is_refused(clean):
    "A simulator with a mounting and a survey without: the sentence says where to give it"
    survey = clean[0]
    with pytest.raises(ValueError, match="Add it there"):
        as_assumed(replace(survey, mounting=None), beliefs_of(survey))


@pytest.mark.parametrize(
    ("name", "more", "total"),
    [
        ("dropout", 0.05, 0.0975),
        ("range_noise", 0.05, 0.05 * np.sqrt(2)),
        ("time_offset", 0.05, 0.1),
    ],
)
def test_the_same_effect_again_is_joined(name, more, total):
    "Losses of what is left, noise by squares, offsets by their sum: one effect, never two"
    effect = make_effect(name, magnitude=more)
    (both,) = joined([effect], effect)
    assert both.magnitude == pytest.approx(total)
