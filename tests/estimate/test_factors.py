"""Factors are the derivatives of misclosures, and their noise is all of it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.estimate import (
    TARGET,
    estimate_correction,
    position_adjustment,
    position_prior,
    target_factor,
)
from mlscorr.estimate.adjustment import mounting_adjustment, with_reacquisitions
from mlscorr.estimate.factors import PRIOR, REACQUISITION
from mlscorr.estimate.posterior import mounting_prior
from mlscorr.frames import georeference, to_scanner
from mlscorr.pos import PosErrors, Steps
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
    partials = case.adjustment().targets.partials[:, 0]
    times = case.observations.gps_time
    pose = case.recorded.at(times)
    body = pose.attitude.inv().apply(case.observations.position - pose.position)
    for axis in range(3):
        unit = np.eye(3)[axis]
        assert partials[:, :, axis] == pytest.approx(np.tile(unit, (6, 1)))
        turned = (Rotation.from_rotvec(1e-6 * unit) * pose.attitude).apply(body)
        moved = (turned - pose.attitude.apply(body)) / 1e-6
        np.testing.assert_allclose(partials[:, :, 3 + axis], moved, atol=1e-4)


def test_misclosures_are_surveyed_less_observed():
    "With names and times of the matches, in their order, whatever that is"
    case = smooth_case(4, n=9)
    shuffled = np.random.default_rng(1).permutation(9)
    case.observations = case.observations[shuffled]
    adjustment = case.adjustment()
    expected = (case.control.position - case.observations.position[np.argsort(shuffled)])[shuffled]
    np.testing.assert_allclose(adjustment.targets.misclosure, expected, atol=1e-9)
    assert adjustment.names.tolist() == [case.control.name[i] for i in shuffled]
    np.testing.assert_array_equal(adjustment.observed, case.observations.gps_time)


def test_two_passes_share_the_survey_alone():
    "Covariance between passes of a target is the survey's; its own is that and the extraction's"
    case = Case(EPOCHS, CONSTANT, [50.0, 90.0], np.random.default_rng(2))
    observations = case.observations[np.array([0, 1, 0])]
    matched = Matched.by_name(observations, case.control)
    adjustment = position_adjustment(case.recorded, matched, Pos(), 0, position_prior)
    noise = adjustment.targets.noise.matrix
    between = SURVEYED**2 * np.eye(3)
    np.testing.assert_allclose(noise[0:3, 6:9], between, atol=1e-15)
    np.testing.assert_allclose(noise[0:3, 0:3], between + NOISE**2 * np.eye(3), atol=1e-15)
    assert not noise[3:6, :3].any() and not noise[3:6, 6:].any()


def steps_at(*times, size=0.5):
    "Re-acquisitions of GNSS at times (s after the start)"
    at = START + np.array(times)
    n = len(times)
    return Steps(at, at + 0.1, np.tile([size, 0.0, 0.0], (n, 1)), np.full(n, 0.01))


def test_a_step_is_seen_by_the_poses_before_and_after_it():
    "By as much as the path steps its error does: I before, -I after, and the step's variance"
    adjustment = smooth_case(5, n=8).adjustment(order=1)
    steps = steps_at(60.0, 120.0)
    complete = with_reacquisitions(adjustment, steps)
    assert complete.targets is adjustment.targets
    factor = complete.of_kind(REACQUISITION)
    np.testing.assert_array_equal(factor.gps_time, np.column_stack([steps.before, steps.after]))
    np.testing.assert_array_equal(factor.stated.gps_time, factor.gps_time.ravel())
    np.testing.assert_array_equal(factor.misclosure, steps.size)
    for partials in factor.partials:
        np.testing.assert_array_equal(partials, [np.eye(3, 6), -np.eye(3, 6)])
    np.testing.assert_allclose(factor.noise.matrix, 0.01**2 * np.eye(6), atol=1e-18)
    np.testing.assert_allclose(factor.variance, 0.01**2)


def test_a_step_tells_what_the_trend_differs_by():
    "A line that drifts by 1 m in 200 s differs by 0.5 mm over 0.1 s, a shift by nothing"
    adjustment = smooth_case(5, n=8).adjustment(order=1)
    complete = with_reacquisitions(adjustment, steps_at(60.0))
    step = complete.rows(None)[1]
    ends = complete.pose_design(step.gps_time.ravel())[:, :3]
    np.testing.assert_allclose(step.design[0], ends[0] - ends[1], atol=1e-12)
    shift = replace(complete, order=0).rows(None)[1]
    assert not shift.design.any()


def test_no_step_no_row():
    "Without re-acquisitions there is no factor of them; a jump of kilometres is none"
    adjustment = smooth_case(6, n=5).adjustment()
    for none in (steps_at(), steps_at(50.0, size=2000.0)):
        assert with_reacquisitions(adjustment, none).factors == adjustment.factors
        before = with_reacquisitions(adjustment, steps_at(50.0))
        assert with_reacquisitions(before, none).factors == adjustment.factors
    largest = steps_at(50.0, size=0.99 * SEARCH_RADIUS)
    assert len(with_reacquisitions(adjustment, largest).of_kind(REACQUISITION)) == 1


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
        np.testing.assert_allclose(adjustment.targets.columns[:, :, k], moved, atol=2e-3)


def test_a_mounting_is_weakly_known():
    "What was corrected already is believed to be needed back, with the sigmas of no measurement"
    case, position = mounting_case()
    corrected = np.array([0.1, -0.2, 0.3, 0.01, 0.02, -0.03])
    adjustment = mounting_adjustment(position, case.matched, [MOUNTING], corrected, WEAK)
    assert [factor.kind for factor in adjustment.factors] == [TARGET, PRIOR]
    expected = np.column_stack([np.eye(6), -corrected]) / WEAK[:, None]
    np.testing.assert_allclose(adjustment.believed(None), expected, rtol=1e-12)
    assert len(adjustment.solve(None).misclosure) == 18
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
    at = int(np.searchsorted(case.recorded.gps_time, case.observations.gps_time[2]))
    position = case.recorded.position.copy()
    position[at:] += [0.5, 0.0, 0.0]  # m, between the epochs about the target
    stepped = replace(case.recorded, position=position)
    own = target_factor(PosErrors.stated(stepped), case.matched).noise.own
    added = np.diag([0.25, 0.0, 0.0])  # m^2
    np.testing.assert_allclose(own[2] - covariance[2], added, atol=0.01)
    others = np.arange(6) != 2
    np.testing.assert_array_equal(own[others], covariance[others])
    np.testing.assert_array_equal(case.matched.observations.covariance, covariance)
    np.testing.assert_array_equal(case.adjustment().targets.noise.own, covariance)
