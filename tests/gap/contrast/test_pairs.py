"""Cells of two clouds side by side."""

import numpy as np

from mlscorr.gap.contrast.channels import paired_cells


def test_neither_cloud_is_chosen_by(pair):
    "Exchanged, the clouds give the same cells with the columns exchanged"
    survey, real, simulated = pair
    there = paired_cells(survey, real, simulated)
    back = paired_cells(survey, simulated, real)
    assert np.array_equal(there.points, back.points[:, ::-1])
    assert np.array_equal(there.brightness, back.brightness[:, ::-1], equal_nan=True)
    assert np.allclose(there.range, back.range)
    assert np.allclose(there.incidence, back.incidence, equal_nan=True)


def test_points_are_all_there(pair):
    "As many points as the samples have, at ranges and angles that a street has"
    survey, real, simulated = pair
    pairs = paired_cells(survey, real, simulated)
    share = min(real.share, simulated.share)
    for column, sample in enumerate((real, simulated)):
        cells = sample.cells[sample.cells.chance < share]
        assert pairs.points[:, column].sum() == cells.points.sum()
    known = pairs.incidence[np.isfinite(pairs.incidence)]
    assert len(known) > 0.2 * len(pairs)
    assert known.min() >= 0 and known.max() <= 90
    assert np.percentile(pairs.range, 1) > 1.5
