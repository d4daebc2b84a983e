"""The start of a search that knows nothing."""

import numpy as np
import pytest

from mlscorr.ties import coarse_correction, pair_features, residuals
from tests.beds import tie_streets as street


@pytest.mark.parametrize(
    ("shift", "angles"),
    [
        ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        ((1.3, -1.1, 0.9), (0.0, 0.0, 0.0)),
        ((-0.4, 1.8, -0.6), (0.0, 0.0, 0.0)),
        ((0.6, -0.8, 0.5), (2.0, 2.0, -1.0)),
    ],
)
def test_metres_and_degrees_come_within_decimetres(shift, angles):
    "Passes up to 2 m and 6 deg apart: nine of ten ties that follow are true ones"
    wrong, truth = street.misplaced(street.features(), shift, angles)
    start = coarse_correction(wrong, 2.5)
    ties = pair_features(wrong, start, np.full(len(wrong), 0.1), 0.5)
    assert len(ties) > 250
    assert np.mean(np.abs(residuals(ties, truth)) < 0.03) > 0.9
    assert np.median(np.abs(residuals(ties, start))) < 0.06


def test_the_first_pass_stays():
    "Only what came later is moved, and a single pass not at all"
    wrong, _ = street.misplaced(street.features(), (0.5, 0.5, 0.5))
    start = coarse_correction(wrong, 2.0)
    assert np.array_equal(
        start[wrong.pass_number == 1], np.zeros_like(start[wrong.pass_number == 1])
    )
    assert not coarse_correction(street.features(1, 1), 2.0).any()


def test_passes_that_never_meet_stay():
    "A second pass a kilometre away has nothing to be put on"
    wrong, _ = street.misplaced(street.features(), (1000.0, 0.0, 0.0))
    assert not coarse_correction(wrong, 2.0).any()
