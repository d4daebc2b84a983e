"""Selection of some of many features."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.surfaces import SETTINGS, direction_class
from mlscorr.surfaces._thinning import thin
from mlscorr.survey import Trajectory
from tests.beds import tie_streets as street

MANY = 5_000


def crowd(seed=1):
    "Features at random places, in one second and facing every way, of one pass"
    rng = np.random.default_rng(seed)
    direction = rng.normal(size=(MANY, 3))
    return replace(
        street.features()[np.zeros(MANY, int)],
        gps_time=414_000.0 + rng.uniform(0, 1, MANY),
        centre=street.ORIGIN + rng.uniform(-50, 50, (MANY, 3)),
        direction=direction / np.linalg.norm(direction, axis=1, keepdims=True),
    )


def test_no_second_and_direction_has_more_than_its_share():
    "Each of 26 directions keeps as many of a second, however many were found"
    features = crowd()
    kept = features[thin(features, street.ORIGIN)]
    counts = np.bincount(direction_class(kept.direction), minlength=27)
    assert counts[13] == 0
    assert (np.delete(counts, 13) == SETTINGS.features).all()


def test_a_stand_keeps_as_many_as_one_second_of_each_pause():
    "20 s at a light and 10 s of driving: 2 + 10 seconds' worth of each direction stay"
    time = 414_000.0 + np.arange(0.0, 30.0, 0.1)
    way = 8.0 * np.maximum(time - time[0] - 20.0, 0.0)
    place = street.ORIGIN + np.outer(way, [1.0, 0.0, 0.0])
    trajectory = Trajectory(time, place, Rotation.identity(len(time)))
    rng = np.random.default_rng(3)
    direction = np.tile([0.0, 0.0, 1.0], (MANY, 1))
    features = replace(crowd(), gps_time=time[0] + rng.uniform(0, 29.9, MANY), direction=direction)
    kept = features[thin(features, street.ORIGIN, trajectory)]
    assert len(kept) == 12 * SETTINGS.features
    assert np.sum(kept.gps_time < time[0] + 20.0) == 2 * SETTINGS.features


def test_order_does_not_matter_nor_does_thinning_twice():
    "Features in another order leave the same, and what is left stays"
    features = crowd()
    kept = features[thin(features, street.ORIGIN)]
    order = np.random.default_rng(2).permutation(MANY)
    other = features[order][thin(features[order], street.ORIGIN)]
    assert set(map(tuple, other.centre)) == set(map(tuple, kept.centre))
    assert len(thin(kept, street.ORIGIN)) == len(kept)


def test_two_passes_keep_the_same_blocks():
    "Seen again from 0.5 m aside and at another time, most of what stays is the same"
    features = crowd()
    again = replace(features, centre=features.centre + 0.5, gps_time=features.gps_time + 900)
    first, second = (thin(f, street.ORIGIN) for f in (features, again))
    assert len(np.intersect1d(first, second)) > 0.5 * len(first)


def test_opposite_directions_have_opposite_classes():
    "A wall to the left and one to the right are 26 apart in sum, so that they can vote together"
    direction = crowd().direction
    assert (direction_class(direction) + direction_class(-direction) == 26).all()
