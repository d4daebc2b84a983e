"""Numbers of places and moments."""

import numpy as np

from mlscorr.surfaces import BoundedChoice, block_chance, place_key
from mlscorr.survey import PointCloud


def test_a_key_tells_cells_and_moments_apart():
    "Points of one cubic metre and second share a number; those of the next ones don't"
    place = np.array([[523_000.2, 3_378_000.3, 40.4]] * 4)
    place[1] += 0.2
    place[2, 0] += 1.0
    key = place_key(place, np.array([413_200.1, 413_200.9, 413_200.1, 413_201.1]))
    assert key[0] == key[1] and len(set(key.tolist())) == 3


def test_a_choice_keeps_whole_blocks_whatever_the_order():
    "Of 5000 points 400 at most are kept: all points of some blocks, the same from any order"
    rng = np.random.default_rng(5)
    place = np.array([523_000.0, 3_378_000.0, 40.0]) + rng.uniform(0.0, 200.0, (5_000, 3))
    cloud = PointCloud(place, np.arange(5_000.0), np.ones(5_000))
    kept = []
    for order in (np.arange(5_000), rng.permutation(5_000)):
        choice = BoundedChoice(400)
        for rows in np.array_split(order, 7):
            choice.add(cloud[rows], block_chance(place[rows]))
        kept.append(np.sort(PointCloud.concatenate(choice.parts()).gps_time.astype(int)))
    assert 100 < len(kept[0]) <= 400
    np.testing.assert_array_equal(*kept)
    np.testing.assert_array_equal(kept[0], np.flatnonzero(block_chance(place) < choice.share))
