import numpy as np
import pytest
from sklearn.gaussian_process.kernels import Matern

from mlscorr.collocation import FAMILIES, Covariance
from mlscorr.collocation.covariance import process_noise, transition

START = 413_200.0  # s of week
SMOOTHNESS = {"exponential": 0.5, "matern32": 1.5, "matern52": 2.5}


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("time", [0.5, 30.0, 900.0])
def test_correlation_is_that_of_an_independent_library(family, time):
    "Values equal scikit-learn's Matern kernels of the same smoothness to 1e-12"
    epochs = START + np.sort(np.random.default_rng(1).uniform(0, 600, 80))
    theirs = Matern(time, nu=SMOOTHNESS[family])((epochs - START)[:, None])
    assert np.abs(Covariance(family, time)(epochs[:, None] - epochs) - theirs).max() < 1e-12


@pytest.mark.parametrize("family", FAMILIES)
def test_correlation_is_one_at_lag_zero_and_falls(family):
    "One at lag zero, even in the lag, falling, practically zero after 30 correlation times"
    covariance = Covariance(family, 30.0)
    lag = np.linspace(0.0, 900.0, 500)
    assert covariance(0.0) == 1.0
    assert np.array_equal(covariance(lag), covariance(-lag))
    assert (np.diff(covariance(lag)) < 0).all()
    assert covariance(900.0) < 1e-11


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("seed", range(10))
def test_covariances_are_positive_definite(family, seed):
    "At random epochs no eigenvalue is negative beyond rounding, so any sigma(t) is a valid model"
    rng = np.random.default_rng(seed)
    epochs = START + rng.uniform(0, 200, 100)
    correlation = Covariance(family, 10 ** rng.uniform(-1, 3))(epochs[:, None] - epochs)
    assert np.linalg.eigvalsh(correlation)[0] > -1e-12


def test_smoother_families_move_less_in_a_short_time():
    "Over a tenth of the correlation time drift of more states has moved less"
    moved = [1.0 - Covariance(family, 30.0)(3.0) for family in FAMILIES]
    assert moved == sorted(moved, reverse=True)


def states_of(covariance, span):
    "F and Q over a span of time as matrices"
    d = covariance.states
    x = covariance.rate * span
    triangle = np.zeros((3, 3))
    triangle[np.triu_indices(3)] = process_noise(d, x)
    spread = triangle + np.triu(triangle, 1).T
    return np.reshape(transition(d, x), (3, 3))[:d, :d], spread[:d, :d]


@pytest.mark.parametrize("family", FAMILIES)
def test_states_have_the_correlation_at_any_lag(family):
    "The first state's covariance with itself a lag later is the correlation function, to 1e-14"
    covariance = Covariance(family, 30.0)
    stationary = states_of(covariance, np.inf)[1]
    for lag in (0.0, 1e-3, 1.0, 20.0, 300.0, 1e6):
        carried, spread = states_of(covariance, lag)
        assert (carried @ stationary)[0, 0] == pytest.approx(covariance(lag), abs=1e-14)
        assert np.abs(carried @ stationary @ carried.T + spread - stationary).max() < 1e-14


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("ratio", [1e-9, 1e-6, 1e-3, 0.1, 0.4, 1.0, 10.0])
def test_process_noise_is_exact_at_any_step(family, ratio):
    """Two steps spread as much as one of twice the length, to 1e-13 of each state's own.

    At 1e-9 correlation times the smoothest process spreads by 1e-44: no digit is lost to one.
    """
    covariance = Covariance(family, 30.0)
    carried, spread = states_of(covariance, ratio * 30.0)
    _, twice = states_of(covariance, ratio * 60.0)
    scale = np.sqrt(np.diag(twice))
    assert (
        np.abs(carried @ spread @ carried.T + spread - twice) < 1e-13 * np.outer(scale, scale)
    ).all()


def test_what_is_no_covariance_is_refused():
    "An unknown family and a time that is not positive are named"
    with pytest.raises(ValueError, match=r"gaussian.* exponential, matern32, matern52"):
        Covariance("gaussian", 30.0)
    for time in (0.0, -1.0, np.nan):
        with pytest.raises(ValueError, match="must be positive"):
            Covariance("exponential", time)
