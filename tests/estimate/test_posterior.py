"""The parameters' posterior is likelihood times prior, and its points stand for all of it."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.stats import norm

from mlscorr.collocation import FAMILIES, INTEGRATED
from mlscorr.estimate import (
    SETTINGS,
    Objective,
    estimate_correction,
    position_adjustment,
    position_prior,
    tie_factor,
)
from mlscorr.estimate.posterior import (
    IMPROBABLE,
    NAMES,
    Prior,
    choose_parameters,
    most_probable,
    mounting_prior,
)
from mlscorr.survey import Pos
from tests.beds.pos_errors import CONSTANT, EPOCHS, Case, even, smooth_case
from tests.beds.tied_passes import tied_passes


def drawn(objective, seed=1):
    "Free logarithms within the prior"
    rng = np.random.default_rng(seed)
    return objective.initial + 0.5 * objective.spread * rng.normal(size=len(objective.initial))


@pytest.mark.parametrize("family", (*FAMILIES, INTEGRATED))
def test_the_objective_is_log_likelihood_plus_log_prior(objective, adjustment, family):
    "The normal density of the logarithms, but for its constant, and the solution's likelihood"
    at = drawn(objective)
    parameters = objective.parameters(family, at)
    logarithm = norm(objective.initial, objective.spread).logpdf(at).sum()
    logarithm += np.log(objective.spread * np.sqrt(2 * np.pi)).sum()
    expected = adjustment.solve(parameters).log_likelihood + logarithm
    assert objective(family, at) == pytest.approx(expected, abs=1e-9)


def test_parameters_and_logarithms_are_each_others_inverse(objective):
    "There and back to 1e-12; the attitude's time is that of the drift where it follows it"
    at = drawn(objective)
    parameters = objective.parameters("matern32", at)
    np.testing.assert_allclose(objective.logarithms(parameters), at, atol=1e-12)
    assert parameters.attitude_time == pytest.approx(parameters.drift_time)


def test_fixed_parameters_stay_at_their_start(objective):
    "Fixed parameters keep the prior's start value, whatever the others are"
    parameters = objective.parameters("matern32", drawn(objective))
    fixed = set(range(len(NAMES))) - set(objective.prior.free) - {NAMES.index("attitude_time")}
    for i in fixed:
        expected = np.exp(objective.prior.start[i])
        assert getattr(parameters, NAMES[i]) == pytest.approx(expected)


@pytest.mark.parametrize("family", ["matern32", INTEGRATED])
def test_the_gradient_is_the_slope(objective, family):
    "Forward differences agree with central ones of half the step to a hundredth of their size"
    at = drawn(objective)
    _, gradient = objective.gradient(family, at)
    h = SETTINGS.gradient_step / 2
    central = [
        (objective(family, at + h * e) - objective(family, at - h * e)) / (2 * h)
        for e in np.eye(len(at))
    ]
    np.testing.assert_allclose(gradient, central, atol=0.02 * (1 + np.abs(central).max()))


def test_the_maximum_is_higher_than_all_about_it(objective):
    """From the start and from elsewhere the same height, above 40 points drawn within the prior.

    Not from anywhere: drift and a bias that changes as fast are two readings of seven targets.
    """
    at, value = objective.maximum("matern32", objective.initial)
    assert value == pytest.approx(objective("matern32", at), abs=1e-9)
    other = objective.maximum("matern32", drawn(objective, 3))[1]
    assert other == pytest.approx(value, abs=0.05)
    assert all(objective("matern32", drawn(objective, seed)) < value for seed in range(40))


def gaussian(curvature, centre):
    "An objective that is a quadratic: its Laplace approximation is exact"

    class Quadratic(Objective):
        def __call__(self, family, logarithms):
            left = logarithms - centre
            return float(7.0 - 0.5 * left @ curvature @ left)

    k = len(centre)
    return Quadratic((), Prior(np.zeros(k), np.arange(k), np.full(k, 10.0), False))


def test_the_covariance_about_a_mode_is_the_inverse_curvature():
    "Of a quadratic it is exact, correlations included"
    root = np.random.default_rng(3).normal(size=(3, 3))
    curvature = root @ root.T + np.eye(3)
    centre = np.array([0.3, -0.2, 0.5])
    covariance = gaussian(curvature, centre).covariance("matern32", centre, 7.0)
    np.testing.assert_allclose(covariance, np.linalg.inv(curvature), rtol=1e-6)


@pytest.mark.parametrize("curvature", [np.diag([1e-6, 4.0]), np.diag([-2.0, 4.0])])
def test_nothing_is_known_less_than_before(curvature):
    "A flat or rising direction is as wide as the prior, 10, and the other keeps its own 1/2"
    covariance = gaussian(curvature, np.zeros(2)).covariance("matern32", np.zeros(2), 7.0)
    np.testing.assert_allclose(covariance, np.diag([100.0, 0.25]), rtol=1e-6, atol=1e-9)


def test_each_family_has_a_mode(adjustment):
    "Four families, the best first, each of the height that its parameters have"
    modes = most_probable(adjustment)
    objective = Objective.of(adjustment)
    assert sorted(chosen.family for chosen, _ in modes) == sorted((*FAMILIES, INTEGRATED))
    values = [value for _, value in modes]
    assert values == sorted(values, reverse=True)
    for chosen, value in modes:
        again = objective(chosen.family, objective.logarithms(chosen))
        assert again == pytest.approx(value, abs=1e-8)


def test_a_search_that_starts_at_the_modes_stays_there(adjustment):
    "Started from its own result the posterior's height changes by less than 0.05"
    modes = most_probable(adjustment)
    again = {
        chosen.family: value for chosen, value in most_probable(adjustment, [m for m, _ in modes])
    }
    for chosen, value in modes:
        assert again[chosen.family] == pytest.approx(value, abs=0.05)


def test_weights_and_probabilities_sum_to_one(posterior):
    "Probabilities of families and weights of points; the most probable family has most points"
    assert sum(share for _, share in posterior.modes) == pytest.approx(1.0)
    assert sum(weight for _, weight in posterior.points) == pytest.approx(1.0)
    shares = [share for _, share in posterior.modes]
    assert shares == sorted(shares, reverse=True)
    by_family = {}
    for chosen, weight in posterior.points:
        by_family[chosen.family] = by_family.get(chosen.family, 0.0) + weight
    listed = {c.family: s for c, s in posterior.modes if s > SETTINGS.smallest_share}
    total = sum(listed.values())
    assert by_family == pytest.approx({family: s / total for family, s in listed.items()})


@pytest.mark.long
def test_points_are_always_the_same(adjustment, posterior):
    "No random number enters: again, and with targets in another order, the same points to 1e-3"
    again = choose_parameters(adjustment, points=8)
    assert again == posterior
    shuffled = adjustment.select(np.random.default_rng(1).permutation(len(adjustment.names)))
    for (a, u), (b, v) in zip(
        choose_parameters(shuffled, points=8).points, posterior.points, strict=True
    ):
        assert u == pytest.approx(v, rel=0.02, abs=1e-4)
        assert a.drift_time == pytest.approx(b.drift_time, rel=0.02)


def test_no_point_stands_for_all(posterior):
    "The heaviest has at most five times the mean weight of its family's points"
    for family in {chosen.family for chosen, _ in posterior.points}:
        weights = [w for chosen, w in posterior.points if chosen.family == family]
        # cut at five times the mean before the cut; after it the mean is smaller
        assert max(weights) <= max(SETTINGS.heaviest / len(weights), 1.0) * sum(weights) + 1e-12


def test_more_drift_than_stated_raises_its_scale():
    "Drifts of 10 cm under a stated sigma of 1 cm: the most probable scale is 3 to 30"
    rng = np.random.default_rng(2)
    wave = 0.1 * np.sin(2 * np.pi * EPOCHS[:, None] / [90.0, 130.0, 70.0] + rng.uniform(0, 6, 3))
    case = Case(EPOCHS, wave, even(14), rng, np.full((len(EPOCHS), 3), 0.01))
    best = most_probable(case.adjustment())[0][0]
    assert 3.0 < max(best.drift_scale, best.bias_scale) < 30.0


@pytest.mark.parametrize("sigma", [0.02, 0.5])
def test_what_is_stated_stands_where_nothing_can_tell_its_scale(sigma):
    "A single control point leaves 100 s away from it what the POS states, to a factor of 3.5"
    case = Case(EPOCHS, CONSTANT / 4, [100.0], np.random.default_rng(3), np.full((2001, 3), sigma))
    corrected = case.estimate().correction.corrected
    largest = corrected.position_sigma.max(axis=0)
    assert (sigma < largest).all() and (largest < 3.5 * sigma).all()  # m


@pytest.mark.parametrize("times, is_known", [([100.0], False), ([60.0, 100.0], True)])
def test_a_single_target_is_left_out_for_no_others(times, is_known):
    "Nothing predicts it but the POS, which is no test; of two each tests the other"
    case = Case(EPOCHS, CONSTANT / 4, times, np.random.default_rng(3), np.full((2001, 3), 0.5))
    assert (np.isfinite(case.estimate().left_out) == is_known).all()


def test_a_target_is_in_one_block_with_all_its_passes():
    "Of 150 targets seen twice each has both looks in its block, and blocks are alike in size"
    times = np.sort(np.random.default_rng(4).uniform(2.0, 198.0, 300))
    case = Case(EPOCHS, CONSTANT, times, np.random.default_rng(4))
    names = np.array(case.control.name[:150] * 2)
    matched = case.matched
    matched = replace(
        matched,
        observations=replace(matched.observations, name=tuple(names)),
        surveyed=replace(matched.surveyed, name=tuple(names)),
    )
    adjustment = position_adjustment(case.recorded, matched, Pos(), 0, position_prior)
    blocks = Objective.of(adjustment).blocks
    assert [len(block.names) for block in blocks] == [100, 100, 100]
    assert all(len(rows) == 6 for block in blocks for rows in block.target_rows.values())


def test_looks_of_a_target_keep_their_order_in_a_block():
    "Of 75 targets seen twice, in no order of time: what is said of each look is said of that look"
    times = np.random.default_rng(4).uniform(2.0, 198.0, 150)
    case = Case(EPOCHS, CONSTANT, times, np.random.default_rng(4))
    adjustment = case.adjustment()
    twice = replace(adjustment.targets, name=np.array(case.control.name[:75] * 2))
    adjustment = adjustment.with_factor(twice)
    for block in Objective.of(adjustment).blocks:
        for name in block.target_rows:
            looks = (part.observed[part.names == name] for part in (block, adjustment))
            np.testing.assert_array_equal(*looks)


def test_large_surveys_are_cut_into_blocks_of_time():
    "250 targets are three blocks, one after the other in time, of all targets together"
    times = np.sort(np.random.default_rng(4).uniform(2.0, 198.0, 250))
    case = Case(EPOCHS, CONSTANT, times, np.random.default_rng(4))
    case.observations = case.observations[np.random.default_rng(5).permutation(250)]
    blocks = Objective.of(case.adjustment()).blocks
    assert len(blocks) == 3 and sorted(len(block.names) for block in blocks) == [83, 83, 84]
    assert {name for block in blocks for name in block.names} == set(case.control.name)
    ends = [block.span for block in blocks]
    assert all(before[1] < after[0] for before, after in pairwise(ends))


def test_a_calibration_frees_the_attitude_time():
    "If attitude does not follow the drift, its time is that of its own logarithm"
    case = smooth_case(7, n=6)
    adjustment = position_adjustment(case.recorded, case.matched, Pos(), 0, mounting_prior)
    objective = Objective.of(adjustment)
    at = drawn(objective)
    chosen = objective.parameters("matern32", at)
    position = [NAMES[i] for i in objective.prior.free].index("attitude_time")
    assert chosen.attitude_time == pytest.approx(np.exp(at[position]))
    assert replace(chosen, attitude_time=1.0).drift_time != pytest.approx(chosen.attitude_time)


@pytest.mark.long
def test_a_search_turns_back_from_scales_that_rounding_spoils():
    "Drift of kilometres beside ties seen twice to a micrometre: improbable, not the end"
    survey = tied_passes(1, number=40)
    control = estimate_correction(survey.trajectory, survey.matched).adjustment
    ties = tie_factor(control.errors, survey.ties).scaled(1e-7)
    twice = ties.select(np.repeat(np.arange(40), 2))
    objective = Objective.of(control.with_factor(twice))
    farthest = objective.initial + SETTINGS.farthest_spreads * objective.spread
    with pytest.raises(np.linalg.LinAlgError, match=r"not positive definite|Rounding leaves"):
        objective.blocks[0].weigh(objective.parameters("matern32", farthest))
    assert objective("matern32", farthest) == IMPROBABLE
    _, value = objective.maximum("matern32", objective.initial)
    assert value > objective("matern32", objective.initial)
