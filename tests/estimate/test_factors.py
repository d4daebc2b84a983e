"""The observation equations are the derivatives of misclosures, and their noise is all of it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.estimate import estimate_correction, position_adjustment, position_prior
from mlscorr.estimate.adjustment import _noise, mounting_adjustment, with_reacquisitions
from mlscorr.estimate.posterior import mounting_prior
from mlscorr.frames import georeference, to_scanner
from mlscorr.pos import Steps
from mlscorr.survey import SEARCH_RADIUS, Matched, Mounting, Pos
from tests.beds.pos_errors import CONSTANT, EPOCHS, NOISE, START, SURVEYED, Case, smooth_case

MOUNTING = Mounting(np.array([0.1, -0.6, 0.4]), Rotation.from_euler("xyz", [90, 0, 35], True))
WEAK = np.array([1.0, 1.0, 1.0, 0.1, 0.1, 0.1])  # m, rad


@pytest.mark.long
def test_passes_of_one_target_share_its_survey_error():
    "Many passes average the extraction, not the survey: sigma never falls below the survey's"
    rng = np.random.default_rng(1)
    passes = 25
    case = Case(EPOCHS, CONSTANT, [100.0], rng)
    sure = replace(case.control, sigma=np.full((1, 3), 0.02))
    observations = case.observations[np.zeros(passes, int)]
    drifts_little = Pos(position_sigma=1e-4, attitude_sigma=np.full(3, 1e-7))
    estimate = estimate_correction(
        case.recorded, Matched.by_name(observations, sure), drifts_little
    )
    sigma = estimate.correction.corrected.position_sigma[1000]
    assert sigma == pytest.approx(np.hypot(0.02, NOISE / np.sqrt(passes)), rel=0.01)  # m


def test_partials_are_what_a_pose_moves():
    "Moved by 1 mm and turned by 1e-6 rad, the targets move as B says, to 1e-9 m"
    case = smooth_case(3, n=6)
    adjustment = case.adjustment()
    times = case.observations.gps_time
    pose = case.recorded.at(times)
    body = pose.attitude.inv().apply(case.observations.position - pose.position)
    for axis in range(3):
        unit = np.eye(3)[axis]
        assert adjustment.partials[:, :, axis] == pytest.approx(np.tile(unit, (6, 1)))
        turned = (Rotation.from_rotvec(1e-6 * unit) * pose.attitude).apply(body)
        moved = (turned - pose.attitude.apply(body)) / 1e-6
        np.testing.assert_allclose(adjustment.partials[:, :, 3 + axis], moved, atol=1e-4)


def test_misclosures_are_surveyed_less_observed():
    "With names and times of the matches, in their order, whatever that is"
    case = smooth_case(4, n=9)
    shuffled = np.random.default_rng(1).permutation(9)
    case.observations = case.observations[shuffled]
    adjustment = case.adjustment()
    expected = (case.control.position - case.observations.position[np.argsort(shuffled)])[shuffled]
    np.testing.assert_allclose(adjustment.misclosure, expected, atol=1e-9)
    assert adjustment.names.tolist() == [case.control.name[i] for i in shuffled]
    np.testing.assert_array_equal(adjustment.gps_time, case.observations.gps_time)


def test_two_passes_share_the_survey_alone():
    "Covariance between passes of a target is the survey's; its own is that and the extraction's"
    case = Case(EPOCHS, CONSTANT, [50.0, 90.0], np.random.default_rng(2))
    observations = case.observations[np.array([0, 1, 0])]
    matched = Matched.by_name(observations, case.control)
    noise = position_adjustment(case.recorded, matched, Pos(), 0, position_prior).noise.matrix
    between = SURVEYED**2 * np.eye(3)
    np.testing.assert_allclose(noise[0:3, 6:9], between, atol=1e-15)
    np.testing.assert_allclose(noise[0:3, 0:3], between + NOISE**2 * np.eye(3), atol=1e-15)
    assert not noise[3:6, :3].any() and not noise[3:6, 6:].any()


def steps_at(*times, size=0.5):
    "Fall-backs of the POS at times (s after the start)"
    at = START + np.array(times)
    n = len(times)
    return Steps(at, at + 0.1, np.tile([size, 0.0, 0.0], (n, 1)), np.full(n, 0.01))


def test_a_fall_back_is_a_place_seen_before_and_after_it():
    "Of two views of a place that nobody surveyed only the difference counts: step and its sigma"
    adjustment = smooth_case(5, n=8).adjustment(order=1)
    steps = steps_at(60.0, 120.0)
    complete = with_reacquisitions(adjustment, steps)
    assert complete.fallbacks == 2 and len(complete.names) == 8 and len(complete.gps_time) == 12
    ends = np.column_stack([steps.before, steps.after]).ravel()
    np.testing.assert_array_equal(complete.gps_time[-4:], ends)
    before, after = complete.misclosure[-4:].reshape(2, 2, 3).swapaxes(0, 1)
    np.testing.assert_array_equal(before - after, steps.size)
    np.testing.assert_array_equal(complete.partials[-1], np.eye(3, 6))
    covariance = complete.noise.matrix
    difference = np.hstack([np.eye(3), -np.eye(3)])
    for first in (-12, -6):
        rows = slice(first, first + 6 or None)
        of_both = difference @ covariance[rows, rows] @ difference.T
        np.testing.assert_allclose(of_both, 0.01**2 * np.eye(3), atol=1e-9)
        assert np.diag(covariance)[rows].min() > SEARCH_RADIUS**2
    assert not covariance[:-12, -12:].any() and not covariance[-12:-6, -6:].any()
    assert not complete.design[-4:].any() and complete.design[:-4].any()


def test_no_step_no_row():
    "Without fall-backs the equations are the same object; a jump of kilometres is none"
    adjustment = smooth_case(6, n=5).adjustment()
    assert with_reacquisitions(adjustment, steps_at()) is adjustment
    assert with_reacquisitions(adjustment, steps_at(50.0, size=2000.0)) is adjustment
    gate = SEARCH_RADIUS
    assert with_reacquisitions(adjustment, steps_at(50.0, size=0.99 * gate)).fallbacks == 1


def mounting_case():
    "A case, and its equations of a mounting that is corrected by nothing so far"
    case = smooth_case(7, n=6)
    position = position_adjustment(case.recorded, case.matched, Pos(), 0, mounting_prior)
    return case, position


def test_a_mounting_moves_targets_as_its_columns_say():
    "Lever arm by 1 mm and boresight by 1e-6 rad about body axes, to 1e-5 of the effect"
    case, position = mounting_case()
    adjustment = mounting_adjustment(position, case.matched, [MOUNTING], np.zeros(6), WEAK)
    times = case.observations.gps_time
    scanned = to_scanner(case.recorded, MOUNTING, case.observations.position, times)
    before = georeference(case.recorded, MOUNTING, scanned, times)
    for k in range(6):
        small = 1e-6 * np.eye(6)[k]
        turn = Rotation.from_rotvec(small[3:]) * MOUNTING.boresight
        other = Mounting(MOUNTING.lever_arm + small[:3], turn)
        moved = (georeference(case.recorded, other, scanned, times) - before) / 1e-6
        np.testing.assert_allclose(adjustment.mounting[:6, :, k], moved, atol=2e-3)


def test_two_epochs_hold_the_mounting_weakly():
    "What was corrected already comes back as a misclosure with the sigmas of no measurement"
    case, position = mounting_case()
    corrected = np.array([0.1, -0.2, 0.3, 0.01, 0.02, -0.03])
    adjustment = mounting_adjustment(position, case.matched, [MOUNTING], corrected, WEAK)
    assert len(adjustment.gps_time) == 8 and adjustment.fallbacks == 0
    np.testing.assert_array_equal(adjustment.misclosure[-2:].ravel(), -corrected)
    np.testing.assert_allclose(np.diag(adjustment.noise.matrix)[-6:], WEAK**2)
    np.testing.assert_array_equal(adjustment.mounting[-2:].reshape(6, 6), np.eye(6))
    assert not adjustment.partials[-2:].any()
    assert not adjustment.pose_design(case.recorded.gps_time[:4]).any()


def test_a_site_without_targets_leaves_the_mounting_as_it_was():
    "Where targets say next to nothing the estimate is minus what was corrected, with weak sigmas"
    case, position = mounting_case()
    vague = np.tile(1e6 * np.eye(3), (6, 1, 1))
    matched = replace(case.matched, observations=replace(case.observations, covariance=vague))
    corrected = np.array([0.1, -0.2, 0.3, 0.01, 0.02, -0.03])
    solved = mounting_adjustment(position, matched, [MOUNTING], corrected, WEAK).solve(None)
    np.testing.assert_allclose(solved.trend, -corrected, atol=1e-3)
    np.testing.assert_allclose(np.sqrt(np.diag(solved.trend_covariance)), WEAK, rtol=1e-2)


def test_what_was_observed_stays_as_it_was():
    "A target seen inside a step has the step in its noise; the observations' own covariance stays"
    case = smooth_case(5, n=6)
    covariance = case.matched.observations.covariance.copy()
    time = case.observations.gps_time[2:3]
    adjustment = case.adjustment()
    steps = Steps(time - 0.1, time + 0.1, np.array([[0.5, 0.0, 0.0]]), np.array([0.01]))
    stepped = _noise(case.matched, steps).own
    assert stepped[2, 0, 0] - covariance[2, 0, 0] == pytest.approx(0.25)  # m^2
    np.testing.assert_array_equal(np.delete(stepped, 2, axis=0), np.delete(covariance, 2, axis=0))
    np.testing.assert_array_equal(case.matched.observations.covariance, covariance)
    np.testing.assert_array_equal(adjustment.noise.own, covariance)
