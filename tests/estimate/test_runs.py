"""Neighbours that deviate together tell of drift; a lone one of a blunder."""

import numpy as np
import pytest

from mlscorr.estimate.runs import DriftWindow, with_windows
from tests.beds.pos_errors import EPOCHS, START, Case, even, outage, rms

WINDOW = DriftWindow(START + 50.0, START + 90.0, 0.4, False, ("T05", "T06"))


def smoothed_case(seed, stated=0.02):
    "A smoothed outage of decimetres that the POS does not state"
    rng = np.random.default_rng(seed)
    error, sigma = outage(rng)
    return Case(EPOCHS, error, even(20), rng, np.full_like(sigma, stated)), error


@pytest.mark.long
@pytest.mark.parametrize("seed", [1, 2, 8])
def test_a_run_of_neighbours_is_drift(seed):
    "Five control points in an unstated outage are used, not rejected; 5 % of the error is left"
    case, error = smoothed_case(seed)
    estimate = case.estimate()
    assert not estimate.outliers
    assert rms(case.remaining(estimate)) < 0.05 * rms(error)
    assert any("drifts there by more than it states" in line for line in estimate.warnings)


@pytest.mark.long
def test_a_lone_blunder_stays_an_outlier():
    "One control point wrong by 0.4 m beside the outage is still named, and nothing else"
    case, error = smoothed_case(1)
    case.spoil(16, [0.3, 0.2, -0.3])
    estimate = case.estimate()
    assert [outlier.name for outlier in estimate.outliers] == ["T17"]
    assert rms(case.remaining(estimate)) < 0.05 * rms(error)


def test_a_window_is_held_at_its_ends():
    "Its sigma is the whole in the middle, nothing outside; open at the end it grows up to it"
    sigma = WINDOW.sigma(START + np.array([40.0, 50.0, 70.0, 90.0, 95.0]))
    assert sigma == pytest.approx([0.0, 0.0, 0.4, 0.0, 0.0])
    unheld = DriftWindow(START + 50.0, START + 90.0, 0.4, True, ("T05",))
    assert unheld.sigma(START + np.array([50.0, 90.0])) == pytest.approx([0.0, 0.4])


def test_windows_raise_what_is_stated():
    "Variances add, also where the trajectory states nothing at all"
    case, _ = smoothed_case(1, 0.03)
    raised = with_windows(case.recorded, (WINDOW,)).position_sigma
    middle = np.searchsorted(EPOCHS, 70.0)
    assert raised[middle] == pytest.approx(np.hypot(0.03, 0.4))  # m
    assert raised[0] == pytest.approx(0.03)
