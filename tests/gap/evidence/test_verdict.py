"""Surveys whose cause is known: what is named."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.effects import make_effect
from tests.gap.inference import named, surveyed


@pytest.mark.long
@pytest.mark.parametrize("kind", ["sines", "walk"])
def test_a_clean_survey_is_called_clean_whatever_its_drift(kind, with_surface, with_planes):
    "Drift of sinusoids, or of a random walk through a smoother, is no effect"
    for seed, (g, signs) in enumerate((with_surface, with_planes)):
        assert named(surveyed(g, 20 + seed, kind=kind), g, signs).label == "none"


@pytest.mark.long
def test_a_withheld_effect_is_unknown_and_the_lead_points_at_it(with_surface):
    "Without range_scale in the library nothing else takes its name"
    g, signs = with_surface
    rows = surveyed(g, 33, make_effect("range_scale", magnitude=1.5e-3))
    assert named(rows, g, signs).label == "range_scale"
    answer = named(rows, g, tuple(s for s in signs if s.name != "range_scale"))
    assert answer.label == "unknown"
    assert "range" in answer.hint


@pytest.mark.long
@pytest.mark.parametrize("name, word", [("roll with turn rate", "turn"), ("cyclic range", "range")])
def test_an_effect_of_no_library_is_unknown(name, word, study, with_surface):
    "Rotations and fine functions are in the bank of the unknown"
    g, signs = with_surface
    shift = study.Outside(g).shift(name, np.random.default_rng(0))
    shift *= 6.0 / study.metric(g)(shift)
    answer = named(surveyed(g, 34, outside=shift), g, signs)
    assert answer.label == "unknown"
    assert word in answer.hint


@pytest.mark.long
def test_without_the_time_offset_another_error_of_the_clock_does_not_take_its_name(with_surface):
    "A time error that is constant is unknown then, not clock_drift"
    g, signs = with_surface
    rows = surveyed(g, 41, make_effect("time_offset", magnitude=0.004))
    answer = named(rows, g, tuple(s for s in signs if s.name != "time_offset"))
    assert answer.label == "unknown"
    assert "time error" in answer.hint


@pytest.mark.long
def test_two_effects_are_named_together(with_surface):
    "A pair is needed when each alone leaves what the other explains"
    g, signs = with_surface
    effects = [
        make_effect("time_offset", magnitude=0.006),
        make_effect("range_bias", magnitude=0.02),
    ]
    assert named(surveyed(g, 36, *effects), g, signs).label == "time_offset+range_bias"


@pytest.mark.long
def test_a_drift_far_beyond_its_sigma_is_a_noisy_pos_not_an_effect(with_surface):
    "Five times the stated sigma is neither absorbed nor explained by an effect"
    g, signs = with_surface
    wider = replace(
        g.survey.pos, position_sigma=0.1, attitude_sigma=5 * g.survey.pos.attitude_sigma
    )
    large = replace(g, survey=replace(g.survey, pos=wider))
    assert named(surveyed(large, 37), g, signs).label == "position_noise"
