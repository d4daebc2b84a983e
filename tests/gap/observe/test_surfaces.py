"""A reference surface is compared where it is, and refused where it is not."""

from dataclasses import replace

import pytest

from mlscorr.gap.observe.pairing import build_rows
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
