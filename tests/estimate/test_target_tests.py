"""Each target is tested by all others, as Baarda did."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2, norm

from mlscorr.estimate import Objective, TargetTest
from mlscorr.estimate.posterior import Posterior
from mlscorr.estimate.target_tests import all_tests, single_test
from tests.beds.pos_errors import CONSTANT, EPOCHS, Case, even, rms, smooth_case


@pytest.mark.long
def test_what_tests_state_is_what_they_find():
    "Over good surveys w is at most standard normal, redundancies lie in [0, 1]"
    w = []
    for seed in range(3):
        for test in smooth_case(seed).estimate().tests:
            w.append(test.w)
            assert ((test.redundancy > 0) & (test.redundancy < 1)).all()
            assert test.detectable == pytest.approx(4.13 * test.sigma, rel=0.01)
    assert 0.7 < rms(w) < 1.15


def made_test(left_out, sigma, statistic=20.0, critical=10.0):
    ones = np.ones((1, 3))
    return TargetTest("T01", statistic, critical, left_out * ones, sigma * ones, 0.5 * ones)


def test_data_snooping_by_hand():
    "15 mm left out of 5 mm are w = 3; errors of 4.13 sigma are found in 4 of 5 cases"
    test = made_test(0.015, 0.005)
    assert test.w == pytest.approx(np.full((1, 3), 3.0))
    # power 80 % at significance 0.1 %, both sides
    detectable = test.detectable[0, 0] / 0.005
    assert norm.sf(norm.isf(0.0005) - detectable) == pytest.approx(0.8, abs=1e-6)
    assert test.excess == pytest.approx(2.0)


@pytest.fixture(scope="module")
def known(objective):
    "A posterior that knows the parameters"
    pairs = ((objective.parameters("matern32", objective.initial), 1.0),)
    return Posterior(pairs, pairs)


def test_a_test_is_that_of_the_left_out_misclosure(adjustment, known):
    "Under known parameters residual, sigma and chi-squared are those of leave_out"
    solved = adjustment.solve(known.points[0][0])
    for test in all_tests(adjustment, known):
        rows = adjustment.target_rows[test.name]
        residual, covariance = solved.leave_out(rows)
        np.testing.assert_allclose(test.left_out.ravel(), residual, atol=1e-12)
        np.testing.assert_allclose(test.sigma.ravel(), np.sqrt(np.diag(covariance)), rtol=1e-9)
        expected = residual @ np.linalg.inv(covariance) @ residual
        assert test.statistic == pytest.approx(expected, rel=1e-8)


def test_the_critical_value_shares_the_significance(adjustment, known):
    "0.1 % over all seven targets together, with three degrees of freedom for each pass"
    for test in all_tests(adjustment, known):
        assert chi2.sf(test.critical, 3) == pytest.approx(0.001 / 7)
    twice = smooth_case(11, n=7)
    twice.observations = twice.observations[np.array([0, 1, 2, 3, 4, 5, 6, 2])]
    by_name = {test.name: test for test in all_tests(twice.adjustment(order=1), known)}
    name = twice.control.name[2]
    assert chi2.sf(by_name[name].critical, 6) == pytest.approx(0.001 / 7)
    assert by_name[name].left_out.shape == (2, 3)


def test_redundancy_is_the_share_that_a_residual_shows(adjustment, known):
    "An error of 1 m in height at a target leaves r metres in its residual l - A x - B s"
    parameters = known.points[0][0]
    solved = adjustment.solve(parameters)
    for number, test in enumerate(all_tests(adjustment, known)):
        wrong = np.zeros(3 * len(adjustment.names))
        wrong[3 * number + 2] = 1.0
        moved = adjustment.with_added(wrong).solve(parameters)
        noise = adjustment.targets.noise.block(np.arange(3 * number, 3 * number + 3))
        change = (moved.weights - solved.weights).reshape(-1, 3)[number]
        assert (noise @ change)[2] == pytest.approx(test.redundancy[0, 2], abs=1e-6)


def test_a_gross_error_shows_at_its_target_most():
    "0.3 m at one of seven targets: its statistic is the largest and beyond the critical value"
    for number in (1, 3, 5):
        case = Case(
            EPOCHS,
            CONSTANT,
            even(7),
            np.random.default_rng(number),
            np.full((len(EPOCHS), 3), 0.01),
        )
        case.spoil(number, [0.3, 0.0, 0.0])
        adjustment = case.adjustment()
        objective = Objective.of(adjustment)
        pairs = ((objective.parameters("matern32", objective.initial), 1.0),)
        tests = all_tests(adjustment, Posterior(pairs, pairs))
        worst = max(tests, key=lambda test: test.excess)
        assert worst.name == case.control.name[number] and worst.excess > 1.0
        assert abs(worst.left_out[0, 0]) == pytest.approx(0.3, abs=0.05)  # m


def test_a_single_test_is_one_of_all(adjustment, posterior):
    "Alone or among the others, a target's test is the same"
    tests = {test.name: test for test in all_tests(adjustment, posterior)}
    for name in adjustment.names[[0, 4]]:
        alone = single_test(adjustment, name, posterior)
        assert alone.statistic == pytest.approx(tests[name].statistic)
        np.testing.assert_allclose(alone.left_out, tests[name].left_out)


def test_doubt_about_parameters_is_a_part_of_the_sigma(adjustment, known):
    "Averaged over two sets of parameters the variance holds the difference of their residuals"
    parameters = known.points[0][0]
    other = replace(parameters, drift_time=parameters.drift_time / 20, drift_scale=3.0)
    pairs = ((parameters, 0.5), (other, 0.5))
    solved = [adjustment.solve(p) for p, _ in pairs]
    for test in all_tests(adjustment, Posterior(pairs, pairs)):
        rows = adjustment.target_rows[test.name]
        (a, p), (b, q) = (s.leave_out(rows) for s in solved)
        np.testing.assert_allclose(test.left_out.ravel(), (a + b) / 2, atol=1e-12)
        variance = (np.diag(p) + np.diag(q)) / 2 + (a - b) ** 2 / 4
        np.testing.assert_allclose(test.sigma.ravel() ** 2, variance, rtol=1e-9)


def test_what_is_believed_of_the_trend_tests_two_targets():
    "Under a slope either of two is tested by the other, and a shift of 0.5 m in both is no fault"
    case = Case(EPOCHS, CONSTANT, even(2), np.random.default_rng(1))
    adjustment = case.adjustment(order=1)
    objective = Objective.of(adjustment)
    pairs = ((objective.parameters("matern32", objective.initial), 1.0),)
    for test in all_tests(adjustment, Posterior(pairs, pairs)):
        assert test.statistic > 0.0 and test.excess < 1.0
        assert np.isfinite(test.w).all() and np.isfinite(test.critical)
