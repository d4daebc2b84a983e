"""Numbers of the comparison of channels hold to what they are derived from."""

import numpy as np
import pytest

from mlscorr.gap.contrast._settings import SETTINGS


def test_a_bootstrap_tells_a_sigma_to_four_percent():
    "Relative sigma of a sigma from n replicas: 1 / root 2 n"
    assert 1 / np.sqrt(2 * SETTINGS.bootstrap_replicas) == pytest.approx(0.04, abs=0.005)


def test_bins_ascend():
    "Edges of bins from zero on, to a right angle"
    for edges in (SETTINGS.ranges, SETTINGS.incidences):
        assert edges[0] == 0 and (np.diff(edges) > 0).all()
    assert SETTINGS.incidences[-1] == 90


def test_a_pair_of_samples_is_small():
    "All pairs of drawn things fit into a cache of 1 MB"
    assert 8 * SETTINGS.drawn**2 <= 1e6
