"""Displacements are how far a unit of each error moves what was seen."""

import numpy as np
import pytest

from mlscorr.effects import make_effect
from mlscorr.gap.signatures import Bench, displacements


def test_a_late_clock_moves_targets_as_its_effect_does(clean):
    "Along each row's direction a second's displacement times 1 ms is the effect of 1 ms, to 3 %"
    survey, rows, _, _ = clean
    moved = displacements(rows, survey)
    view = np.searchsorted(moved.item, rows.item)
    along = np.sum(rows.direction * moved.directions["clock"][view], 1)
    truth = Bench(rows, survey).change(make_effect("time_offset", magnitude=1e-3)).shift
    np.testing.assert_allclose(np.abs(1e-3 * along), np.abs(truth), atol=0.03 * np.abs(truth).max())


def test_map_axes_are_unit_vectors_and_beams_point_from_the_scanner(clean):
    "East, north and height are the map's; right, forward and beam have length one"
    survey, rows, _, _ = clean
    moved = displacements(rows, survey).directions
    for axis, name in enumerate(("east", "north", "height")):
        np.testing.assert_array_equal(moved[name], np.eye(3)[[axis] * len(moved[name])])
    for name in ("right", "forward", "beam", "across"):
        assert np.linalg.norm(moved[name], axis=1) == pytest.approx(1.0)
