"""Numbers of places and moments."""

import numpy as np

from mlscorr.surfaces import place_key


def test_a_key_tells_cells_and_moments_apart():
    "Points of one cubic metre and second share a number; those of the next ones don't"
    place = np.array([[523_000.2, 3_378_000.3, 40.4]] * 4)
    place[1] += 0.2
    place[2, 0] += 1.0
    key = place_key(place, np.array([413_200.1, 413_200.9, 413_200.1, 413_201.1]))
    assert key[0] == key[1] and len(set(key.tolist())) == 3
