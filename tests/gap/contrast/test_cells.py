"""A cloud as cells of space and time."""

import numpy as np
import pytest

from mlscorr.gap.contrast.sample import CellCollector, cells_of, sampled
from mlscorr.gap.residuals import cell_corner
from mlscorr.survey import PointCloud
from mlscorr.targets import NO_POINTS

ORIGIN = cell_corner(np.array([532000.0, 3374000.0, 20.0]))


def cloud_of(count, rng):
    "Points on a slope of one cell and moment, at UTM size"
    local = rng.uniform(0.05, 0.95, (count, 3))
    local[:, 2] = 0.2 + 0.5 * local[:, 0]
    return PointCloud(ORIGIN + local, 413200.0 + rng.uniform(0, 0.9, count), np.full(count, 1000.0))


def test_a_cell_in_two_chunks_is_whole():
    "Sums of halves add up to those of the whole; centre, scatter and brightness are the points'"
    cloud = cloud_of(200, np.random.default_rng(0))
    whole = cells_of(cloud, 1.0)
    parts = type(whole).concatenate([cells_of(cloud[:70], 1.0), cells_of(cloud[70:], 1.0)])
    assert len(whole) == len(parts.merged()) == 1
    assert np.allclose(parts.merged().sums, whole.sums)
    assert whole.centre[0] == pytest.approx(cloud.xyz.mean(axis=0), abs=1e-6)
    assert np.allclose(whole.scatter[0] / 200, np.cov(cloud.xyz.T, ddof=0), atol=1e-6)
    assert whole.brightness[0] == pytest.approx(3.0)


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
    assert np.allclose(same.sums, kept.sums)
    assert (kept.chance < small.share).all()


def test_nothing_gives_nothing():
    "No points have no cell, and a share of them is none"
    assert len(cells_of(NO_POINTS, 1.0)) == 0
    assert len(sampled(NO_POINTS, 0.5)) == 0
