import numpy as np

from mlscorr.matching import SETTINGS
from mlscorr.matching._pairs import find_pairs, same_appearance
from tests.matching.test_association import PLACES, control_points, observations


def test_pairs_are_those_within_the_search_radius():
    "150 m hold the neighbours 100 m off too, one metre the own point alone"
    seen = observations(PLACES + 0.3)
    control = control_points(PLACES)
    wide, narrow = (find_pairs(seen, control, radius) for radius in (150.0, 1.0))
    assert wide.control[wide.of(2)].tolist() == [1, 2, 3]
    assert narrow.control.tolist() == list(range(10))
    assert np.abs(narrow.misclosure[narrow.of(7)] + 0.3).max() < 1e-6  # m, at UTM coordinates


def test_without_observations_or_control_there_are_no_pairs():
    "Nobody is matched with nobody"
    nothing = observations(np.empty((0, 3)))
    assert len(find_pairs(nothing, control_points(PLACES), 1.0).control) == 0
    empty = find_pairs(observations(PLACES), control_points(PLACES[:0]), 1.0)
    assert empty.first.tolist() == [0] * 11


def test_sizes_agree_within_the_tolerance():
    "A centimetre is what a tape errs by; the kind must be the same"
    control = control_points(PLACES[:3], ("circle", "circle", "square"), np.array([0.6, 0.62, 0.6]))
    seen = observations(PLACES[:1], "circle", 0.6 + 0.9 * SETTINGS.size_tolerance)
    assert same_appearance(seen, np.zeros(3, int), control, np.arange(3)).tolist() == [
        True,
        False,
        False,
    ]
