"""A cloud as cells of space and time."""

import numpy as np

from mlscorr.gap.contrast.sample import CellCollector, sampled
from mlscorr.io.clouds import read_chunks
from mlscorr.targets import NO_POINTS


def test_memory_is_bounded_and_the_same_cells_are_kept(pair):
    "A tenth of the cells: whole ones, those of the whole cloud bit for bit, in small chunks too"
    survey, real, _ = pair
    small = CellCollector(survey, limit=len(real.cells) // 10, points=500)
    for chunk in read_chunks(survey.clouds[0], 9_001):
        small.add(chunk)
    kept = small.cells()
    assert 0 < len(kept) <= len(real.cells) // 10
    assert len(small.points()) <= 500
    same = real.cells[np.isin(real.cells.key, kept.key)]
    for name in ("key", "points", "centre", "covariance", "value"):
        np.testing.assert_array_equal(getattr(same, name), getattr(kept, name), name)
    assert (kept.chance < small.share).all()


def test_nothing_gives_nothing():
    "A share of no points is none"
    assert len(sampled(NO_POINTS, 0.5)) == 0
