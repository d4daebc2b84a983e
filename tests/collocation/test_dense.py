import numpy as np
import pytest
from scipy.stats import chi2
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import ConstantKernel, Matern

from mlscorr.collocation import (
    FAMILIES,
    INTEGRATED,
    Covariance,
    Noise,
    Signal,
    SparseRows,
    collocate_rows_dense,
    covariance_given,
)
from tests.collocation.dense import collocate_correlated
from tests.collocation.linked_rows import Street

START = 413_200.0  # s of week
SPAN = 200.0  # s


def legendre(gps_time, order):
    return np.polynomial.legendre.legvander(2 * (gps_time - START) / SPAN - 1, order)


class Case:
    "A random design: 3 axes at n epochs, two signals of 2 and 3 processes, correlated noise"

    def __init__(self, seed, epochs=12, order=2, asked=9):
        rng = np.random.default_rng(seed)
        family, other = rng.choice(FAMILIES, 2)
        self.covariances = Covariance(family, 40.0), Covariance(other, 8.0)
        self.gps_time = START + np.repeat(np.sort(rng.uniform(0, SPAN, epochs)), 3)
        rows = len(self.gps_time)
        self.design = legendre(self.gps_time, order) * rng.normal(size=(rows, 1))
        self.mixing = rng.normal(size=(rows, 2)), 0.3 * rng.normal(size=(rows, 3))
        root = 0.1 * rng.normal(size=(rows, rows)) / np.sqrt(rows)
        self.noise = root @ root.T + 1e-4 * np.eye(rows)
        self.asked = START + rng.uniform(-20, SPAN + 20, asked)
        self.asked_design = rng.normal(size=(asked, 4, order + 1))
        self.asked_mixing = rng.normal(size=(asked, 4, 2)), rng.normal(size=(asked, 4, 3))
        self.rng = rng
        self.misclosure = rng.normal(size=rows)

    @property
    def signals(self):
        return [Signal(m, c) for m, c in zip(self.mixing, self.covariances, strict=True)]

    def solve(self):
        return collocate_correlated(
            self.gps_time, self.misclosure, self.noise, self.design, self.signals
        )

    def joint(self):
        "Covariance of all signals at observations and asked epochs, both ways written as B D B^T"
        time = np.concatenate([self.gps_time, np.repeat(self.asked, 4)])
        total = np.zeros((len(time), len(time)))
        for observed, asked, covariance in zip(
            self.mixing, self.asked_mixing, self.covariances, strict=True
        ):
            mixing = np.vstack([observed, asked.reshape(-1, asked.shape[2])])
            for process in mixing.T:  # one diagonal B for each process
                spread = np.diag(process)
                total += spread @ covariance(time[:, None] - time) @ spread.T
        return total


@pytest.mark.parametrize("seed", range(20))
def test_equals_the_textbook_with_explicit_inverses(seed):
    "Trend, signal and their covariances equal Eq. 13-15 written out with inverses, to 1e-9"
    case = Case(seed)
    solved = case.solve()
    joint = case.joint()
    m = len(case.gps_time)
    a = case.design
    b = case.asked_design.reshape(-1, case.design.shape[1])
    weight = np.linalg.inv(joint[:m, :m] + case.noise)
    cofactor = np.linalg.inv(a.T @ weight @ a)
    trend = cofactor @ a.T @ weight @ case.misclosure  # Eq. 13
    cross = joint[m:, :m]
    expected = b @ trend + cross @ weight @ (case.misclosure - a @ trend)  # Eq. 15
    left = b - cross @ weight @ a
    error = joint[m:, m:] - cross @ weight @ cross.T + left @ cofactor @ left.T
    mean, covariance = solved.predict(case.asked, case.asked_design, case.asked_mixing)
    assert np.abs(solved.trend - trend).max() < 1e-9
    assert np.abs(solved.trend_covariance - cofactor).max() < 1e-9
    assert np.abs(mean.ravel() - expected).max() < 1e-9
    for i, block in enumerate(covariance):
        rows = slice(4 * i, 4 * i + 4)
        assert np.abs(block - error[rows, rows]).max() < 1e-9
    residual = case.misclosure - a @ trend
    assert solved.sigma0**2 == pytest.approx(residual @ weight @ residual / (m - a.shape[1]))


