"""Factors are the derivatives of misclosures, and their noise is all of it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.collocation import Noise, collocate_rows_dense
from mlscorr.estimate import (
    TARGET,
    Factor,
    Objective,
    estimate_correction,
    position_adjustment,
    position_prior,
    target_factor,
)
from mlscorr.estimate._prediction import pose_rows, predict_under
from mlscorr.estimate.adjustment import mounting_adjustment, with_reacquisitions
from mlscorr.estimate.factors import PRIOR, REACQUISITION
from mlscorr.estimate.posterior import choose_parameters, mounting_prior
from mlscorr.frames import georeference, pose_partials, to_scanner
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
    "Without measurements, an earlier correction is assumed to be reversed, with weak sigmas"
    case, position = mounting_case()
    corrected = np.array([0.1, -0.2, 0.3, 0.01, 0.02, -0.03])
    adjustment = mounting_adjustment(position, case.matched, [MOUNTING], corrected, WEAK)
    assert [factor.kind for factor in adjustment.factors] == [TARGET, PRIOR]
    expected = np.column_stack([np.eye(6), -corrected]) / WEAK[:, None]
    np.testing.assert_allclose(adjustment.prior_rows(None), expected, rtol=1e-12)
    assert len(adjustment.solve(None).misclosure) == 18
    assert not adjustment.pose_design(case.recorded.gps_time[:4]).any()


def test_a_site_without_targets_leaves_the_mounting_as_it_was():
    "With few targets the estimate is minus the earlier correction, with weak sigmas"
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


def spot_heights(case, times, sigma=0.01):
    """Another kind of control: spots of known height on a sloping road below the vehicle.

    A row each along the normal n of the road: n^T (surveyed - observed), partials n^T [I, -[G]x].
    """
    rng = np.random.default_rng(17)
    gps_time = START + times
    n = len(times)
    pose = case.recorded.at(gps_time)
    true = case.true.at(gps_time)
    arm = pose.attitude.apply([3.0, 1.0, -2.0])  # m, G
    error = true.position - pose.position
    error += true.attitude.apply([3.0, 1.0, -2.0]) - arm
    normal = np.array([0.02, -0.03, 1.0]) / np.linalg.norm([0.02, -0.03, 1.0])
    errors = PosErrors.stated(case.recorded)
    partials = pose_partials(case.recorded, pose.position + arm, gps_time)
    return Factor(
        kind="height",
        name=np.array([f"H{i}" for i in range(n)]),
        gps_time=gps_time[:, None],
        misclosure=(error @ normal + sigma * rng.standard_normal(n))[:, None],
        noise=Noise(np.full((n, 1, 1), sigma**2)),
        partials=(normal @ partials)[:, None, None],
        stated=errors.at(gps_time),
    )


@pytest.fixture(scope="module")
def with_heights():
    "Six targets and a re-acquisition, the same with 40 spot heights, and parameters"
    case = smooth_case(8, n=6)
    alone = with_reacquisitions(case.adjustment(order=1), steps_at(120.0, size=0.001))
    heights = spot_heights(case, np.linspace(2.5, 197.5, 40))
    objective = Objective.of(alone)
    parameters = objective.parameters("matern32", objective.initial)
    return case, alone, alone.with_factor(heights), parameters


def test_another_kind_of_control_is_solved_with_the_others(with_heights):
    """Rows of its own kind behind the others, and the dense solution to 1e-5 m in trend and signal;
    to a tenth of a sigma with knots as far apart as they are by default.
    """
    _, alone, coarse, parameters = with_heights
    both = replace(coarse, tolerance=0.0)
    size = alone.solve(parameters).misclosure.size
    assert both.rows_of("height").tolist() == list(range(size, size + 40))
    assert np.array_equal(both.rows_of(TARGET), alone.rows_of(TARGET))
    solved = both.solve(parameters)
    expected = collocate_rows_dense(both.rows(parameters), both.prior_rows(parameters))
    asked = pose_rows(both, parameters, np.arange(5, len(both.trajectory), 50))
    pose, spread = solved.predict(*asked)
    dense, dense_spread = expected.predict(*asked)
    assert np.abs(pose - dense)[:, :3].max() < 1e-5  # m
    np.testing.assert_allclose(_sigma(spread), _sigma(dense_spread), rtol=0.01)
    by_default = coarse.solve(parameters).predict_mean(*asked)
    assert np.abs((by_default - dense)[:, :3] / _sigma(dense_spread)).max() < 0.1
    residual, covariance = solved.leave_out(both.rows_of("height")[[7]])
    dense_residual, dense_covariance = expected.leave_out(both.rows_of("height")[[7]])
    assert residual == pytest.approx(dense_residual, abs=1e-5)  # m
    assert covariance == pytest.approx(dense_covariance, rel=0.01)


def test_spot_heights_lower_the_sigma_of_the_height_between_targets(with_heights):
    "At the median epoch to less than half, honestly; easting and northing gain next to nothing"
    case, alone, both, parameters = with_heights
    rows = np.arange(0, len(alone.trajectory), 10)
    (_, before), (pose, after) = (predict_under(each, parameters, rows) for each in (alone, both))
    ratio = np.median(_sigma(after) / _sigma(before), axis=0)
    assert ratio[2] < 0.5 and (ratio[:2] > 0.9).all()
    left = (case.true.position - case.recorded.position)[rows, 2] - pose[:, 2]
    assert np.mean(np.abs(left) < 2 * _sigma(after)[:, 2]) > 0.88


def test_a_likelihood_changes_smoothly_with_any_kind_of_control(with_heights):
    "Differences over 1e-3 of a logarithm, with knots used again, are those of the dense formula"
    _, _, both, parameters = with_heights
    near = [replace(parameters, drift_scale=(1.0 + h) * parameters.drift_scale) for h in (1e-3, 0)]
    fast = both.likelihoods(near, parameters, both.weigh(parameters))
    dense = [
        collocate_rows_dense(both.rows(each), both.prior_rows(each)).log_likelihood for each in near
    ]
    assert fast[0] - fast[1] == pytest.approx(dense[0] - dense[1], rel=0.01)


def test_any_kind_of_control_counts_once_where_parameters_are_chosen():
    "One target and 40 heights choose them; 150 targets with heights are not cut into two blocks"
    case = smooth_case(8, n=150)
    many = case.adjustment()
    heights = spot_heights(case, np.linspace(2.5, 197.5, 40))
    assert len(Objective.of(many).blocks) == 2
    assert len(Objective.of(many.with_factor(heights)).blocks) == 1
    one = many.select([75])
    stated = Objective.of(one)
    for adjustment, is_chosen in ((one, False), (one.with_factor(heights), True)):
        (best, _), *_ = choose_parameters(adjustment, points=2).modes
        start = stated.parameters(best.family, stated.initial)
        assert (best != start) == is_chosen


def _sigma(covariance):
    "One sigma (k, 3) of the position"
    return np.sqrt(np.einsum("qii->qi", covariance)[:, :3])
