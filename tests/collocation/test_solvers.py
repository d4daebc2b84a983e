"""Each fast solver gives what the dense formula gives, whatever rows and signals it is given.

The dense formula itself is compared with the textbook in test_dense. Here stand all solvers and
all cases: a new solver, or a case that went wrong, is a line in a table.
"""

from dataclasses import dataclass

import numpy as np
import pytest

from mlscorr.collocation import (
    FAMILIES,
    INTEGRATED,
    Covariance,
    Noise,
    Signal,
    SparseRows,
    collocate_by_knots,
    collocate_rows,
    collocate_rows_dense,
    leave_each_out,
)
from mlscorr.collocation.markov import MarkovSolver
from tests.collocation.linked_rows import Street
from tests.collocation.random_survey import RandomSurvey

START = 413_200.0  # s of week
ALL_FAMILIES = (*FAMILIES, INTEGRATED)


@dataclass(frozen=True)
class Solver:
    "Solver with its tolerance against the dense formula, for signals of 1 m"

    solve: callable
    mean: float  # m
    sigma: float  # of itself
    weights: float  # sigmas of an observation
    likelihood: float
    left_out: float  # of itself


def by_recursion(rows, prior_rows=None):
    "Rows of one epoch each, and a few of two, filtered forward and backward in time"
    solved = collocate_rows(rows, prior_rows=prior_rows)
    assert isinstance(solved.solver, MarkovSolver)
    return solved


def by_knots(rows, prior_rows=None):
    "Rows of any epochs, in information form between knots"
    return collocate_by_knots(rows, prior_rows=prior_rows)


SOLVERS = {
    "recursion": Solver(by_recursion, 1e-9, 1e-8, 1e-7, 1e-8, 1e-7),
    "recursion of places": Solver(by_recursion, 1e-8, 1e-7, 1e-6, 1e-6, 1e-6),
    "knots": Solver(by_knots, 1e-5, 0.01, 0.01, 0.01, 1e-3),
}


@dataclass(frozen=True)
class Case:
    "Rows, what is asked (times, design, mixings, clocks), what is believed of the trend"

    rows: list
    asked: tuple
    prior_rows: np.ndarray | None = None


def random_survey(seed, families=None):
    "Three signals, errors that passes share, targets at one time and a millisecond apart"
    survey = RandomSurvey(seed, families)
    return Case([survey.rows], (survey.asked, survey.asked_design, survey.asked_mixing))


def single_epoch():
    "The first epoch of a random survey alone: none comes before or after it"
    survey = RandomSurvey(2, p=1)
    alone = SparseRows(
        survey.gps_time[:1, None],
        survey.misclosure[:1],
        survey.noise.select([0]),
        survey.design[:1],
        [Signal(signal.mixing[:1], signal.covariance) for signal in survey.signals],
    )
    return Case([alone], (survey.asked, survey.asked_design, survey.asked_mixing))


def restarted(seed):
    "A drift that starts anew twice, on a clock of its own, beside a steady one"
    rng = np.random.default_rng(seed)
    unit = np.eye(3)
    restarts = START + np.array([100.0, 180.0])

    def signals(times):
        number = np.searchsorted(restarts, times, side="right")
        since = np.maximum(times - np.append(START - 1.0, restarts)[number], 0.1)
        grown = (0.01 * since**1.5)[:, None, None] * unit
        steady = np.tile(0.1 * unit, (len(times), 1, 1))
        return [
            Signal(grown, Covariance(INTEGRATED, 1.0), np.log(since) + 1000.0 * number),
            Signal(steady, Covariance("matern32", 30.0)),
        ]

    gps_time = START + rng.uniform(0.0, 300.0, 30)
    noise = Noise(np.tile(1e-4 * unit, (30, 1, 1)))
    given = rng.normal(size=(30, 3)), noise, np.tile(unit, (30, 1, 1)), signals(gps_time)
    at = START + np.linspace(-5.0, 310.0, 150)
    there = signals(at)
    asked = at, np.tile(unit, (150, 1, 1)), [s.mixing for s in there], [s.clock for s in there]
    return Case([SparseRows(gps_time[:, None], *given)], asked)


