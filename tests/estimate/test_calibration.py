"Statements of a calibrated mounting"

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.estimate import estimate_mounting
from mlscorr.estimate.calibration import MountingEstimate, clock_warnings
from mlscorr.frames import georeferenced_anew
from mlscorr.survey import Trajectory
from tests.beds.tied_site import RECORDED, tied_site


@pytest.fixture(scope="module")
def calibration():
    site = tied_site(1, number=1)
    return estimate_mounting(site.trajectory, [RECORDED], site.matched)


def test_correlations_and_sigmas_make_the_covariance(calibration):
    "Six sigmas and the correlation matrix, with ones on its diagonal, give the covariance back"
    estimate = calibration.lsc
    assert np.allclose(np.diag(estimate.correlation), 1.0)
    both = estimate.correlation * np.outer(estimate.sigma, estimate.sigma)
    assert np.allclose(both, estimate.covariance)


def test_what_is_not_determined_is_named_with_its_sigma(calibration):
    "A level way driven in both directions hides the lever arm up, and the warning names it alone"
    assert calibration.determined.tolist() == [True, True, False, True, True, True]
    sigma = f"lever arm up (sigma {calibration.lsc.sigma[2]:.3f} m)"
    assert f"does not determine {sigma}." in calibration.warnings[0]


def test_a_lever_arm_that_lacks_something_forward_may_be_a_clock(calibration):
    "10 cm at 5 m/s are 20 ms; up and right no clock explains, nor is what is within 3 sigmas said"
    for axis, sigma, number in ((1, 0.01, 1), (1, 0.05, 0), (2, 0.01, 0)):
        lacks = -0.1 * np.eye(6)[axis]
        covariance = sigma**2 * np.eye(6)
        estimate = MountingEstimate.about([RECORDED], lacks, covariance, 1.0)
        warnings = replace(calibration, lsc=estimate).warnings
        sentence = (
            "correction of -100 mm forward. A clock offset of 20 ms has the same effect at this "
            "survey's speed (5.0 ± 0.0 "
        )
        assert sum(sentence in warning for warning in warnings) == number


def test_speeds_that_tell_a_clock_from_a_lever_arm_are_said():
    "A way half at 5 and half at 15 m/s is driven at 10 ± 5 m/s, and a diagnosis tells by that"
    lacks = -0.1 * np.eye(6)[1]
    covariance = 0.01**2 * np.eye(6)
    estimate = MountingEstimate.about([RECORDED], lacks, covariance, 1.0)
    speed = np.repeat([5.0, 15.0], [300, 100])  # m/s, over 1500 m each
    place = np.outer(np.append(0.0, np.cumsum(speed)), [1.0, 0.0, 0.0])
    driven = Trajectory(413_200.0 + np.arange(401.0), place, Rotation.identity(401))
    (warning,) = clock_warnings(estimate, driven)
    assert warning.key == "clock"
    assert warning.values == pytest.approx({"lack": -0.1, "speed": 10.0, "spread": 5.0})


def test_a_correction_by_least_squares_is_another_than_by_collocation(calibration):
    "Each method's correction leads from the recorded mounting to its own, on the same trajectory"
    for method in ("lsc", "ls"):
        correction = calibration.correction(method)
        assert correction.recorded is correction.corrected is calibration.trajectory
        assert correction.corrected_mounting is getattr(calibration, method).mounting


def test_what_the_drift_explains_of_ties_is_not_credited_to_the_mounting(calibration):
    "Two views are as far apart as the mounting alone puts them; with the drift stands beside"
    ties = tied_site(1, number=30).ties
    left = calibration.with_residuals(ties, np.ones(len(ties), bool))
    sightings = ties.place, ties.gps_time, ties.scanner
    mountings = [RECORDED], calibration.lsc.mountings
    place = georeferenced_anew(calibration.trajectory, *mountings, *sightings)
    apart = np.einsum("ni,ni->n", ties.direction, place[:, 1] - place[:, 0])
    assert np.allclose(left.ties.after, apart, atol=1e-5)  # m
    assert np.abs(left.ties_with_drift.after - apart).max() > 1e-3  # m
    assert left.of(0, np.zeros(len(left.used), int)).ties_with_drift.used.all()
