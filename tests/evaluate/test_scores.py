"""Residuals are surveyed minus corrected, for any method of correction."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.evaluate import accuracy, misclosures, score
from tests.beds.streets import SHIFT, SIGMA, observed, targets


class Moved:
    "A correction that moves all points by the same"

    def __init__(self, shift):
        self.shift = np.asarray(shift)

    def apply(self, cloud):
        return replace(cloud, xyz=cloud.xyz + self.shift)


class Leaning:
    "A correction that grows with time, by m/s from the first point on"

    def __init__(self, start, rate):
        self.start = start
        self.rate = rate

    def apply(self, cloud):
        return replace(cloud, xyz=cloud.xyz + np.outer(cloud.gps_time - self.start, self.rate))


@pytest.fixture(scope="module")
def matched():
    "16 targets whose cloud lacks SHIFT"
    place, time = targets(np.random.default_rng(1))
    return observed(place, time, place + SHIFT)


def test_the_right_shift_leaves_nothing(matched):
    "Before it all misclosures are that shift, after it less than a nanometre"
    np.testing.assert_allclose(misclosures(matched), np.tile(SHIFT, (16, 1)), atol=1e-9)
    np.testing.assert_allclose(misclosures(matched, Moved(SHIFT)), 0.0, atol=1e-9)
    twice = misclosures(matched, Moved(2 * SHIFT))
    np.testing.assert_allclose(twice, -np.tile(SHIFT, (16, 1)), atol=1e-9)


def test_each_target_is_corrected_at_its_own_time(matched):
    "A correction that grows by 1 cm a second leaves what it lacks at each target's second"
    start = matched.gps_time.min()
    rate = np.array([0.01, 0.0, -0.01])
    left = misclosures(matched, Leaning(start, rate))
    expected = SHIFT - np.outer(matched.gps_time - start, rate)
    np.testing.assert_allclose(left, expected, atol=1e-9)


def test_a_score_is_of_both_sides_of_a_correction(matched):
    "RMSE of the shift before and of what is left after, of as many observations"
    result = score(matched, Moved(0.9 * SHIFT))
    assert result.n == result.before.n == 16 and result.left_out is None
    np.testing.assert_allclose(result.before.rmse[:3], np.abs(SHIFT), rtol=1e-6)
    np.testing.assert_allclose(result.after.rmse[:3], 0.1 * np.abs(SHIFT), rtol=1e-6)


def test_left_out_ones_that_are_not_known_do_not_count(matched):
    "Rows with any NaN are left, and the others have their own statistics"
    left = np.full((16, 3), 0.02)
    left[[3, 8]] = np.nan
    left[5, 1] = np.nan
    result = score(matched, Moved(SHIFT), left)
    assert result.left_out.n == 13
    np.testing.assert_allclose(result.left_out.rmse[:3], 0.02)


def test_a_score_knows_how_far_off_it_may_be_by_chance(matched):
    "The RMS of the sigmas that are given, on each axis; None where none is known"
    sigma = np.array([[0.03, 0.01, 0.0], [0.04, 0.01, 0.0]])
    result = score(matched, Moved(SHIFT), sigma=sigma)
    np.testing.assert_allclose(result.sigma, [np.hypot(0.03, 0.04) / np.sqrt(2), 0.01, 0.0])
    assert score(matched, Moved(SHIFT), sigma=sigma[:0]).sigma is None


def test_check_points_give_the_accuracy(matched):
    "With the survey's sigma in it, by as many points as there are names"
    document = accuracy(
        matched, matched[:0], Moved(SHIFT + np.array([0.03, 0.04, 0.0])), np.zeros((0, 3))
    )
    assert document["based_on"] == "check"
    assert document["rmse_horizontal"] == pytest.approx(np.hypot(0.05, np.sqrt(2) * SIGMA), rel=0.1)


def test_without_check_points_the_left_out_control_does(matched):
    "Control points left out in turn, without those that can't be; the correction isn't asked"
    left = np.full((16, 3), [0.03, 0.04, 0.0])
    left[2] = np.nan
    document = accuracy(matched[:0], matched, Moved(1e3 * SHIFT), left)
    assert document["based_on"] == "leave_one_out"
    assert document["rmse_horizontal"] == pytest.approx(0.05, rel=0.01)


def test_of_nothing_there_is_no_accuracy(matched):
    "No check point and no left-out control point: not determined"
    document = accuracy(matched[:0], matched[:0], Moved(SHIFT), np.zeros((0, 3)))
    assert document["rmse_horizontal"] is None