def one_process(family):
    "A scalar signal of one process, which solvers take a shorter way for"
    rng = np.random.default_rng(3)
    unit = np.ones((9, 1, 1))
    signal = Signal(0.3 * unit, Covariance(family, 11.0))
    gps_time = START + 4.0 * np.arange(9)[:, None]
    rows = SparseRows(gps_time, rng.normal(size=(9, 1)), Noise(0.01 * unit), unit, [signal])
    asked = START + np.linspace(-5.0, 40.0, 31), np.ones((31, 1, 1)), [np.full((31, 1, 1), 0.3)]
    return Case([rows], asked)


def believed_trend(seed):
    "A random survey, of whose trend the sigma of two coefficients is believed"
    case = random_survey(seed)
    return Case(case.rows, case.asked, np.diag([1 / 0.2, 1 / 0.05, 0.0, 0.0])[:2])


def steps(family):
    "Control, and three steps of the path, each seen from before and after it"
    street = Street(family, 60.0, seed=2, targets=20)
    part = street.rows[0]
    rng = np.random.default_rng(5)
    before = START + np.array([40.0, 110.0, 220.0])
    gps_time = np.column_stack([before, before + 0.1])
    position = np.eye(3, 6)
    sides = np.tile([position, -position], (3, 1, 1))
    noise = Noise(np.tile(1e-4 * np.eye(3), (3, 1, 1)))
    design = np.zeros((3, *part.design.shape[1:]))
    signals = street.signals(gps_time.ravel(), sides)
    step = SparseRows(gps_time, 0.3 * rng.normal(size=(3, 3)), noise, design, signals)
    return Case([part, step], street.asked_rows)


def control(family):
    "Control of a street that is driven twice: passes of a target share its survey error"
    street = Street(family, 60.0, seed=2, targets=20)
    return Case(street.rows[:1], street.asked_rows)


def ties(family, time):
    "Control, and ties between both passes"
    street = Street(family, time)
    return Case(street.rows, street.asked_rows)


def close_ties(family):
    "Ties of two moments between the same knots, 0.1 ms to 50 ms apart"
    street = Street(family, 60.0, seed=4)
    apart = np.geomspace(1e-4, 0.05, street.ties)
    street.tie_time[:, 1] = street.tie_time[:, 0] + apart
    street.draw_misclosures()
    return Case(street.rows, street.asked_rows)


OF_ONE_EPOCH = {
    **{f"random {family}": lambda f=family: random_survey(1, (f,) * 3) for family in FAMILIES},
    **{f"random mix {seed}": lambda s=seed: random_survey(s) for seed in range(3, 12)},
    "a single epoch": single_epoch,
    **{f"one process {family}": lambda f=family: one_process(f) for family in FAMILIES},
    **{f"believed trend {seed}": lambda s=seed: believed_trend(s) for seed in range(3)},
    **{f"control {family}": lambda f=family: control(f) for family in ALL_FAMILIES},
}
# misclosures 100 sigmas off what the signals explain, which knots follow to centimetres
CONTRADICTED = {f"restarted {seed}": lambda s=seed: restarted(s) for seed in range(3)}
LINKED = {
    **{
        f"ties {family} {time:g} s": lambda f=family, t=time: ties(f, t)
        for family in ALL_FAMILIES
        for time in (5.0, 60.0, 600.0)
    },
    **{f"close ties {family}": lambda f=family: close_ties(f) for family in ALL_FAMILIES},
}
STEPPED = {f"steps {family}": lambda f=family: steps(f) for family in ALL_FAMILIES}
TABLE = [(solver, name) for solver in ("recursion", "knots") for name in OF_ONE_EPOCH]
TABLE += [("recursion", name) for name in CONTRADICTED]
TABLE += [("knots", name) for name in LINKED]
TABLE += [("recursion of places", name) for name in STEPPED]


