"""The POS error at every epoch is the average over what the parameters may be."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.estimate import position_adjustment, position_prior, with_drift_history
from mlscorr.estimate._prediction import (
    GridPredictions,
    bridge_steps,
    predict_pose_error,
    predict_under,
)
from mlscorr.estimate.posterior import Posterior, choose_parameters
from mlscorr.estimate.target_tests import all_tests
from mlscorr.pos import find_steps
from mlscorr.survey import Matched, Pos, Trajectory
from tests.beds.pos_errors import EPOCHS, START, Case, even, filtered_outage, smooth_case, waves

ROWS = np.array([0, 137, 900, 1500, 2000])


@pytest.fixture(scope="module")
def parameters(objective):
    return objective.parameters("matern32", objective.initial)


def sure(*pairs):
    "A posterior of these parameters and weights"
    return Posterior(pairs, pairs)


def variances(covariance):
    return np.einsum("qii->qi", covariance)


def test_some_epochs_are_those_of_all(adjustment, parameters):
    "Predicted at five epochs or at all 2001: the same error and covariance"
    whole, spread = predict_under(adjustment, parameters)
    mean, covariance = predict_under(adjustment, parameters, ROWS)
    assert whole.shape == (2001, 6) and spread.shape == (2001, 6, 6)
    np.testing.assert_allclose(mean, whole[ROWS], atol=1e-12)
    np.testing.assert_allclose(covariance, spread[ROWS], atol=1e-14)


def test_at_a_target_it_is_what_the_target_says(adjustment, parameters):
    "By B at a target's epoch the predicted misclosure is the observed one to its noise, 3 sigma"
    targets = adjustment.targets
    rows = np.round((adjustment.observed - START) / 0.1).astype(int)
    pose, _ = predict_under(adjustment, parameters, rows)
    predicted = np.einsum("nij,nj->ni", targets.partials[:, 0], pose)
    assert np.abs(predicted - targets.misclosure).max() < 0.02  # m
    assert np.abs(targets.misclosure).max() > 0.05  # m


def test_one_set_of_parameters_predicts_itself(adjustment, parameters):
    "With a single set of parameters the average is its prediction, with its covariance"
    mean, covariance = predict_pose_error(adjustment, sure((parameters, 1.0)))
    expected, spread = predict_under(adjustment, parameters)
    np.testing.assert_allclose(mean, expected, atol=1e-9)
    np.testing.assert_allclose(covariance, spread, rtol=1e-5, atol=1e-15)


def test_two_sets_are_mixed_by_weight(adjustment, parameters):
    "At control epochs mean and variance are those of a mixture of 30 and 70 %"
    other = replace(parameters, drift_time=parameters.drift_time / 3, drift_scale=2.0)
    mean, covariance = predict_pose_error(adjustment, sure((parameters, 0.3), (other, 0.7)))
    rows = np.searchsorted(adjustment.trajectory.gps_time, adjustment.observed)
    parts = [predict_under(adjustment, p, rows) for p in (parameters, other)]
    expected = 0.3 * parts[0][0] + 0.7 * parts[1][0]
    square = sum(
        w * (np.einsum("qii->qi", c) + m**2) for w, (m, c) in zip((0.3, 0.7), parts, strict=True)
    )
    np.testing.assert_allclose(mean[rows], expected, atol=1e-9)
    variance = np.einsum("qii->qi", covariance[rows])
    np.testing.assert_allclose(variance, square - expected**2, rtol=1e-6, atol=1e-16)


def test_doubt_about_parameters_widens_the_sigma(adjustment, parameters):
    "Two readings that disagree leave no axis surer than both are in the mean"
    other = replace(parameters, drift_time=parameters.drift_time / 10, drift_scale=5.0)
    _, covariance = predict_pose_error(adjustment, sure((parameters, 0.5), (other, 0.5)))
    spreads = [predict_under(adjustment, p)[1] for p in (parameters, other)]
    variance = [np.einsum("qii->qi", c)[:, :3] for c in (covariance, *spreads)]
    rows = GridPredictions(adjustment).rows
    mean = (variance[1] + variance[2]) / 2
    assert (variance[0][rows] > (1 - 1e-6) * mean[rows]).all()


def test_the_last_epoch_of_an_outage_has_its_own_sigma():
    """If sigma(t) falls at once and the path has no step, the epoch before has the average.

    It is taken over all parameters, and is not half of the value after re-acquisition.
    """
    rng = np.random.default_rng(3)
    sigma = filtered_outage(rng)[1]
    case = Case(EPOCHS, waves(rng, 0.01), even(8), rng, sigma)
    adjustment = with_drift_history(case.adjustment())
    history = adjustment.errors.history
    assert len(history.steps) == len(history.restarts) == 0 and len(history.returns) == 1
    last = np.searchsorted(case.recorded.gps_time, history.returns) - 1
    posterior = choose_parameters(adjustment, points=8)
    mean = 0.0
    square = 0.0
    for chosen, weight in posterior.mixture:
        pose, spread = predict_under(adjustment, chosen, last)
        mean = mean + weight * pose
        square = square + weight * (variances(spread) + pose**2)
    pose, spread = predict_pose_error(adjustment, posterior)
    assert variances(spread[last]) == pytest.approx(square - mean**2, rel=1e-6)
    assert pose[last] == pytest.approx(mean, abs=1e-9)


def test_a_session_of_a_lower_rate_has_as_many_epochs_a_second():
    "100 s at 1 Hz beside 100 s at 200 Hz are half of the epochs that are averaged over"
    time = START + np.concatenate([np.arange(0.0, 100.0, 0.005), np.arange(1000.0, 1100.0)])
    position = np.outer(time - START, [10.0, 0.0, 0.0])
    session = np.repeat([0, 1], [20_000, 100])
    drive = Trajectory(time, position, Rotation.identity(len(time)), session=session)
    adjustment = position_adjustment(drive, Matched.none(), Pos(), 0, position_prior)
    rows = GridPredictions(adjustment).rows
    assert 95 <= np.sum(rows >= 20_000) <= 100 and 145 <= np.sum(rows < 20_000) <= 160


def test_parameters_of_no_weight_are_not_worked_out(adjustment, parameters):
    "A point of a weight of 1e-4 changes no bit, and what is left counts as one"
    wild = replace(parameters, drift_scale=1e3)
    alone = predict_pose_error(adjustment, sure((parameters, 1.0)))
    both = predict_pose_error(adjustment, sure((parameters, 1.0 - 1e-4), (wild, 1e-4)))
    for here, there in zip(both, alone, strict=True):
        np.testing.assert_allclose(here, there, rtol=1e-12, atol=1e-15)


def test_solutions_that_others_made_predict_the_same(adjustment, posterior):
    "Solutions of the target tests give the same prediction to the last bit, without solving again"
    known = GridPredictions(adjustment)
    all_tests(adjustment, posterior, known.add)
    assert set(known.poses) == {parameters for parameters, _ in posterior.mixture}
    for here, there in zip(
        predict_pose_error(adjustment, posterior, known),
        predict_pose_error(adjustment, posterior),
        strict=True,
    ):
        np.testing.assert_array_equal(here, there)


def test_the_most_probable_solution_is_handed_on_once(adjustment, posterior):
    "The last solution of a target test is reused once; a second request solves it again"
    mode = posterior.mixture[0][0]
    known = GridPredictions(adjustment, mode=mode)
    all_tests(adjustment, posterior, known.add)
    (held,) = known.kept.values()
    assert known.take(mode) is held
    assert known.take(mode) is not held
    np.testing.assert_array_equal(known.take(mode).weights, held.weights)


def test_covariances_are_covariances(adjustment, posterior):
    "Symmetric and positive at all epochs, of position and rotation together"
    mean, covariance = predict_pose_error(adjustment, posterior)
    assert np.isfinite(mean).all()
    np.testing.assert_allclose(covariance, covariance.swapaxes(1, 2), rtol=1e-9, atol=1e-15)
    sigma = np.sqrt(np.einsum("qii->qi", covariance))
    correlation = covariance / (sigma[:, :, None] * sigma[:, None, :])
    assert np.linalg.eigvalsh(correlation).min() > -1e-9


def test_the_sigma_is_least_where_control_is(adjustment, posterior):
    "Of E and N the smallest sigma of the drive is beside a target, the largest far from all"
    _, covariance = predict_pose_error(adjustment, posterior)
    sigma = np.sqrt(np.einsum("qii->qi", covariance)[:, :2]).max(axis=1)
    control = adjustment.observed - START
    away = np.abs(EPOCHS[:, None] - control).min(axis=1)
    assert away[np.argmin(sigma)] < 2.0 and away[np.argmax(sigma)] > 5.0  # s


def test_another_place_gives_the_same_error(parameters):
    "300 km away the predicted errors are the same to 1 um"
    case = smooth_case(11, n=7)
    expected = predict_under(case.adjustment(order=1), parameters, ROWS)[0]
    offset = np.array([-300_000.0, 200_000.0, 1_000.0])
    for name in ("recorded", "true", "observations", "control"):
        value = getattr(case, name)
        setattr(case, name, replace(value, position=value.position + offset))
    moved = case.adjustment(order=1)
    np.testing.assert_allclose(predict_under(moved, parameters, ROWS)[0], expected, atol=1e-6)


def test_epochs_over_which_a_fall_back_is_spread_follow_the_vehicle():
    "A step of 2.6 m within 0.1 s on a bend: 1 mm of the true path, where half was off by metres"
    time = 413_200.0 + np.arange(0.0, 40.0, 0.01)  # s of week
    angle = 8.0 * (time - time[0]) / 50.0
    circle = 50.0 * np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle])
    share = np.clip((time - time[2000]) / 0.1, 0.0, 1.0)
    error = np.outer(1.0 - share, [2.0, -1.5, 0.7])  # m, gone once GNSS is back
    path = np.array([523_000.0, 3_378_000.0, 40.0]) + circle
    recorded = Trajectory(time, path - error, Rotation.identity(len(time)))
    steps = find_steps(recorded)
    pose = np.zeros((len(time), 6))
    pose[time < steps.middle, :3] = error[0]
    covariance = np.tile(np.diag([0.01**2] * 3 + [1e-8] * 3), (len(time), 1, 1))
    inside = (time > steps.before) & (time < steps.after)
    assert inside.sum() >= 9 and np.abs(pose[inside, :3] - error[inside]).max() > 0.9  # m
    bridged, wider = bridge_steps(recorded, steps, pose, covariance)
    assert np.abs(bridged[inside, :3] - error[inside]).max() < 0.001  # m
    np.testing.assert_array_equal(bridged[~inside], pose[~inside])
    sigma = np.sqrt(np.einsum("qii->qi", wider[inside])[:, :3])
    assert (sigma >= 0.01).all() and sigma.max() < 0.2  # m
