"""A reference surface is compared where it is, and refused where it is not."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.gap.residuals import build_rows
from mlscorr.gap.residuals._surfaces import on_reference
from tests.beds.displaced import correction_of, displaced
from tests.beds.gap_surveys import write_reference


@pytest.mark.parametrize(
    "shift, what",
    [((0.0, 0.0, 100.0), "height datum"), ((900.0, -400.0, 0.0), "another CRS or place")],
)
def test_a_reference_in_other_coordinates_is_refused(
    simulated, survey, targets, patches, tmp_path, shift, what
):
    "A datum gap of 100 m, or another place, is bad input and named as such"
    write_reference(simulated, tmp_path / "reference.obj", shift)
    elsewhere = replace(survey, reference=tmp_path / "reference.obj")
    with pytest.raises(ValueError, match=what):
        build_rows(elsewhere, *targets, patches)


def test_a_pass_metres_off_meets_its_surfaces_by_a_correction(survey, patches):
    "2 m off, patches meet what they met before, each off along its normal, to 1 mm"
    before = on_reference(survey, patches)
    shift = np.array([1.4, -1.4, 0.3])
    off, correction = displaced(survey, patches, shift)
    after = on_reference(survey, off, correction)
    same, at, of = np.intersect1d(before.patch, after.patch, return_indices=True)
    assert len(same) > 0.99 * len(before)
    moved = (patches.pass_number[same] == 1) * (before.direction[at] @ shift)
    apart = np.abs(after.residual[of] - before.residual[at] - moved)
    assert np.mean(apart < 1e-3) > 0.99  # others stand at the edge of a facet


def test_wrong_control_does_not_move_patches_off_the_reference(survey, patches):
    "A correction by control 2 m too high leaves the comparison as it is without one"
    before = on_reference(survey, patches)
    after = on_reference(survey, patches, correction_of(survey, (0.0, 0.0, 2.0)))
    np.testing.assert_array_equal(after.residual, before.residual)
