"Balls about places: what distances say."

import numpy as np

from mlscorr.targets import Neighbourhoods
from tests.targets.test_extract import ORIGIN


def test_balls_hold_what_is_within_their_radius():
    "Each of three balls, at UTM coordinates, holds the points that distances say"
    rng = np.random.default_rng(2)
    places = ORIGIN + rng.uniform(0, 50, (3, 3))
    radius = np.array([2.0, 5.0, 9.0])
    xyz = ORIGIN + rng.uniform(0, 50, (5000, 3))
    apart = np.linalg.norm(xyz[:, None] - places, axis=2) <= radius
    balls = Neighbourhoods(places, radius)
    for rows, inside in zip(balls.each(xyz), apart.T, strict=True):
        assert np.array_equal(rows, np.flatnonzero(inside))
    assert np.array_equal(balls.contains(xyz), np.flatnonzero(apart.any(axis=1)))


def test_without_a_ball_no_point_is_near():
    "No places, or points of which none has a place in space: nothing is near, nothing is refused"
    nowhere = Neighbourhoods(np.empty((0, 3)), np.empty(0))
    assert nowhere.each(ORIGIN[None]) == [] and len(nowhere.contains(ORIGIN[None])) == 0
    balls = Neighbourhoods(ORIGIN[None], np.array([3.0]))
    assert len(balls.contains(np.full((2, 3), np.nan))) == 0
    assert [len(rows) for rows in balls.each(np.empty((0, 3)))] == [0]
