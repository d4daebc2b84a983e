"Corrections of recorded mountings, together and each by itself"

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.estimate.calibration import (
    MountingEstimate,
    combined_correction,
    corrected_mountings,
)
from tests.beds.scanner_site import LACKS, RECORDED

COMMON = np.repeat([0.02, np.radians(0.1)], 3)  # m, rad: one sigma of what both lack alike
OWN = np.repeat([0.001, np.radians(0.01)], 3)  # m, rad: of each by itself


@pytest.fixture(scope="module")
def estimate():
    "Two mountings that are known beside each other twenty times as well as by themselves"
    covariance = np.kron(np.ones((2, 2)), np.diag(COMMON**2)) + np.diag(np.tile(OWN, 2) ** 2)
    return MountingEstimate.about(RECORDED, LACKS.ravel(), covariance, 1.0)


def test_what_both_have_in_common_is_no_part_of_the_difference(estimate):
    "The sigma of one beside the other is that of what each lacks by itself, of both together"
    lacks, sigma = estimate.relative_to_first(1)
    assert np.allclose(sigma, np.sqrt(2) * OWN, rtol=1e-6)
    assert np.allclose(lacks[:3], LACKS[1, :3] - LACKS[0, :3])
    moved = corrected_mountings(RECORDED, LACKS.ravel())
    recorded, calibrated = (a.boresight * b.boresight.inv() for b, a in (RECORDED, moved))
    between = Rotation.from_rotvec(LACKS[0, 3:])
    turn = Rotation.from_rotvec(lacks[3:]) * between * recorded * between.inv()
    assert (turn * calibrated.inv()).magnitude() < 1e-12  # rad


def test_each_mounting_has_its_own_part(estimate):
    "Correction, sigmas and the covariance that the calibrated mounting keeps"
    second = estimate.of(1)
    assert np.array_equal(second.correction, LACKS[1])
    assert np.allclose(second.sigma, np.hypot(COMMON, OWN))
    assert second.mounting is estimate.mountings[1] and len(second.mountings) == 1
    assert np.array_equal(second.mounting.covariance, second.covariance)
    assert np.allclose(np.diag(estimate.correlation), 1.0)


def test_one_correction_after_another_is_their_combination():
    "Both ways of 2 and 3 degrees lead to the same mountings, to rounding"
    first, second = (np.repeat([0.1, np.radians(degrees)], 3) for degrees in (2.0, -3.0))
    first = np.tile(first, 2) * np.arange(1, 13) / 12
    second = np.tile(second, 2)
    apart = corrected_mountings(corrected_mountings(RECORDED, first), second)
    both = corrected_mountings(RECORDED, combined_correction(first, second))
    for one_by_one, at_once in zip(apart, both, strict=True):
        assert np.allclose(one_by_one.lever_arm, at_once.lever_arm)
        assert (one_by_one.boresight * at_once.boresight.inv()).magnitude() < 1e-12  # rad
