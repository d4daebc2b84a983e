"""Parts of the equations are those of the whole, and they solve to the dense formula."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mlscorr.collocation import (
    FAMILIES,
    INTEGRATED,
    SparseRows,
    collocate_rows,
    collocate_rows_dense,
    polynomial_design,
)
from mlscorr.estimate import Objective, estimate_correction, with_ties
from mlscorr.estimate.adjustment import with_reacquisitions
from mlscorr.estimate.tied import sample
from mlscorr.pos import Steps, pose_signals
from mlscorr.survey import Pos, control_epochs
from tests.beds.pos_errors import CONSTANT, EPOCHS, LENGTH, START, Case, smooth_case
from tests.beds.tied_passes import tied_passes

N = 9
CASE = smooth_case(21, n=N)
EQUATIONS = CASE.adjustment(order=1)


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
    for part in (EQUATIONS.select(kept), EQUATIONS.select(np.flatnonzero(kept))):
        np.testing.assert_array_equal(part.names, EQUATIONS.names[kept])
        np.testing.assert_array_equal(part.gps_time, EQUATIONS.gps_time[kept])
        np.testing.assert_array_equal(part.misclosure.ravel(), EQUATIONS.misclosure.ravel()[rows])
        np.testing.assert_array_equal(part.partials, EQUATIONS.partials[kept])
        np.testing.assert_array_equal(part.stated.position, EQUATIONS.stated.position[kept])
        whole = EQUATIONS.noise.matrix[np.ix_(rows, rows)]
        np.testing.assert_allclose(part.noise.matrix, whole, atol=1e-18)


def test_fall_backs_stay_with_any_choice_of_targets():
    "Two targets of nine, and both fall-backs still follow them"
    complete = with_reacquisitions(EQUATIONS, steps(60.0, 120.0))
    part = complete.select([4, 1])
    assert part.names.tolist() == [EQUATIONS.names[4], EQUATIONS.names[1]]
    assert part.fallbacks == 2 and len(part.gps_time) == 6
    np.testing.assert_array_equal(part.gps_time[2::2], START + np.array([60.0, 120.0]))
    np.testing.assert_array_equal(part.observed, EQUATIONS.gps_time[[4, 1]])


def test_outer_fall_backs_go():
    "Of fall-backs before, within and after the control span only the one within stays"
    first, last = (time - START for time in EQUATIONS.span)
    complete = with_reacquisitions(EQUATIONS, steps(first / 2, 100.0, (last + LENGTH) / 2))
    inner = complete.without_outer_fallbacks()
    assert inner.fallbacks == 1 and len(inner.gps_time) == N + 2
    assert inner.gps_time[-2] == START + 100.0
    assert EQUATIONS.without_outer_fallbacks().fallbacks == 0


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
    solved = EQUATIONS.solve(None)
    design = polynomial_design(EQUATIONS.gps_time, EQUATIONS.span, 1).reshape(3 * N, -1)
    weight = np.linalg.inv(EQUATIONS.noise.matrix)
    normal = design.T @ weight @ design
    expected = np.linalg.solve(normal, design.T @ weight @ EQUATIONS.misclosure.ravel())
    np.testing.assert_allclose(solved.trend, expected, atol=1e-9)


def test_a_step_adds_three_to_the_redundancy():
    "sigma0 of two epochs of a step, whose place nothing tells, is that of one row of differences"
    complete = with_reacquisitions(EQUATIONS, steps(80.0))
    objective = Objective.of(complete)
    solved = complete.solve(objective.parameters("matern32", objective.initial))
    squares = (solved.misclosure - solved.design @ solved.trend) @ solved.weights
    redundancy = 3 * N + 3 + 6 - solved.design.shape[1]
    squares += np.sum((solved.believed @ solved.trend) ** 2)
    assert solved.sigma0 == pytest.approx(np.sqrt(squares / redundancy), rel=1e-9)


@pytest.mark.parametrize("family", ["exponential", "matern52", "integrated"])
def test_the_solution_is_the_dense_one(family):
    "With fall-backs, in any family: trend, likelihood and weights to 1e-7 of their size"
    complete = with_reacquisitions(EQUATIONS, steps(80.0))
    objective = Objective.of(complete)
    parameters = objective.parameters(family, objective.initial)
    solved = complete.solve(parameters)
    signals = pose_signals(complete.stated, parameters, complete.partials)
    rows = SparseRows(
        complete.gps_time[:, None], complete.misclosure, complete.noise, complete.design, signals
    )
    expected = collocate_rows_dense([rows], np.eye(6) / parameters.trend_sigma)
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
        believed = few.believed(parameters)
        solved = collocate_rows(few.rows(parameters), believed=believed)
        assert weighed.log_likelihood == pytest.approx(solved.log_likelihood, abs=0.01)


def test_the_trend_moves_positions_only():
    "A of the pose has a polynomial on each axis and nothing on rotations, also past the span"
    times = START + np.array([0.0, 50.0, LENGTH])
    design = replace(EQUATIONS, order=2).pose_design(times)
    assert design.shape == (3, 6, 9) and not design[:, 3:].any()
    np.testing.assert_array_equal(design[:, :3], polynomial_design(times, EQUATIONS.span, 2))


def test_other_starts_change_beliefs_and_nothing_else():
    "Drift that begins later: the same rows, and epochs of the whole drive that know of it"
    later = EQUATIONS.with_starts(EQUATIONS.stated.starts + 30.0)
    np.testing.assert_array_equal(later.misclosure, EQUATIONS.misclosure)
    np.testing.assert_array_equal(later.stated.starts, EQUATIONS.stated.starts + 30.0)
    np.testing.assert_array_equal(later.stated_epochs.starts, later.stated.starts)
    assert len(later.stated_epochs.gps_time) == len(EQUATIONS.trajectory)
