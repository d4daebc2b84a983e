"""Interpolation of misclosures in time: what it gets right, and where it is cut."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.baselines import Undetermined, fit_gaussian_process, fit_linear, fit_pchip
from mlscorr.survey import Matched, Trajectory
from tests.beds.discs import observed_discs, surveyed_discs

# s, m
START = 413200.0
CORNER = np.array([528000.0, 3379000.0, 20.0])
TIME = np.arange(0.0, 200.0, 0.1)


def drive(error):
    "A straight drive north whose recorded position lacks an error (n, 3)"
    path = CORNER + np.outer(TIME, [0.0, 10.0, 0.0])
    return Trajectory(START + TIME, path - error, Rotation.identity(len(TIME)))


def control(trajectory, error, times):
    "Targets 5 m beside the vehicle, seen without noise"
    rows = np.searchsorted(TIME, times)
    place = trajectory.position[rows] + [5.0, 0.0, 1.0]
    name = tuple(f"T{i}" for i in range(len(times)))
    observed = observed_discs(name, START + TIME[rows], place, 0.001)
    return Matched(observed, surveyed_discs(name, place + error[rows], 0.003))


def left(correction, error):
    "Largest error (m) that a correction leaves, and its RMS"
    remaining = correction.corrected.position - correction.recorded.position - error
    return np.abs(remaining).max(), np.sqrt(np.mean(remaining**2))


EVEN = np.linspace(1.0, 199.0, 12)


def test_lines_follow_a_line_exactly():
    "An error that grows at one rate is gone between the control points, to 1e-6 m"
    error = np.outer(TIME, [0.004, -0.002, 0.001])
    trajectory = drive(error)
    inside = (EVEN[0] <= TIME) & (EVEN[-1] >= TIME)
    correction = fit_linear(trajectory, control(trajectory, error, EVEN))
    remaining = correction.corrected.position - trajectory.position - error
    assert np.abs(remaining[inside]).max() < 1e-6
    assert np.abs(remaining[~inside]).max() < 0.005  # m: constants beyond the ends


def test_cubics_and_the_process_beat_lines_on_a_smooth_error():
    "On slow sines monotone cubics and the Gaussian process leave less than lines"
    error = 0.5 * np.sin(2 * np.pi * TIME[:, None] / [90.0, 120.0, 150.0])
    trajectory = drive(error)
    matched = control(trajectory, error, EVEN)
    rms = [
        left(fit(trajectory, matched), error)[1]
        for fit in (fit_linear, fit_pchip, fit_gaussian_process)
    ]
    assert rms[1] < rms[0] and rms[2] < rms[0]
    assert rms[0] < 0.05  # m


def test_cut_lines_do_not_reach_across_a_fall_back():
    "Lines cut at a re-acquisition jump of 2 m leave less than half the error of uncut lines"
    grown = np.where(TIME < 100.0, 2.0 * (np.minimum(TIME, 100.0) / 100.0) ** 1.5, 0.0)
    error = grown[:, None] * [1.0, 0.5, -0.3]
    trajectory = drive(error)
    matched = control(trajectory, error, np.arange(6.0, 200.0, 12.0))
    whole, cut = (left(fit_linear(trajectory, matched, cut), error)[1] for cut in (False, True))
    assert cut < whole / 2


def test_nothing_to_interpolate_is_refused():
    "No control point, or too few epochs for three parameters: a sentence with the number"
    error = np.zeros((len(TIME), 3))
    trajectory = drive(error)
    with pytest.raises(Undetermined, match="control point"):
        fit_linear(trajectory, control(trajectory, error, EVEN)[[]])
    with pytest.raises(Undetermined, match="here are 2"):
        fit_gaussian_process(trajectory, control(trajectory, error, EVEN[:2]))
