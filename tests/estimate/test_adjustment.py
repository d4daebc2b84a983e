"""Parts of an adjustment are those of the whole, and they solve to the dense formula."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mlscorr.collocation import (
    FAMILIES,
    INTEGRATED,
    collocate_rows,
    collocate_rows_dense,
    polynomial_design,
)
from mlscorr.estimate import TARGET, Objective, estimate_correction, with_ties
from mlscorr.estimate.adjustment import with_reacquisitions
from mlscorr.estimate.factors import REACQUISITION
from mlscorr.estimate.tied import sample
from mlscorr.pos import Steps
from mlscorr.survey import Pos, control_epochs
from tests.beds.pos_errors import CONSTANT, EPOCHS, LENGTH, START, Case, smooth_case
from tests.beds.tied_passes import tied_passes

N = 9
CASE = smooth_case(21, n=N)
ADJUSTMENT = CASE.adjustment(order=1)


def steps(*times):
    at = START + np.array(times)
    n = len(times)
    return Steps(at, at + 0.1, np.full((n, 3), 0.2), np.full(n, 0.01))


@settings(max_examples=30, deadline=None)
@given(st.lists(st.booleans(), min_size=N, max_size=N).filter(any))
def test_some_targets_have_their_rows_of_the_whole(kept):
    "By mask or by number: names, times, misclosures, partials, noise and beliefs of those rows"
    kept = np.array(kept)
    rows = np.flatnonzero(np.repeat(kept, 3))
    whole = ADJUSTMENT.targets
    covariance = whole.noise.matrix[np.ix_(rows, rows)]
    for chosen in (kept, np.flatnonzero(kept)):
        part = ADJUSTMENT.select(chosen).targets
        np.testing.assert_array_equal(part.name, whole.name[kept])
        np.testing.assert_array_equal(part.gps_time, whole.gps_time[kept])
        np.testing.assert_array_equal(part.misclosure, whole.misclosure[kept])
        np.testing.assert_array_equal(part.partials, whole.partials[kept])
        np.testing.assert_array_equal(part.stated.position, whole.stated.position[kept])
        np.testing.assert_allclose(part.noise.matrix, covariance, atol=1e-18)


def test_steps_stay_with_any_choice_of_targets():
    "Two targets of nine, and both re-acquisitions still follow them"
    complete = with_reacquisitions(ADJUSTMENT, steps(60.0, 120.0))
    part = complete.select([4, 1])
    assert part.names.tolist() == [ADJUSTMENT.names[4], ADJUSTMENT.names[1]]
    before = part.of_kind(REACQUISITION).gps_time[:, 0]
    np.testing.assert_array_equal(before, START + np.array([60.0, 120.0]))
    np.testing.assert_array_equal(part.observed, ADJUSTMENT.observed[[4, 1]])


def test_outer_steps_go():
    "Of re-acquisitions before, within and after the control span only the one within stays"
    first, last = (time - START for time in ADJUSTMENT.span)
    complete = with_reacquisitions(ADJUSTMENT, steps(first / 2, 100.0, (last + LENGTH) / 2))
    inner = complete.without_outer_steps()
    (step,) = inner.of_kind(REACQUISITION).gps_time
    assert step[0] == START + 100.0 and len(inner.names) == N
    outer = with_reacquisitions(ADJUSTMENT, steps(first / 2))
    for none in (outer, ADJUSTMENT):
        assert none.without_outer_steps().of_kind(REACQUISITION) is None


def test_rows_of_targets_are_the_first_of_a_solution():
    "Steps follow, three rows each, and a column of one kind is zero in the rows of the other"
    complete = with_reacquisitions(ADJUSTMENT, steps(60.0, 120.0))
    assert complete.rows_of(TARGET).tolist() == list(range(3 * N))
    assert complete.rows_of(REACQUISITION).tolist() == list(range(3 * N, 3 * N + 6))
    assert sorted(np.concatenate(list(complete.target_rows.values()))) == list(range(3 * N))
    column = complete.stacked({REACQUISITION: np.ones((2, 3, 1))})[:, 0]
    assert np.flatnonzero(column).tolist() == complete.rows_of(REACQUISITION).tolist()


def test_what_is_added_to_misclosures_arrives_in_its_row():
    "A solution's misclosures are those of the factors, one after the other, and what was added"
    complete = with_reacquisitions(ADJUSTMENT, steps(60.0, 120.0))
    added = np.random.default_rng(1).standard_normal(3 * N + 6)  # m
    before, after = (each.solve(None).misclosure for each in (complete, complete.with_added(added)))
    np.testing.assert_allclose(after - before, added, atol=1e-12)
    step = complete.of_kind(REACQUISITION).misclosure.ravel()
    np.testing.assert_array_equal(before[complete.rows_of(REACQUISITION)], step)


def test_targets_are_left_out_by_name():
    "All passes of a name go; without names nothing changes"
    case = smooth_case(21, n=N)
    case.observations = case.observations[np.append(np.arange(N), 3)]
    adjustment = case.adjustment()
    name = adjustment.names[3]
    assert (adjustment.names == name).sum() == 2
    left = adjustment.without({name})
    assert name not in left.names and len(left.names) == N - 1
    assert adjustment.without(set()) is adjustment


def test_rows_of_a_target_are_those_of_all_its_passes():
    "Three for each pass, in the order of the misclosures, and every row once"
    case = smooth_case(22, n=5)
    case.observations = case.observations[np.array([0, 1, 2, 1, 4, 0, 3])]
    adjustment = case.adjustment()
    rows = adjustment.target_rows
    assert list(rows) == list(dict.fromkeys(adjustment.names))
    assert rows[adjustment.names[1]].tolist() == [3, 4, 5, 9, 10, 11]
    assert sorted(np.concatenate(list(rows.values()))) == list(range(21))


@pytest.mark.parametrize(
    "times, epochs, interval",
    [
        ([10.0, 60.0, 110.0], 3, 50.0),
        ([10.0, 10.4, 10.8, 110.0], 2, 100.0),
        ([100.0, 100.2], 1, Pos().correlation_time / 4),
    ],
    ids=["apart", "three at one", "all at one"],
)
def test_targets_within_a_second_share_an_epoch(times, epochs, interval):
    "Control epochs, their span, and the mean interval between them"
    case = Case(EPOCHS, CONSTANT, times, np.random.default_rng(1))
    adjustment = case.adjustment()
    assert len(control_epochs(adjustment.observed)) == epochs
    assert adjustment.interval == pytest.approx(interval, abs=0.5)  # s
    assert adjustment.span == pytest.approx((START + times[0], START + times[-1]))


def test_gaps_of_the_trajectory_are_no_interval():
    "Without the 60 s that nothing was recorded, 120 s between two epochs are 60 s"
    case = Case(EPOCHS, CONSTANT, [40.0, 160.0], np.random.default_rng(1))
    keep = (EPOCHS < 70.0) | (EPOCHS > 130.0)
    old = case.recorded
    case.recorded = type(old)(old.gps_time[keep], old.position[keep], old.attitude[keep])
    assert case.adjustment().interval == pytest.approx(60.0, abs=0.3)


def test_least_squares_is_the_solution_without_parameters():
    "Without signals the trend is the weighted least squares fit of the misclosures, to 1e-9 m"
    solved = ADJUSTMENT.solve(None)
    design = polynomial_design(ADJUSTMENT.observed, ADJUSTMENT.span, 1).reshape(3 * N, -1)
    weight = np.linalg.inv(ADJUSTMENT.targets.noise.matrix)
    normal = design.T @ weight @ design
    expected = np.linalg.solve(normal, design.T @ weight @ ADJUSTMENT.targets.misclosure.ravel())
    np.testing.assert_allclose(solved.trend, expected, atol=1e-9)


def test_a_step_adds_three_to_the_redundancy():
    "A step is one observation of three rows, whatever the solver makes of its two epochs"
    complete = with_reacquisitions(ADJUSTMENT, steps(80.0))
    objective = Objective.of(complete)
    solved = complete.solve(objective.parameters("matern32", objective.initial))
    squares = (solved.misclosure - solved.design @ solved.trend) @ solved.weights
    assert len(solved.misclosure) == 3 * N + 3
    prior_rows, mean = solved.prior_rows[:, :-1], solved.prior_rows[:, -1]
    squares += np.sum((prior_rows @ solved.trend - mean) ** 2)
    redundancy = 3 * N + 3 + 6 - solved.design.shape[1]
    assert solved.sigma0 == pytest.approx(np.sqrt(squares / redundancy), rel=1e-9)


@pytest.mark.parametrize("family", ["exponential", "matern52", "integrated"])
def test_the_solution_is_the_dense_one(family):
    "With re-acquisitions, in any family: trend and likelihood to 1e-7, weights to 1e-6"
    complete = with_reacquisitions(ADJUSTMENT, steps(80.0))
    objective = Objective.of(complete)
    parameters = objective.parameters(family, objective.initial)
    solved = complete.solve(parameters)
    prior_rows = complete.prior_rows(parameters)
    expected = collocate_rows_dense(complete.rows(parameters), prior_rows)
    np.testing.assert_allclose(solved.trend, expected.trend, atol=1e-7)
    np.testing.assert_allclose(solved.weights, expected.weights, rtol=1e-6, atol=1e-4)
    assert solved.log_likelihood == pytest.approx(expected.log_likelihood, abs=1e-6)


@pytest.mark.long
def test_few_rows_with_ties_are_weighed_as_they_are_solved():
    "The log-likelihood by the covariance matrix is that of the knots, to 0.01 in any family"
    survey = tied_passes(1)
    estimate = with_ties(estimate_correction(survey.trajectory, survey.matched), survey.ties)
    few = sample(estimate.adjustment)
    objective = Objective.of(few)
    for family in (*FAMILIES, INTEGRATED):
        parameters = objective.parameters(family, objective.initial)
        weighed = few.weigh(parameters)
        prior_rows = few.prior_rows(parameters)
        solved = collocate_rows(few.rows(parameters), prior_rows=prior_rows)
        assert weighed.log_likelihood == pytest.approx(solved.log_likelihood, abs=0.01)


def test_the_trend_moves_positions_only():
    "A of the pose has a polynomial on each axis and nothing on rotations, also past the span"
    times = START + np.array([0.0, 50.0, LENGTH])
    design = replace(ADJUSTMENT, order=2).pose_design(times)
    assert design.shape == (3, 6, 9) and not design[:, 3:].any()
    np.testing.assert_array_equal(design[:, :3], polynomial_design(times, ADJUSTMENT.span, 2))


def test_other_starts_change_beliefs_and_nothing_else():
    "Drift that begins later: the same rows, and all factors and epochs of the drive have it"
    complete = with_reacquisitions(ADJUSTMENT, steps(80.0))
    starts = complete.errors.starts + 30.0
    later = complete.with_starts(starts)
    for before, after in zip(complete.factors, later.factors, strict=True):
        np.testing.assert_array_equal(after.misclosure, before.misclosure)
        np.testing.assert_array_equal(after.stated.starts, starts)
    np.testing.assert_array_equal(later.errors.starts, starts)
    np.testing.assert_array_equal(later.errors.epochs.starts, starts)
    assert len(later.errors.epochs.gps_time) == len(ADJUSTMENT.trajectory)


def test_what_is_known_of_unknowns_is_no_row_but_a_belief():
    "Each prior is a row of believed: its unknown over its sigma, and the value that is believed"
    columns = {TARGET: np.random.default_rng(2).standard_normal((N, 3, 2))}
    mean = np.array([0.3, -0.1])
    sigma = np.array([0.02, np.inf])  # nothing is known of the second
    wider = ADJUSTMENT.with_unknowns(columns, mean, sigma)
    assert wider.unknowns == 2 and len(wider.rows(None)) == 1
    row = np.append(np.eye(8)[0], 0.3) / 0.02
    np.testing.assert_allclose(wider.prior_rows(None), row[None])
    objective = Objective.of(wider)
    parameters = objective.parameters("matern32", objective.initial)
    prior_rows = wider.prior_rows(parameters)
    np.testing.assert_allclose(prior_rows[0], row)
    np.testing.assert_allclose(prior_rows[1:, 2:8], np.eye(6) / parameters.trend_sigma)
    assert not prior_rows[1:, :2].any() and not prior_rows[1:, -1].any()


def test_unknowns_that_come_later_leave_what_is_believed_of_others():
    "Two at once or one after the other: the same columns, the same beliefs, the same solution"
    columns = np.random.default_rng(3).standard_normal((N, 3, 2))
    mean = np.array([0.3, -0.1])
    sigma = np.array([0.02, 0.05])
    at_once = ADJUSTMENT.with_unknowns({TARGET: columns}, mean, sigma)
    in_turn = ADJUSTMENT
    for number in range(2):
        only = slice(number, number + 1)
        in_turn = in_turn.with_unknowns({TARGET: columns[:, :, only]}, mean[only], sigma[only])
    np.testing.assert_array_equal(in_turn.prior_rows(None), at_once.prior_rows(None))
    expected = at_once.solve(None)
    np.testing.assert_allclose(in_turn.solve(None).trend, expected.trend, atol=1e-9)
