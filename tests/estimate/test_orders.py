"""Orders of the trend are compared by what they explain and what they cost."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from mlscorr.collocation import polynomial_design
from mlscorr.estimate import Objective
from mlscorr.estimate.pos_error import affordable_order, compare_orders, leave_targets_out
from mlscorr.estimate.posterior import most_probable
from mlscorr.evaluate import model_section
from mlscorr.pos import pose_signals
from tests.beds.pos_errors import CONSTANT, EPOCHS, Case, even, smooth_case


@pytest.mark.long
@pytest.mark.parametrize(("n", "order"), [(1, 0), (2, 0), (3, 1), (4, 2), (5, 3), (6, 3)])
def test_the_order_falls_with_too_few_control_points(n, order):
    "A trend needs one control point more than parameters per axis; a lowered order is told"
    rng = np.random.default_rng(n)
    estimate = Case(EPOCHS, CONSTANT, even(n), rng).estimate(order=3)
    lowered = [s for s in estimate.statements if s.key == "lowered order"]
    assert estimate.order == order
    assert len(lowered) == (order < 3)


@pytest.mark.long
@pytest.mark.parametrize("number", [1, 7, 14])
def test_left_out_misclosures_are_those_of_an_estimate_without_the_target(number):
    "left_out of a target is what the others' trend and signals leave there, to 1e-9 m"
    case = smooth_case(3)
    estimate = case.estimate()
    adjustment = estimate.adjustment
    alone = np.arange(16) == number
    one = adjustment.select(alone)
    others = adjustment.select(~alone)
    target = one.targets
    signals = pose_signals(target.stated, estimate.parameters, target.partials[:, 0])
    mixings = [signal.mixing for signal in signals]
    design = others.pose_design(one.observed)[:, :3]
    solved = others.solve(estimate.parameters)
    clocks = [signal.clock for signal in signals]
    mean, _ = solved.predict(one.observed, design, mixings, clocks)
    assert estimate.left_out[number] == pytest.approx((target.misclosure - mean)[0], abs=1e-9)


@pytest.mark.long
def test_orders_and_families_are_set_side_by_side():
    "None, 0 and 1 in four families; probabilities sum to one, and the report has them all"
    estimate = smooth_case(2).estimate()
    pairs = {(one.order, one.parameters.family) for one in estimate.alternatives}
    assert len(pairs) == len(estimate.alternatives) == 12
    assert sum(one.probability for one in estimate.alternatives) == pytest.approx(1.0)
    section = model_section(estimate)
    assert {row["order"] for row in section["orders"]} == {-1, 0, 1}
    assert len(section["tests"]) == 16
    assert section["global_test"]["passed"]


@pytest.mark.long
def test_a_shift_needs_no_slope():
    "With a constant error, order 0 is more probable than order 1"
    rng = np.random.default_rng(5)
    stated = np.full((len(EPOCHS), 3), 0.01)
    estimate = Case(EPOCHS, CONSTANT, even(12), rng, stated).estimate()
    share = [sum(a.probability for a in estimate.alternatives if a.order == n) for n in (0, 1)]
    assert share[0] > share[1]


@pytest.mark.parametrize(
    "times, asked, order",
    [
        (even(8), 3, 3),
        (even(4), 3, 2),
        (even(2), 1, 0),
        (np.repeat(even(3), 3), 3, 1),
        (even(8), 0, 0),
    ],
    ids=["plenty", "four targets", "two targets", "three epochs", "a shift"],
)
def test_an_order_leaves_one_epoch_and_one_target_over(times, asked, order):
    "k targets at e epochs carry an order of min(k, e) - 2 at most, and never less than a shift"
    adjustment = Case(EPOCHS, CONSTANT, times, np.random.default_rng(1)).adjustment()
    assert affordable_order(asked, adjustment) == order


def test_passes_of_a_target_are_no_targets():
    "Three targets seen twice carry what three carry"
    case = Case(EPOCHS, CONSTANT, even(6), np.random.default_rng(1))
    case.observations = replace(case.observations, name=("T01", "T02", "T03") * 2)
    assert affordable_order(3, case.adjustment()) == 1


@pytest.fixture(scope="module")
def alternatives(adjustment):
    return compare_orders(adjustment, most_probable(adjustment))


def test_probabilities_follow_likelihood_and_prior(adjustment, alternatives):
    "Their ratios are those of the posterior, and sum to one"
    values = []
    for row in alternatives:
        objective = Objective.of(replace(adjustment, order=row.order))
        values.append(objective(row.parameters.family, objective.logarithms(row.parameters)))
    share = np.exp(np.array(values) - max(values))
    np.testing.assert_allclose([row.probability for row in alternatives], share / share.sum())


def test_the_likelihood_is_that_of_a_trend_with_a_prior(adjustment, alternatives):
    "It is the density of misclosures with coefficients of the trend's sigma, to 1e-6"
    row = next(row for row in alternatives if row.order == 0)
    targets = adjustment.targets
    signals = pose_signals(targets.stated, row.parameters, targets.partials[:, 0])
    n = 3 * len(adjustment.names)
    total = targets.noise.matrix.copy()
    for signal in signals:
        if signal.clock is None:
            clock = adjustment.observed
        else:
            clock = signal.clock
        time = np.repeat(clock, 3)
        mixing = signal.mixing.reshape(n, -1)
        total += (mixing @ mixing.T) * signal.covariance(time[:, None] - time)
    design = polynomial_design(adjustment.observed, adjustment.span, 0).reshape(n, -1)
    wide = total + row.parameters.trend_sigma**2 * design @ design.T
    density = multivariate_normal(np.zeros(n), wide).logpdf(targets.misclosure.ravel())
    assert row.log_likelihood == pytest.approx(density, abs=1e-6)


@pytest.mark.long
def test_a_slope_is_worth_an_order():
    "A drift of 1 m over the drive that no signal is believed to make needs order 1, no higher"
    slope = np.outer(EPOCHS / EPOCHS[-1], [1.0, -0.7, 0.5])
    sigma = np.full((len(EPOCHS), 3), 0.005)
    case = Case(EPOCHS, slope, even(7), np.random.default_rng(3), sigma)
    adjustment = case.adjustment(order=1)
    rows = compare_orders(adjustment, most_probable(adjustment))
    share = [sum(row.probability for row in rows if row.order == n) for n in range(4)]
    assert int(np.argmax(share)) == 1 and share[1] > 10 * share[0]


def test_left_out_targets_take_all_their_passes_along(small_case):
    "Seen twice, a target isn't predicted by its other pass: both left-out values are the same"
    case = smooth_case(11, n=7)
    twice = np.append(np.arange(7), 2)
    case.observations = case.observations[twice]
    adjustment = case.adjustment(order=1)
    objective = Objective.of(adjustment)
    solved = adjustment.solve(objective.parameters("matern32", objective.initial))
    left = leave_targets_out(adjustment, solved)
    np.testing.assert_allclose(left[7], left[2], atol=1e-9)
    once = small_case.adjustment(order=1)
    objective = Objective.of(once)
    alone = once.solve(objective.parameters("matern32", objective.initial))
    alone = leave_targets_out(once, alone)
    np.testing.assert_allclose(left[2], alone[2], atol=1e-6)


def test_two_targets_test_each_other_under_a_shift_that_may_be_anything():
    "By least squares each leaves of the other what they differ by, to 1e-9 m"
    case = Case(EPOCHS, CONSTANT, even(2), np.random.default_rng(5))
    shift = case.adjustment(order=0)
    left = leave_targets_out(shift, shift.solve(None))
    first, second = shift.targets.misclosure
    np.testing.assert_allclose(left[0], first - second, atol=1e-9)
