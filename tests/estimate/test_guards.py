"""Statements on parameters that control points do not determine, with times and numbers."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import chi2

from mlscorr.estimate import Objective, estimate_correction, guards_of, with_ties
from mlscorr.estimate.guards import (
    GlobalTest,
    Guards,
    _global_test,
    find_guards,
    global_test_warnings,
    guard_warnings,
    sparse_warnings,
)
from mlscorr.estimate.posterior import choose_parameters
from mlscorr.survey import Trajectory
from tests.beds.pos_errors import CONSTANT, EPOCHS, START, Case, even, smooth_case, waves
from tests.beds.tied_passes import LENGTH, tied_passes


@pytest.mark.long
def test_signals_extrapolated_in_time_are_told():
    "Both ends beyond the control span are named in seconds and correlation times"
    rng = np.random.default_rng(2)
    case = Case(EPOCHS, waves(rng), np.linspace(80.0, 110.0, 12), rng)
    estimate = case.estimate()
    first, last = estimate.statements
    assert first.key == last.key == "extrapolated"
    assert (first.values["side"], last.values["side"]) == ("before the first", "past the last")
    assert first.values["seconds"] == pytest.approx(80.0)
    assert last.values["seconds"] == pytest.approx(90.0)
    times = 90.0 / estimate.parameters.drift_time
    assert last.values["correlation_times"] == pytest.approx(times)
    assert last.values["is_faded"] == (times >= 3)
    assert smooth_case(1).estimate().warnings == ()


def test_components_that_targets_cannot_tell_are_told():
    "Targets level beside the car tell roll and heading; pitch, about their line, isn't told"
    rng = np.random.default_rng(6)
    sigma = np.radians(np.full((len(EPOCHS), 3), 0.2))
    stated = np.full((len(EPOCHS), 3), 0.005)
    guards = Case(EPOCHS, CONSTANT, even(16), rng, stated, None, sigma).estimate().guards
    assert guards.determined[3:].tolist() == [True, False, True]
    assert guards.variance_ratio[4] > 0.7


def two_passes(case):
    "The same drive with 60 s less in the middle: a gap of the trajectory"
    keep = (EPOCHS < 70.0) | (EPOCHS > 130.0)
    old = case.recorded
    if old.position_sigma is None:
        sigma = None
    else:
        sigma = old.position_sigma[keep]
    return Trajectory(old.gps_time[keep], old.position[keep], old.attitude[keep], sigma)


def test_a_pass_without_control_is_named():
    "All control in the first of two passes: corrected, and the second is named with its times"
    case = Case(EPOCHS, CONSTANT, np.linspace(3.0, 65.0, 8), np.random.default_rng(7))
    estimate = estimate_correction(two_passes(case), case.matched)
    (named,) = (s for s in estimate.statements if s.key == "pass without control")
    assert named.values == pytest.approx({"first": START + 130.1, "last": START + 200.0})
    assert estimate.guards.passes_without_control == ((START + 130.1, START + 200.0),)


def test_a_pass_without_control_is_a_gap_as_a_whole():
    "70 s of it are longer than 62 s between two points; without any control the longest pass is"
    passes = START + np.array([[0.0, 70.0], [130.0, 200.0]])
    without = Guards((0.0, 0.0), (), np.ones(6), None)
    guards = guards_of(passes, START + np.array([4.0, 66.0]), without)
    assert guards.gap == (START + 4.0, START + 66.0)
    assert guards.longest_gap == (START + 130.0, START + 200.0)
    edge = guards_of(passes[:1], START + np.array([66.0]), without)
    assert edge.longest_gap == (START, START + 66.0)
    assert guards_of(passes, np.empty(0), without).longest_gap == (START, START + 70.0)


def test_a_long_gap_between_control_points_is_told():
    "120 s without a target in the middle of a drive are named"
    times = np.append(np.linspace(3, 35, 8), np.linspace(165, 197, 8))
    case = Case(EPOCHS, waves(np.random.default_rng(8)), times, np.random.default_rng(8))
    guards = case.estimate().guards
    assert np.diff(guards.gap) == pytest.approx(130.0)


@pytest.mark.parametrize(
    ("times", "key", "targets"),
    [([100.0, 150.0], "few targets", 2), (np.full(8, 100.0), "one epoch", 8)],
)
def test_too_little_control_is_told(times, key, targets):
    "A correction is given, and a warning of what it can't know"
    case = Case(EPOCHS, CONSTANT, times, np.random.default_rng(9))
    estimate = case.estimate()
    assert (key, targets) in [(s.key, s.values.get("targets")) for s in estimate.statements]
    assert np.isfinite(estimate.correction.corrected.position).all()


def guards_with(test=None, gap=(0.0, 0.0)):
    return Guards(gap, (), np.ones(6), test)


@pytest.mark.parametrize(("statistic", "passes"), [(2.0, True), (59.6, True), (59.8, False)])
def test_the_global_test_is_chi_squared(statistic, passes):
    "Of 30 degrees of freedom up to 59.7 passes; above a warning says so"
    test = GlobalTest(statistic, 30.0, chi2.isf(0.001, 30))
    keys = [warning.key for warning in global_test_warnings(guards_with(test))]
    assert test.passed == passes
    assert keys == ["global test"] * (not passes)


def test_without_redundancy_there_is_no_global_test():
    "As many misclosures as parameters leave nothing to test, and nothing to warn of"
    assert not list(global_test_warnings(guards_with()))
    case = Case(EPOCHS, CONSTANT, [100.0], np.random.default_rng(1))
    assert _global_test(case.adjustment(order=0), None) is None


def test_the_global_test_is_that_of_least_squares_without_signals():
    "With noise only, it is the weighted sum of squares of all redundant misclosures"
    adjustment = smooth_case(13, n=7).adjustment()
    test = _global_test(adjustment, None)
    assert test.redundancy == pytest.approx(3 * 7 - 3 * (adjustment.order + 1))
    assert test.statistic == pytest.approx(adjustment.solve(None).sigma0 ** 2 * test.redundancy)
    assert test.upper == pytest.approx(chi2.isf(0.001, test.redundancy))


def test_understated_sigmas_fail_the_global_test_and_true_ones_do_not():
    "Control points four times as far off as they say are told of, beside drift that is as it says"
    adjustment = smooth_case(13, n=24).adjustment()
    parameters = choose_parameters(adjustment).modes[0][0]
    sigma = np.sqrt(np.einsum("nii->ni", adjustment.targets.noise.separate)).ravel()
    noise = np.random.default_rng(3).normal(size=sigma.shape)
    spoiled = adjustment.with_added(np.sqrt(15.0) * sigma * noise)
    assert _global_test(adjustment, parameters).passed
    assert not _global_test(spoiled, parameters).passed


def test_components_are_determined_below_half_of_their_variance():
    "A posterior of 0.49 of the prior variance is told by control points, one of 0.51 is not"
    ratio = np.array([0.0, 0.49, 0.51, 1.0, 0.2, 0.9])
    guards = Guards((0.0, 0.0), (), ratio, None)
    assert guards.determined.tolist() == [True, True, False, False, True, False]


def found(times, trajectory=None):
    "Guards of equations under the parameters that are believed before the misclosures"
    case = Case(EPOCHS, CONSTANT, times, np.random.default_rng(3))
    if trajectory is not None:
        case.recorded = trajectory(case)
    adjustment = case.adjustment()
    objective = Objective.of(adjustment)
    parameters = objective.parameters("matern32", objective.initial)
    unknown = np.full((len(case.recorded), 3), 1.0)
    corrected = SimpleNamespace(
        gps_time=case.recorded.gps_time, position_sigma=unknown, attitude_sigma=unknown
    )
    return find_guards(adjustment, parameters, corrected), adjustment, parameters


@pytest.mark.parametrize(
    "times, gap",
    [
        ([5.0, 50.0, 120.0, 190.0], (50.0, 120.0)),
        ([100.0, 150.0], (0.0, 100.0)),
        ([10.0, 40.0, 60.0], (60.0, 200.0)),
    ],
    ids=["inside", "before", "after"],
)
def test_the_longest_gap_is_between_control_or_to_an_end(times, gap):
    "Ends of passes count as edges; times in s of the week"
    assert found(times)[0].gap == pytest.approx(tuple(START + np.array(gap)), abs=0.1)


def test_a_gap_does_not_reach_over_a_pause_of_the_recording():
    "60 s without a trajectory are no stretch without control: each pass has its own edges"
    guards, _, _ = found([20.0, 60.0, 140.0, 180.0], two_passes)
    assert guards.gap[1] - guards.gap[0] == pytest.approx(40.0, abs=0.2)
    assert guards.passes_without_control == ()


def test_what_was_not_improved_has_a_ratio_of_one():
    "Sigmas after the correction that are larger than those before count as no better: at most 1"
    guards, _, _ = found([20.0, 100.0, 180.0])
    np.testing.assert_array_equal(guards.variance_ratio, np.ones(6))
    assert not guards.determined.any()


def test_a_signal_that_fades_in_a_gap_is_told():
    "Three correlation times and more without control: where, how long, and what applies"
    guards, adjustment, parameters = found([5.0, 30.0, 170.0, 195.0])
    short = type(parameters)(**{**vars(parameters), "drift_time": 20.0, "bias_time": 20.0})
    long = type(parameters)(**{**vars(parameters), "drift_time": 90.0, "bias_time": 90.0})
    (faded,) = (s for s in guard_warnings(guards, adjustment, short) if s.key == "faded")
    expected = {"seconds": 140.0, "start": START + 30.0, "correlation_times": 7.0}
    assert faded.values == pytest.approx(expected)
    assert "faded" not in [s.key for s in guard_warnings(guards, adjustment, long)]


@pytest.mark.parametrize(
    "times, asked, expected",
    [
        (
            even(2),
            1,
            {
                "lowered order": {"targets": 2, "epochs": 2, "asked": 1, "order": 0},
                "few targets": {"targets": 2, "least": 3},
            },
        ),
        ([100.0], 0, {"few targets": {"targets": 1, "least": 3}}),
        (
            [100.0, 100.2, 100.4],
            0,
            {"one epoch": {"targets": 3, "seconds": 0.4, "start": START + 100.0}},
        ),
        (even(6), 0, {}),
    ],
)
def test_sparse_control_is_told_in_numbers(times, asked, expected):
    "A lowered order, fewer points than show a fault, or all at one epoch; enough say nothing"
    adjustment = Case(EPOCHS, CONSTANT, times, np.random.default_rng(4)).adjustment()
    warnings = {warning.key: warning.values for warning in sparse_warnings(adjustment, asked)}
    assert list(warnings) == list(expected)
    for key, values in expected.items():
        assert warnings[key] == pytest.approx(values)


@pytest.mark.long
def test_what_ties_hold_is_not_said_to_fade():
    "Control in the first of two passes alone: without ties the second is warned of, with them not"
    passes = tied_passes(0)
    first = passes.matched.gps_time < passes.trajectory.gps_time[0] + LENGTH
    alone = estimate_correction(passes.trajectory, passes.matched[first])
    assert "pass without control" in [warning.key for warning in alone.statements]
    assert with_ties(alone, passes.ties).statements == ()
