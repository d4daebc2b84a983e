"""Limits of the baselines are in the order of what they tell apart."""

import numpy as np

from mlscorr.baselines._settings import SETTINGS
from mlscorr.estimate import SETTINGS as ESTIMATE


def test_distances_are_in_their_order():
    "Noise, then the spacing of a surface, then a plane's tolerance, then what is still wrong"
    order = SETTINGS.worsening, SETTINGS.spacing, SETTINGS.plane_tolerance, SETTINGS.inlier
    assert list(order) == sorted(order) and order[0] > 0


def test_a_clear_spread_turns_the_cloud_little():
    "Ten sigmas of extent about a line leave a turn of 0.1 rad over root n: 1.3 deg of 20 targets"
    rng = np.random.default_rng(1)
    along = np.linspace(-1.0, 1.0, 20)
    along *= SETTINGS.clear_spread / along.std()
    slopes = [np.polyfit(along, rng.normal(size=20), 1)[0] for _ in range(2000)]
    assert np.degrees(np.std(slopes)) < np.degrees(0.11 / np.sqrt(20))


def test_the_papers_rule_is_the_same_as_in_the_estimate():
    "Correlation time over control interval, 3 to 5 in section 3.1.4"
    assert 3.0 <= SETTINGS.interval_ratio <= 5.0
    assert SETTINGS.interval_ratio == ESTIMATE.start_ratio
