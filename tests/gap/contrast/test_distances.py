"""Distances between distributions."""

import numpy as np
import pytest
from scipy.stats import energy_distance as scipy_distance

from mlscorr.gap.contrast import cloud_distances, innovation_distances
from mlscorr.gap.contrast.distances import (
    chamfer_distance,
    energy_distance,
    maximum_mean_discrepancy,
)
from tests.beds.twin_clouds import sampled

EAST = np.array([1.0, 0.0, 0.0])


def test_the_energy_distance_is_that_of_scipy_but_for_its_bias():
    "In one dimension, of 2000 values: the square of scipy's, to its bias of 1 / n"
    rng = np.random.default_rng(0)
    x = rng.standard_normal(2000)
    y = 1.0 + rng.standard_normal(2000)
    biased = scipy_distance(x, y) ** 2
    assert energy_distance(x[:, None], y[:, None]) == pytest.approx(biased, abs=3e-3)


@pytest.mark.parametrize(
    "distance", [energy_distance, lambda x, y: maximum_mean_discrepancy(x, y, 1.0)]
)
def test_of_one_distribution_they_are_zero_on_average(distance):
    "400 pairs of 12 values each in three dimensions: the mean is zero within its error"
    rng = np.random.default_rng(1)
    values = [distance(*rng.standard_normal((2, 12, 3))) for _ in range(400)]
    assert abs(np.mean(values)) < 3 * np.std(values) / np.sqrt(400)
    assert np.min(values) < 0


def test_the_chamfer_distance_of_a_moved_grid():
    "A grid of 1 m moved by 0.2 m: 0.2 m both ways"
    grid = np.array(np.meshgrid(*[np.arange(8.0)] * 3)).reshape(3, -1).T
    assert chamfer_distance(grid, grid + 0.2 * EAST) == pytest.approx(0.2)


@pytest.mark.long
def test_twins_lie_within_the_floor(pair):
    "No distance of a twin stands out by more than the floor's own scatter"
    _, real, simulated = pair
    for each in cloud_distances(real, simulated, real, np.random.default_rng(0)):
        assert each.before <= each.floor + 1.5 * (each.floor_high - each.floor), each
        assert np.isfinite(each.after)


@pytest.mark.long
def test_a_moved_cloud_stands_out(pair):
    "0.3 m to the east: the Chamfer distance grows beyond its floor, and its unit is m"
    survey, _, simulated = pair

    def move(_, cloud):
        return type(cloud)(cloud.xyz + 0.3 * EAST, cloud.gps_time, cloud.intensity)

    chamfer, *_ = cloud_distances(sampled(survey, move), simulated, None, np.random.default_rng(0))
    assert (chamfer.figure, chamfer.unit) == ("chamfer", "m")
    assert chamfer.before > chamfer.floor_high
    assert np.isnan(chamfer.after)


def test_innovations_stand_out_before_the_cause_and_not_after():
    "Three sigmas off before, none after; a noise that is half as large as stated is no gap"
    rng = np.random.default_rng(2)
    u = 0.5 * rng.standard_normal((400, 1))
    replicas = rng.standard_normal((400, 40))
    channel = np.repeat(["target", "surface"], 200)
    told = innovation_distances(channel, np.hstack([u + 3.0, u]), replicas, rng)
    assert len(told) == 4
    for each in told:
        assert each.before > 10 * each.floor_high
        assert each.after < 1.5 * each.floor_high