@pytest.mark.parametrize(("solver", "name"), TABLE)
def test_a_solver_gives_what_the_dense_formula_gives(solver, name):
    "Trend, likelihood, weights, prediction and its covariance, and misclosures left out"
    case = (OF_ONE_EPOCH | CONTRADICTED | LINKED | STEPPED)[name]()
    solver = SOLVERS[solver]
    solved = solver.solve(case.rows, case.prior_rows)
    expected = collocate_rows_dense(case.rows, case.prior_rows)
    assert solved.log_likelihood == pytest.approx(
        expected.log_likelihood, rel=solver.likelihood / 10, abs=solver.likelihood
    )
    assert solved.sigma0 == pytest.approx(expected.sigma0, rel=solver.likelihood, nan_ok=True)
    near = {"rtol": solver.mean, "atol": solver.mean}
    np.testing.assert_allclose(solved.trend, expected.trend, **near)
    spread = np.sqrt(np.diag(expected.trend_covariance))
    np.testing.assert_allclose(np.sqrt(np.diag(solved.trend_covariance)), spread, rtol=solver.sigma)
    noise = np.sqrt(np.concatenate([np.einsum("nii->ni", r.noise.own).ravel() for r in case.rows]))
    assert np.abs((solved.weights - expected.weights) * noise).max() < solver.weights
    mean, covariance = solved.predict(*case.asked)
    there, other = expected.predict(*case.asked)
    np.testing.assert_allclose(mean, there, **near)
    np.testing.assert_array_equal(solved.predict_mean(*case.asked), mean)
    sigmas = np.sqrt(np.einsum("qii->qi", other))
    np.testing.assert_allclose(
        np.sqrt(np.einsum("qii->qi", covariance)), sigmas, rtol=solver.sigma, atol=1e-9
    )
    scale = sigmas[:, :, None] * sigmas[:, None]
    assert (np.abs(covariance - other) <= 2 * solver.sigma * scale + 1e-12).all()
    size = len(solved.weights)
    for rows in ([0], [0, 1, 2], list(range(size // 2, size // 2 + 12))):
        if max(rows) >= size:
            continue
        assert solved.determined_without(rows) == expected.determined_without(rows)
        if expected.determined_without(rows):
            residual, uncertainty = solved.leave_out(rows)
            true_residual, true_uncertainty = expected.leave_out(rows)
            np.testing.assert_allclose(
                residual, true_residual, rtol=solver.left_out, atol=solver.mean
            )
            np.testing.assert_allclose(
                uncertainty,
                true_uncertainty,
                atol=solver.left_out * np.diag(true_uncertainty).max(),
            )


@pytest.mark.parametrize("family", ALL_FAMILIES)
def test_each_observation_left_out_in_turn_is_left_out_by_itself(family):
    "Of control and of ties, residual and variance are those that the dense formula leaves"
    case = ties(family, 60.0)
    each = leave_each_out(collocate_by_knots(case.rows))
    expected = collocate_rows_dense(case.rows)
    first = 0
    for part, left_out in zip(case.rows, each, strict=True):
        n, r = part.misclosure.shape
        for i in (0, n // 2, n - 1):
            rows = np.arange(first + i * r, first + (i + 1) * r)
            residual, covariance = expected.leave_out(rows)
            np.testing.assert_allclose(left_out.residual[i], residual, rtol=1e-3, atol=1e-5)  # m
            np.testing.assert_allclose(
                left_out.covariance[i], covariance, atol=1e-3 * np.diag(covariance).max()
            )
        first += n * r


def test_a_step_of_zero_in_least_squares_is_an_observation():
    "Without signals, two places and no step between them: the fit of three rows of one noise"
    design = np.array([[1.0, 0.0], [1.0, 9.0], [0.0, 9.0]])  # of a shift and a slope
    misclosure = np.array([0.4, 0.8, 0.0])  # m
    rows = [
        SparseRows(np.array([times]), np.array([[row]]), Noise(np.full((1, 1, 1), 1e-4)), a, ())
        for times, row, a in zip(
            ([0.0], [9.0], [0.0, 9.0]), misclosure, design[:, None, None], strict=True
        )
    ]
    expected = np.linalg.lstsq(design, misclosure)[0]
    np.testing.assert_allclose(collocate_rows(rows).trend, expected, atol=1e-6)  # m
