"""Numbers of what is compared hold to what they are derived from."""

import numpy as np
import pytest
from scipy.stats import chi2, norm

from mlscorr.gap.residuals import SETTINGS
from mlscorr.gap.residuals.settings import Settings


def test_a_pool_holds_six_for_each_that_is_chosen():
    "6000 patches in memory for 1000 rows, and always in that ratio"
    assert SETTINGS.pool == 6 * SETTINGS.patches
    assert Settings(patches=50).pool == 300


def test_the_last_trim_leaves_the_noise():
    "Beyond 3.5 sigmas lie 0.05 % of normal errors; each trim is wider than the one before"
    assert 2 * norm.sf(SETTINGS.trims[-1]) == pytest.approx(5e-4, rel=0.1)
    assert list(SETTINGS.trims) == sorted(SETTINGS.trims)


def test_a_variance_of_the_smallest_patch_is_known_to_a_third():
    "24 points leave 21 degrees of freedom: a relative sigma of root 2 / 21"
    freedom = SETTINGS.plane_points - 3
    assert chi2(freedom).std() / freedom == pytest.approx(1 / 3, abs=0.03)


def test_samples_stand_for_their_patch():
    "A mean of 12 has a third of their scatter, one of 400 a twentieth"
    assert 1 / np.sqrt(SETTINGS.samples) < 1 / 3
    assert 1 / np.sqrt(SETTINGS.patch_pulses) == pytest.approx(1 / 20)


def test_pauses_tell_losses_from_lines():
    "A loss of 30 % makes 1 % of pauses longer than 4.5 pulses, none as long as a scan line's"
    missed = int(SETTINGS.longest_miss)
    assert 0.3**missed == pytest.approx(0.01, rel=0.3)
    assert 0.3 ** int(SETTINGS.line_pause) < 1e-10


def test_a_gate_lets_normal_errors_through():
    "Of 3D errors of 1 sigma per axis 1 in 1000 lies beyond 4 sigmas"
    assert chi2.sf(SETTINGS.surface_gate_sigmas**2, 3) == pytest.approx(1e-3, rel=0.2)


def test_two_visits_are_of_different_errors():
    "Pairs stand farther apart in time than the window over which the POS error is one shift"
    assert SETTINGS.pause > SETTINGS.outlier_interval > SETTINGS.moment
    assert SETTINGS.pair_distance < SETTINGS.cell