@pytest.mark.parametrize("seed", range(10))
def test_likelihood_is_that_of_contrasts_free_of_the_trend(seed):
    "The restricted likelihood is the Gaussian density of contrasts K^T l with K^T A = 0"
    case = Case(seed)
    m, p = case.design.shape
    contrasts = np.linalg.qr(case.design, mode="complete")[0][:, p:]
    covariance = contrasts.T @ (case.joint()[:m, :m] + case.noise) @ contrasts
    values = contrasts.T @ case.misclosure
    density = values @ np.linalg.solve(covariance, values) + np.linalg.slogdet(covariance)[1]
    density = -0.5 * (density + (m - p) * np.log(2 * np.pi))
    # Any orthonormal contrasts give it up to the volume of the design
    density -= 0.5 * np.linalg.slogdet(case.design.T @ case.design)[1]
    assert case.solve().log_likelihood == pytest.approx(density, abs=1e-6)


@pytest.mark.parametrize(
    ("family", "nu"), [("exponential", 0.5), ("matern32", 1.5), ("matern52", 2.5)]
)
def test_equals_gaussian_process_regression_without_a_trend(family, nu):
    "Without trend, prediction, sigma and likelihood are scikit-learn's, to 1e-8"
    rng = np.random.default_rng(1)
    time = np.sort(rng.uniform(0, SPAN, 30))
    values = 0.3 * rng.normal(size=30)
    asked = rng.uniform(-30, SPAN + 30, 50)
    kernel = ConstantKernel(0.04, "fixed") * Matern(25.0, "fixed", nu)
    process = GaussianProcessRegressor(kernel, alpha=1e-4, optimizer=None)
    process.fit(time[:, None], values)
    expected, sigma = process.predict(asked[:, None], return_std=True)
    signal = Signal(np.full((30, 1), 0.2), Covariance(family, 25.0))
    solved = collocate_correlated(
        START + time, values, 1e-4 * np.eye(30), np.zeros((30, 0)), [signal]
    )
    asked_mixing = [np.full((50, 1, 1), 0.2)]
    mean, covariance = solved.predict(START + asked, np.zeros((50, 1, 0)), asked_mixing)
    assert np.abs(mean[:, 0] - expected).max() < 1e-8
    assert np.abs(np.sqrt(covariance[:, 0, 0]) - sigma).max() < 1e-8
    assert solved.log_likelihood == pytest.approx(process.log_marginal_likelihood_value_)


@pytest.mark.parametrize("family", [*FAMILIES, INTEGRATED])
def test_rows_of_two_epochs_equal_the_textbook(family):
    "Control and ties: pose, its sigma, weights and likelihood are those by inverses, to 1e-6"
    street = Street(family, 40.0)
    solved = collocate_rows_dense(street.rows)
    mean, sigma, weights, likelihood = street.predicted()
    here, spread = street.predict(solved)
    assert np.abs(here - mean).max() < 1e-6  # m, rad
    assert np.abs(spread - sigma).max() < 1e-6  # m, rad
    np.testing.assert_allclose(solved.weights, weights, rtol=1e-6, atol=1e-6 * abs(weights).max())
    assert solved.log_likelihood == pytest.approx(likelihood, abs=1e-6)


@pytest.mark.parametrize("seed", range(5))
def test_what_observations_leave_of_others_together_equals_the_textbook(seed):
    "The whole covariance of what is asked, every row with every other, by inverses to 1e-9"
    case = Case(seed)
    joint = case.joint()
    m = len(case.gps_time)
    q = 4 * len(case.asked)
    a = case.design
    b = case.asked_design.reshape(q, -1)
    weight = np.linalg.inv(joint[:m, :m] + 1e-4 * np.eye(m))
    cross = joint[m:, :m]
    left = b - cross @ weight @ a
    error = joint[m:, m:] - cross @ weight @ cross.T
    error += left @ np.linalg.inv(a.T @ weight @ a) @ left.T

    def rows(times, design, mixings):
        "Single rows, whose noise is 1 cm"
        n = len(times)
        pairs = zip(mixings, case.covariances, strict=True)
        signals = [Signal(mixing.reshape(n, 1, -1), covariance) for mixing, covariance in pairs]
        noise = Noise(np.full((n, 1, 1), 1e-4))
        return SparseRows(times[:, None], np.zeros((n, 1)), noise, design[:, None], signals)

    observed = rows(case.gps_time, a, case.mixing)
    asked = rows(np.repeat(case.asked, 4), b, case.asked_mixing)
    assert np.abs(covariance_given([observed], [asked]) - error).max() < 1e-9


