"""Sample that is kept of a cloud."""

from dataclasses import replace

import numpy as np

from mlscorr.targets import NO_POINTS


def test_a_sample_is_whole_cells(pair):
    "Each cell of which points are kept has all of them, and the two clouds share many"
    _, real, simulated = pair
    assert real.has_intensity
    assert 5000 < len(real.points) <= 20_000
    assert len(np.intersect1d(real.cells.key, simulated.cells.key)) > 0.9 * len(real.cells)


def test_without_points_there_is_no_intensity(pair):
    "Nothing is no intensity"
    assert not replace(pair[1], points=NO_POINTS).has_intensity
