"What a calibrated mounting says of itself."

import numpy as np
import pytest

from mlscorr.estimate import estimate_mounting
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
    assert f"does not determine {sigma}:" in calibration.warnings[0]


def test_a_correction_by_least_squares_is_another_than_by_collocation(calibration):
    "Each method's correction leads from the recorded mounting to its own, on the same trajectory"
    for method in ("lsc", "ls"):
        correction = calibration.correction(method)
        assert correction.recorded is correction.corrected is calibration.trajectory
        assert correction.corrected_mounting is getattr(calibration, method).mounting
