"""The least squares that all solvers share."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import lstsq
from scipy.stats import multivariate_normal

from mlscorr.collocation import (
    Covariance,
    Noise,
    Signal,
    SparseRows,
    collocate,
    collocate_rows_dense,
)
from mlscorr.collocation.model import signal_clocks, solve_trend
from tests.beds.shared_noise import noise_of, written_out
from tests.collocation.dense import collocate_dense

START = 413_200.0  # s of week


def test_clocks_are_gps_time_where_a_signal_has_none():
    "One column for each signal; none without signals"
    gps_time = START + np.arange(4.0)
    mixing = np.ones((4, 1, 1))
    covariance = Covariance("exponential", 5.0)
    signals = [Signal(mixing, covariance), Signal(mixing, covariance, np.arange(4.0) ** 2)]
    clocks = signal_clocks(signals, gps_time)
    np.testing.assert_array_equal(clocks, np.column_stack([gps_time, [0.0, 1.0, 4.0, 9.0]]))
    assert signal_clocks([], gps_time).shape == (4, 0)


def solved_without_signals(order, n=9, sigma=0.01):
    "A polynomial through misclosures of equal weight, and numpy's"
    time = np.linspace(-1.0, 1.0, n)
    misclosure = np.random.default_rng(order).normal(0.0, sigma, (n, 1))
    design = np.polynomial.legendre.legvander(time, order)
    noise = Noise(np.full((n, 1, 1), sigma**2))
    solved = collocate(START + time, misclosure, noise, design[:, None], [])
    return solved, misclosure[:, 0], design


@pytest.mark.parametrize("order", range(5))
def test_without_signals_it_is_least_squares(order):
    "x, its covariance and sigma0 are those of ordinary least squares with weights 1 / sigma^2"
    solved, misclosure, design = solved_without_signals(order)
    expected, squares, *_ = lstsq(design, misclosure)
    np.testing.assert_allclose(solved.trend, expected, atol=1e-12)
    cofactor = 0.01**2 * np.linalg.inv(design.T @ design)
    np.testing.assert_allclose(solved.trend_covariance, cofactor, rtol=1e-9, atol=1e-15)
    assert solved.sigma0 == pytest.approx(np.sqrt(squares / 0.01**2 / (9 - order - 1)))


def test_weighted_residuals_are_free_of_the_trend():
    "A^T V^-1 (l - A x) = 0: the normal equations"
    solved, _, design = solved_without_signals(3)
    np.testing.assert_allclose(design.T @ solved.weights, 0.0, atol=1e-9)


def test_a_trend_in_the_data_changes_neither_likelihood_nor_residuals():
    "Adding any polynomial of the trend's order to the misclosures moves x alone"
    case = Passes(4)
    before = case.solve()
    moved = np.array([0.7, -1.1])
    case.misclosure = case.misclosure + case.design @ moved
    after = case.solve()
    np.testing.assert_allclose(after.trend - before.trend, moved, atol=1e-10)
    assert after.log_likelihood == pytest.approx(before.log_likelihood, abs=1e-8)
    np.testing.assert_allclose(after.weights, before.weights, atol=1e-7)


def test_sigma0_follows_the_scale_of_the_misclosures():
    "Twice the misclosures are twice sigma0; of as many misclosures as parameters there is none"
    case = Passes(5)
    once = case.solve().sigma0
    case.misclosure = 2.0 * case.misclosure
    assert case.solve().sigma0 == pytest.approx(2.0 * once)
    time = START + np.arange(2.0)
    design = np.stack([np.ones((2, 1)), np.arange(2.0)[:, None]], axis=2)
    exact = collocate(time, np.ones((2, 1)), Noise(np.ones((2, 1, 1))), design, [])
    assert np.isnan(exact.sigma0)


class Passes:
    "Three axes of a drive with a signal, targets of several passes, a trend of two columns"

    def __init__(self, seed, n=10):
        rng = np.random.default_rng(seed)
        self.gps_time = START + np.sort(rng.uniform(0.0, 100.0, n))
        self.misclosure = rng.normal(0.0, 0.1, (n, 3))
        self.noise = noise_of(seed, n)
        self.design = rng.normal(size=(n, 3, 2))
        self.signal = Signal(0.05 * rng.normal(size=(n, 3, 3)), Covariance("matern32", 20.0))

    def solve(self, by=collocate):
        return by(self.gps_time, self.misclosure, self.noise, self.design, [self.signal])


@pytest.mark.parametrize("rows", [[0], [3, 4, 5], [0, 29], [6, 7, 8, 21, 22, 23]])
def test_what_is_left_out_is_judged_by_the_others(rows):
    "Residuals and covariance are those of universal kriging from all other rows"
    case = Passes(6)
    mixing = case.signal.mixing.reshape(30, 3)
    design = case.design.reshape(30, 2)
    time = np.repeat(case.gps_time, 3)
    total = (mixing @ mixing.T) * case.signal.covariance(time[:, None] - time)
    total += written_out(case.noise)
    others = np.setdiff1d(np.arange(30), rows)
    a = design[others]
    system = np.block([[total[np.ix_(others, others)], a], [a.T, np.zeros((2, 2))]])
    wanted = np.vstack([total[np.ix_(others, rows)], design[rows].T])
    weights = np.linalg.solve(system, wanted)
    flat = case.misclosure.ravel()
    residual, covariance = case.solve(collocate_dense).leave_out(np.array(rows))
    np.testing.assert_allclose(residual, flat[rows] - weights[:-2].T @ flat[others], atol=1e-9)
    expected = total[np.ix_(rows, rows)] - weights.T @ wanted
    np.testing.assert_allclose(covariance, expected, atol=1e-10)


def test_rows_that_alone_carry_a_column_determine_it():
    "A parameter of one row is not determined without it, but every other row may go"
    design = np.zeros((6, 1, 2))
    design[:, 0, 0] = 1.0
    design[4, 0, 1] = 1.0
    noise = Noise(np.full((6, 1, 1), 1e-4))
    solved = collocate(START + np.arange(6.0), np.zeros((6, 1)), noise, design, [])
    assert [solved.determined_without([i]) for i in range(6)] == [True] * 4 + [False, True]
    assert not solved.determined_without([0, 1, 2, 3, 5])
    with pytest.raises(ValueError, match=r"Without the 1 observations.*5 do not determine"):
        solved.leave_out(np.array([4]))


def test_without_a_trend_any_row_can_go():
    "Without columns nothing must be determined, so any row can be left out"
    case = Passes(7)
    case.design = case.design[:, :, :0]
    solved = case.solve()
    assert solved.determined_without(np.arange(29))
    assert solved.trend.shape == (0,) and solved.trend_covariance.shape == (0, 0)


@pytest.mark.parametrize("columns", [3, 1])
def test_parameters_that_misclosures_do_not_determine_are_refused(columns):
    "More parameters than misclosures, or two of the same effect: named with both numbers"
    if columns == 3:
        design = np.ones((2, 1, columns))
    else:
        design = np.zeros((2, 1, 1))
    noise = Noise(np.ones((2, 1, 1)))
    with pytest.raises(ValueError, match=f"2 misclosures do not determine {columns} trend"):
        collocate(START + np.arange(2.0), np.zeros((2, 1)), noise, design, [])


class Plain:
    "A solver of V = diag: what a solver has to give, in the least words"

    def __init__(self, variance):
        self.variance = variance
        self.log_determinant = float(np.log(variance).sum())

    def whiten(self, columns):
        return columns / np.sqrt(self.variance)[:, None]

    def solve(self, columns):
        return columns / self.variance[:, None]


def test_any_solver_serves():
    "Weighted means of misclosures of different sigmas, and the density of what the mean leaves"
    variance = np.array([1.0, 4.0, 9.0, 0.25])
    misclosure = np.array([0.3, -1.0, 2.0, 0.4])
    solved = solve_trend(Plain(variance), misclosure, np.ones((4, 1)))
    mean = np.average(misclosure, weights=1.0 / variance)
    assert solved.trend == pytest.approx([mean])
    assert solved.trend_covariance[0, 0] == pytest.approx(1.0 / np.sum(1.0 / variance))
    squares = np.sum((misclosure - mean) ** 2 / variance)
    density = squares + np.log(variance).sum() + np.log(np.sum(1.0 / variance))
    assert solved.log_likelihood == pytest.approx(-0.5 * (density + 3 * np.log(2 * np.pi)))


def believing_rows(seed, p=2, n=7):
    "(rows, sigma): SparseRows of targets that share errors, and one sigma (p,) of each coefficient"
    rng = np.random.default_rng(seed)
    time = START + np.sort(rng.uniform(0.0, 100.0, n))
    drift = Signal(0.1 * rng.normal(size=(n, 3, 3)), Covariance("matern32", 30.0), time - START)
    design = rng.normal(size=(n, 3, p))
    misclosure = rng.normal(0.0, 0.3, (n, 3))
    rows = SparseRows(time[:, None], misclosure, noise_of(seed, n), design, [drift])
    return rows, rng.uniform(0.05, 0.3, p)


@pytest.mark.parametrize("seed", range(3))
def test_what_is_believed_of_the_trend_is_a_part_of_the_covariance(seed):
    "Likelihood, coefficients and left-out misclosures are those of V + A S A^T without any trend"
    rows, sigma = believing_rows(seed)
    solved = collocate_rows_dense([rows], np.eye(len(sigma), len(sigma) + 1) / sigma[:, None])
    (drift,), n = rows.signals, rows.misclosure.size
    time = np.repeat(drift.clock, 3)
    mixing = drift.mixing.reshape(n, 3)
    total = (mixing @ mixing.T) * drift.covariance(time[:, None] - time) + rows.noise.matrix
    spread = rows.design.reshape(n, -1) * sigma
    total += spread @ spread.T
    misclosure = rows.misclosure.ravel()
    density = multivariate_normal(np.zeros(n), total).logpdf(misclosure)
    assert solved.log_likelihood == pytest.approx(density, abs=1e-7)
    weights = np.linalg.solve(total, misclosure)
    np.testing.assert_allclose(solved.trend, sigma * (spread.T @ weights), atol=1e-5)  # m
    residual, covariance = solved.leave_out(np.arange(3, 6))
    block = np.linalg.inv(np.linalg.inv(total)[3:6, 3:6])
    np.testing.assert_allclose(covariance, block, rtol=1e-3, atol=1e-9)
    np.testing.assert_allclose(residual, block @ weights[3:6], atol=1e-4)  # m
    assert solved.sigma0 == pytest.approx(np.sqrt(misclosure @ weights / n), rel=1e-3)


def test_a_trend_of_any_size_is_that_of_least_squares():
    "Believed within 100 km they are those of Eq. 13 to 1e-6 m; within 1 nm there is no trend"
    rows, _ = believing_rows(7)
    free = collocate_rows_dense([rows], None).trend
    unit = np.eye(2, 3)
    np.testing.assert_allclose(collocate_rows_dense([rows], unit / 1e5).trend, free, atol=1e-6)
    assert np.abs(collocate_rows_dense([rows], unit * 1e9).trend).max() < 1e-9  # m


def test_a_value_that_is_believed_is_an_observation_of_its_own():
    "Within 1 nm of 0.1 and -0.2 m the trend is these, and what is left is explained without it"
    rows, _ = believing_rows(7)
    value = np.array([0.1, -0.2])
    solved = collocate_rows_dense([rows], 1e9 * np.column_stack([np.eye(2), value]))
    np.testing.assert_allclose(solved.trend, value, atol=1e-9)  # m
    less = rows.misclosure - rows.design @ value
    less = replace(rows, misclosure=less, design=rows.design[..., :0])
    np.testing.assert_allclose(solved.weights, collocate_rows_dense([less]).weights, atol=1e-3)


def test_a_part_of_the_trend_may_be_believed():
    "Of more coefficients than misclosures some must be"
    rows, _ = believing_rows(8, p=22)
    assert np.isfinite(collocate_rows_dense([rows], np.eye(2, 23)).trend).all()
    with pytest.raises(ValueError, match="21 misclosures do not determine 22 trend"):
        collocate_rows_dense([rows], None)
