"""Effects that a simulator already has are removed from the rows."""

import numpy as np

from mlscorr.effects import effect_class, make_effect
from mlscorr.gap.signatures import Bench, curvature, expected, signature
from tests.beds.short_drive import EXACT, in_simulation


def test_known_effects_can_be_taken_from_the_rows(clean):
    "Effects of a simulator change the rows by the sum of their changes"
    survey, rows, _, _ = clean
    effects = [make_effect(name, **EXACT[name]) for name in ("time_offset", "lever_arm")]
    truth = sum(in_simulation(clean, effect.name) for effect in effects)
    change = expected(rows, survey, effects)
    np.testing.assert_allclose(change.shift, truth, atol=0.03 * np.abs(truth).max())


def recorded_less_true(survey, rows, true):
    "Shift (m,) of rows whose points are recorded with the survey's mounting, not the true one"
    pulses = rows.pulses
    pose = survey.trajectory.at(pulses.gps_time)
    body = true.boresight.apply(pulses.scanner_xyz) + true.lever_arm
    moved = pulses.weight[:, None] * (pulses.xyz - pose.position - pose.attitude.apply(body))
    mean = [moved[pulses.item == item].sum(axis=0) for item in rows.item]
    return np.einsum("mi,mi->m", rows.direction, mean)


def test_a_turn_of_degrees_is_told_beyond_the_first_order(clean):
    "2 deg of boresight are off by 4 mm to the first order, with their curvature by 1 um"
    survey, rows, _, _ = clean
    bench = Bench(rows, survey)
    size = np.array([0.0, 0.0, 2.0])
    turn = signature(bench, effect_class("boresight"), {}, np.random.default_rng(0))
    back = make_effect("boresight", magnitude=tuple(-size))
    true = back.apply(survey.mounting, rows.reference)
    expected_shift = recorded_less_true(survey, rows, true)
    linear = turn.jacobian @ size
    assert np.abs(linear - expected_shift).max() > 0.004  # m
    both = linear + curvature(rows, survey, [(turn, size)])
    np.testing.assert_allclose(both, expected_shift, atol=1e-6)


def test_a_known_turn_of_degrees_leaves_nothing(clean):
    "2 deg of boresight that a simulator has already are taken from the rows to 1 um"
    survey, rows, _, _ = clean
    back = make_effect("boresight", magnitude=(0.0, 0.0, -2.0))
    true = back.apply(survey.mounting, rows.reference)
    change = expected(rows, survey, [make_effect("boresight", magnitude=(0.0, 0.0, 2.0))])
    np.testing.assert_allclose(change.shift, recorded_less_true(survey, rows, true), atol=1e-6)


def test_what_is_random_is_told_to_the_first_order(clean, patches):
    "Lost returns move the return rate, and have nothing beyond: no pulse returns twice"
    bench = Bench(patches, clean[0])
    lost = signature(bench, effect_class("dropout"), {}, np.random.default_rng(0))
    assert lost.jacobian.any()
    assert not curvature(patches, clean[0], [(lost, np.array([0.3]))]).any()