@pytest.mark.parametrize("order", range(6))
def test_a_polynomial_is_recovered_whatever_the_signal(order):
    "Misclosures that are a polynomial are explained by the trend alone, at all epochs to 1e-9 m"
    rng = np.random.default_rng(order)
    gps_time = START + np.linspace(0, SPAN, 12)
    asked = START + rng.uniform(0, SPAN, 100)
    truth = rng.normal(size=order + 1)
    signal = Signal(np.full((12, 1), 0.5), Covariance("matern32", 40.0))
    design = legendre(gps_time, order)
    solved = collocate_correlated(gps_time, design @ truth, 1e-6 * np.eye(12), design, [signal])
    mean, _ = solved.predict(asked, legendre(asked, order)[:, None], [np.full((100, 1, 1), 0.5)])
    assert np.abs(solved.trend - truth).max() < 1e-9  # m
    assert np.abs(mean[:, 0] - legendre(asked, order) @ truth).max() < 1e-9  # m


def test_observations_without_noise_are_predicted_back():
    "As the noise falls to 1 um the prediction at the observations becomes the observations"
    case = Case(3, order=0)
    for sigma, worst in ((1e-2, 0.1), (1e-4, 1e-5), (1e-6, 1e-8)):
        solved = collocate_correlated(
            case.gps_time[::3],
            case.misclosure[::3],
            sigma**2 * np.eye(12),
            case.design[::3],
            [Signal(np.full((12, 1), 0.5), Covariance("exponential", 30.0))],
        )
        mean, covariance = solved.predict(
            case.gps_time[::3], case.design[::3, None], [np.full((12, 1, 1), 0.5)]
        )
        assert np.abs(mean[:, 0] - case.misclosure[::3]).max() < worst
        assert np.sqrt(covariance).max() < 1.01 * sigma


@pytest.mark.long
@pytest.mark.parametrize("family", FAMILIES)
def test_stated_covariances_are_those_of_the_errors(family):
    """With the correct model the normalized prediction errors are chi-squared.

    The signals are drawn from the model itself: this tests algebra, not realism. 300 surveys,
    each with 4 x 5 predicted values; the mean statistic within 0.6 of 4 (eight standard
    deviations of independent draws: those of one survey are correlated).
    """
    statistics = []
    covariance = Covariance(family, 40.0)
    for seed in range(300):
        case = Case(seed, asked=5)
        case.covariances = covariance, Covariance("exponential", 8.0)
        m = len(case.gps_time)
        joint = case.joint()
        joint[:m, :m] += case.noise
        values, vectors = np.linalg.eigh(joint)
        drawn = vectors @ (np.sqrt(np.maximum(values, 0)) * case.rng.normal(size=len(joint)))
        truth = case.rng.normal(size=case.design.shape[1])
        case.misclosure = case.design @ truth + drawn[:m]
        mean, error = case.solve().predict(case.asked, case.asked_design, case.asked_mixing)
        wrong = mean - case.asked_design @ truth - drawn[m:].reshape(mean.shape)
        statistics += [w @ np.linalg.solve(e, w) for w, e in zip(wrong, error, strict=True)]
    assert np.mean(statistics) == pytest.approx(4.0, abs=8 * np.sqrt(2 * 4 / len(statistics)))
    inside = np.mean(np.array(statistics) < chi2.ppf(0.95, 4))
    assert 0.93 < inside < 0.97


