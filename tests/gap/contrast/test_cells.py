"""A cloud as cells of space and time."""

import numpy as np

from mlscorr.gap.contrast.sample import CellCollector, sampled
from mlscorr.surfaces import cell_corner
from mlscorr.survey import PointCloud
from mlscorr.targets import NO_POINTS

ORIGIN = cell_corner(np.array([532000.0, 3374000.0, 20.0]))


def cloud_of(count, rng):
    "Points on a slope of one cell and moment, at UTM size"
    local = rng.uniform(0.05, 0.95, (count, 3))
    local[:, 2] = 0.2 + 0.5 * local[:, 0]
    return PointCloud(ORIGIN + local, 413200.0 + rng.uniform(0, 0.9, count), np.full(count, 1000.0))


def test_memory_is_bounded_and_the_same_cells_are_kept(pair):
    "A tenth of the cells: whole ones, those of the whole collection, with the same sums"
    survey, real, _ = pair
    from mlscorr.io.clouds import read_chunks

    small = CellCollector(survey, limit=len(real.cells) // 10, points=500)
    for chunk in read_chunks(survey.clouds[0]):
        small.add(chunk)
    kept = small.cells()
    assert 0 < len(kept) <= len(real.cells) // 10
    assert len(small.points()) <= 500
    same = real.cells[np.isin(real.cells.key, kept.key)]
    np.testing.assert_array_equal(same.moments, kept.moments)
    assert (kept.chance < small.share).all()


def test_nothing_gives_nothing():
    "A share of no points is none"
    assert len(sampled(NO_POINTS, 0.5)) == 0
