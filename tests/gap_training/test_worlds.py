"""Worlds with errors of all sorts."""

import numpy as np
import pytest
from gap_training.worlds import World

from mlscorr.effects import make_effect
from mlscorr.gap.signatures import Bench


@pytest.fixture(scope="module")
def world():
    "A world under a bad sky"
    return World.random(2)


@pytest.mark.long
def test_errors_are_as_large_as_the_sensors_state(world):
    "Over ten surveys the residuals of targets lie within a factor of three of what is stated"
    ratios = []
    for seed in range(10):
        rows, background, _ = world.errors(np.random.default_rng(seed))
        target = rows.channel == "target"
        variance = rows.noise + rows.survey
        legs = background.position**2 + background.attitude**2
        np.add.at(variance, background.row, legs.sum(axis=1))
        ratios.append(np.sqrt(np.mean(rows.residual[target] ** 2) / np.mean(variance[target])))
    assert 1 / 3 < np.median(ratios) < 3


@pytest.mark.long
def test_a_bad_sky_raises_the_stated_sigma(world):
    "Some looks lie in a stretch where sigma is raised, most don't"
    _, background, survey = world.errors(np.random.default_rng(1))
    assert not world.is_open
    assert 0 < np.mean(background.increased >= 0) < 0.6
    sigma = np.linalg.norm(survey.trajectory.position_sigma, axis=1)
    assert sigma.max() > 2 * np.percentile(sigma, 5)


@pytest.mark.long
def test_the_same_seed_gives_the_same_world(world):
    "Residuals to the last bit"
    again = World.random(2)
    one, two = (each.errors(np.random.default_rng(5))[0].residual for each in (world, again))
    assert np.array_equal(one, two)


@pytest.mark.long
def test_points_lie_where_the_recorded_pose_puts_them(world):
    "A lever arm that is a micrometre off moves them by that, whatever the POS errs by"
    rows, _, survey = world.errors(np.random.default_rng(3))
    effect = make_effect("lever_arm", magnitude=[1e-6, 0.0, 0.0])
    assert np.abs(Bench(rows, survey).change(effect).shift).max() < 2e-6