@pytest.mark.parametrize("seed", range(10))
def test_leave_out_equals_leaving_out(seed):
    "Residual and covariance of three rows are those of a solution without them"
    case = Case(seed)
    rows = np.sort(case.rng.choice(len(case.gps_time), 3, replace=False))
    residual, covariance = case.solve().leave_out(rows)
    kept = np.setdiff1d(np.arange(len(case.gps_time)), rows)
    joint = case.joint()[: len(case.gps_time), : len(case.gps_time)] + case.noise
    weight = np.linalg.inv(joint[np.ix_(kept, kept)])
    a = case.design[kept]
    b = case.design[rows]
    cross = joint[np.ix_(rows, kept)]
    cofactor = np.linalg.inv(a.T @ weight @ a)
    trend = cofactor @ a.T @ weight @ case.misclosure[kept]
    expected = case.misclosure[rows] - b @ trend
    expected -= cross @ weight @ (case.misclosure[kept] - a @ trend)
    left = b - cross @ weight @ a
    error = joint[np.ix_(rows, rows)] - cross @ weight @ cross.T + left @ cofactor @ left.T
    assert residual == pytest.approx(expected, abs=1e-8)
    assert covariance == pytest.approx(error, abs=1e-8)


def test_rows_that_carry_the_trend_cannot_be_left_out():
    "A trend that needs an observation is not predicted without it: refused, with the numbers"
    gps_time = START + np.array([0.0, 0.0, 100.0])
    design = np.array([[1, 0], [1, 0], [1, 1.0]])
    solved = collocate_correlated(gps_time, np.zeros(3), 1e-4 * np.eye(3), design, [])
    assert [solved.determined_without([row]) for row in range(3)] == [True, True, False]
    with pytest.raises(ValueError, match=r"Without the 1 observations.*2 do not"):
        solved.leave_out([2])


def test_origin_of_time_and_order_of_observations_do_not_matter():
    "A day later, shuffled: the same trend, likelihood and predictions to 1e-7"
    case = Case(4)
    day = 86_400.0
    solved = case.solve()
    mean, covariance = solved.predict(case.asked, case.asked_design, case.asked_mixing)
    order = case.rng.permutation(len(case.gps_time))
    case.mixing = [mixing[order] for mixing in case.mixing]
    again = collocate_correlated(
        case.gps_time[order] + day,
        case.misclosure[order],
        case.noise[np.ix_(order, order)],
        case.design[order],
        case.signals,
    )
    there, spread = again.predict(case.asked + day, case.asked_design, case.asked_mixing)
    assert again.trend == pytest.approx(solved.trend, abs=1e-7)
    assert again.log_likelihood == pytest.approx(solved.log_likelihood, abs=1e-7)
    assert np.abs(there - mean).max() < 1e-7
    assert np.abs(spread - covariance).max() < 1e-7


def test_prediction_in_parts_equals_the_whole():
    "The prediction does not depend on the number of epochs predicted at once"
    case = Case(5, asked=50)
    solved = case.solve()
    whole = solved.predict(case.asked, case.asked_design, case.asked_mixing)
    one = [
        solved.predict(case.asked[i], case.asked_design[i], [m[i] for m in case.asked_mixing])
        for i in np.arange(50)[:, None]
    ]
    for together, single in zip(whole, zip(*one, strict=True), strict=True):
        assert np.abs(together - np.concatenate(single)).max() < 1e-12


def test_a_trend_without_enough_observations_is_refused():
    "Three observations at two epochs do not determine a parabola"
    gps_time = START + np.array([0.0, 100.0, 100.0])
    with pytest.raises(ValueError, match="3 misclosures do not determine 3 trend parameters"):
        collocate_correlated(gps_time, np.zeros(3), 1e-4 * np.eye(3), legendre(gps_time, 2), [])


def test_contradicting_observations_without_noise_are_refused():
    "Two observations of one epoch and no noise have no joint density: refused, saying why"
    gps_time = START + np.array([0.0, 50.0, 50.0])
    one = np.ones((3, 1))
    signal = Signal(one, Covariance("matern32", 30.0))
    with pytest.raises(ValueError, match="not positive definite: two observations at one time"):
        collocate_correlated(gps_time, np.zeros(3), np.zeros((3, 3)), one, [signal])
