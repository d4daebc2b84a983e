"""Error model of a POS along a drive, in the form that all rooms use."""

import pickle

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.pos import HUMP, RISE, PosErrors, drift_history, excursion_profile, stated_processes
from mlscorr.survey import Pos, Trajectory

START = 413_200.0  # s of week
TIME = START + np.arange(0.0, 60.0, 0.1)
PATH = np.array([532_000.0, 3_374_000.0, 40.0]) + np.outer(TIME - START, [5.0, 0.0, 0.0])


@pytest.fixture
def trajectory():
    "A straight drive whose POS states 0.1 m and 1 mrad"
    sigma = np.full((len(TIME), 3), 0.1)
    still = Rotation.identity(len(TIME))
    return Trajectory(TIME, PATH, still, sigma, 0.01 * sigma)


def test_motion_grows_with_sigma_and_time(trajectory):
    "3 mm where a POS of 0.1 m is watched for half a second; nothing in no time"
    errors = PosErrors.stated(trajectory)
    moved = errors.motion_covariance(np.array([START + 10.0] * 2), np.array([0.5, 0.0]))
    assert np.sqrt(np.diag(moved[0])) == pytest.approx(0.1 * np.sqrt(3) / 30 * 0.5)  # m
    assert not moved[1].any()


def test_a_point_far_away_errs_by_the_attitude_too(trajectory):
    "0.1 m at the vehicle; with 1 mrad at 100 m as much again"
    sigma = PosErrors.stated(trajectory).point_sigma(TIME[:2], np.array([0.0, 100.0]))
    assert sigma == pytest.approx([0.1, 0.1 * np.sqrt(2)])  # m


def test_hypotheses_hold_what_is_stated_and_ten_times_as_much(trajectory):
    "At each epoch from a tenth to ten times the stated sigma, beside 2 cm that nobody states"
    predictive = PosErrors.stated(trajectory, Pos(correlation_time=40.0)).predictive(TIME[:3])
    smallest, largest = predictive.sigma.min(axis=0), predictive.sigma.max(axis=0)
    assert smallest == pytest.approx(np.full((3, 3), np.hypot(0.01, 0.02)))  # m
    assert (largest > 1.0).all()
    assert set(predictive.correlation_time) == {40.0, 12.0}  # s
    assert predictive.rough_variance.shape == predictive.sigma.shape


def test_processes_are_a_prior():
    "Their weights sum to one, and the one of the stated size is among the likeliest"
    processes = list(stated_processes())
    assert sum(process.weight for process in processes) == pytest.approx(1.0)
    likeliest = max(processes, key=lambda process: process.weight)
    assert 0.5 < likeliest.scale < 2.0


def test_an_excursion_is_zero_outside_and_one_at_its_largest():
    "A rise ends at one, a hump has it in the middle, both begin at zero"
    at = START + np.array([9.9, 10.0, 15.0, 19.9999, 20.1])
    rise = excursion_profile(at, START + 10.0, START + 20.0, RISE)
    hump = excursion_profile(at, START + 10.0, START + 20.0, HUMP)
    assert rise == pytest.approx([0.0, 0.0, 0.5, 1.0, 0.0], abs=1e-4)
    assert hump == pytest.approx([0.0, 0.0, 1.0, 0.0, 0.0], abs=1e-4)


def test_the_history_is_worked_out_once_for_a_trajectory(trajectory):
    "Whoever asks gets the same; a copy by another process works it out anew, to the same numbers"
    history = drift_history(trajectory)
    assert PosErrors.stated(trajectory).history is history
    copied = pickle.loads(pickle.dumps(trajectory))
    assert drift_history(copied) is not history
    np.testing.assert_array_equal(drift_history(copied).starts, history.starts)
