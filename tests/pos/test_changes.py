"""Stated sigma(t) free of the noise of epochs, and synchronized with the path."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.pos import find_steps, runs
from mlscorr.pos.history import quick_changes, timely_sigma
from mlscorr.survey import Trajectory

# s, m
START = 413200.0
CORNER = np.array([528000.0, 3379000.0, 20.0])
TIME = np.arange(0.0, 120.0, 0.1)
FLOATED = (TIME >= 40.0) & (TIME < 80.0)
SIGMA = np.where(FLOATED, 0.4, 0.02)  # m


def changed(size):
    "Times of the epochs before and after each change"
    return TIME[quick_changes(START + TIME, size)]


def timely(sigma, error):
    "Timely sigma (n,) by medians, of a drive to the north with an error to the east"
    path = CORNER + np.outer(TIME, [0.0, 10.0, 0.0]) + np.outer(error, [1.0, 0.0, 0.0])
    stated = np.repeat(sigma[:, None], 3, axis=1)
    driven = Trajectory(START + TIME, path, Rotation.identity(len(TIME)), stated)
    return timely_sigma(driven, find_steps(driven))[1][:, 0]


def test_a_change_at_once_lies_between_two_epochs():
    "0.4 m from 40 s to 80 s"
    assert changed(SIGMA) == pytest.approx(np.array([[39.9, 40.0], [79.9, 80.0]]))


def test_what_grows_from_nothing_and_sinks_to_it_is_no_change_at_once():
    "A hump of 2 m that doubles within 0.2 s at its ends, and growth until a fall: the fall alone"
    since = np.clip(TIME - 40.0, 0.0, 40.0)
    assert len(changed(0.02 + 5.0 * (since * (40.0 - since) / 800.0) ** 1.5)) == 0
    grown = np.where(FLOATED, 5.0 * (since / 40.0) ** 1.5, 0.0)
    assert changed(0.02 + grown) == pytest.approx(np.array([[79.9, 80.0]]))


def test_a_change_that_filters_spread_is_whole():
    "From 0.4 m to 2 cm within 0.3 s: before its first epoch and after its last"
    size = np.interp(TIME, [79.9, 80.2], [0.4, 0.02])
    assert changed(size) == pytest.approx(np.array([[79.9, 80.2]]))


@pytest.mark.parametrize("late", [-1.0, -0.5, 0.3, 1.0])
def test_sigma_changes_where_the_path_steps(late):
    "Stated up to a second off the steps of 0.7 m in the path: it changes with them"
    sigma = np.where((TIME - late >= 40.0) & (TIME - late < 80.0), 0.4, 0.02)
    assert np.abs(timely(sigma, 0.7 * FLOATED) - SIGMA).max() < 1e-9


def test_sigma_of_a_second_changes_where_the_path_steps():
    "Stated at whole seconds and linear between, as in companions of a path of 10 Hz"
    seconds = np.arange(0.5, 120.0)
    at_seconds = np.where((seconds >= 40.0) & (seconds < 80.0), 0.4, 0.02)
    sigma = timely(np.interp(TIME, seconds, at_seconds), 0.7 * FLOATED)
    assert changed(sigma).mean(axis=1) == pytest.approx([39.95, 79.95], abs=0.11)
    assert sigma[FLOATED].min() > 0.25 and sigma[~FLOATED].max() < 0.15  # m: 0.2 without steps


def test_sigma_stays_where_two_steps_are_as_near():
    "Steps 1 s before and 1.2 s after a change: nobody knows which of them it is"
    error = 0.7 * ((TIME >= 39.0) & (TIME < 41.2))
    sigma = np.where(TIME >= 40.0, 0.4, 0.02)
    assert np.abs(timely(sigma, error) - sigma).max() < 1e-9


def test_the_noise_of_epochs_is_no_change():
    "Sigmas that vary by 15 % from epoch to epoch: as many changes, where they are"
    noise = np.exp(0.15 * np.random.default_rng(1).normal(size=len(TIME)))
    sigma = timely(SIGMA * noise, 0.7 * FLOATED)
    assert changed(sigma).mean(axis=1) == pytest.approx([39.95, 79.95], abs=0.11)
    assert np.std(sigma[FLOATED]) < 0.5 * np.std((SIGMA * noise)[FLOATED])


def test_a_session_of_another_rate_keeps_its_outage():
    "40 s of growth at 1 Hz are no noise of epochs, though a session of 200 Hz is beside it"
    seconds = np.arange(1000.0, 1120.0)
    time = START + np.concatenate([np.arange(0.0, 60.0, 0.005), seconds])
    since = np.clip(seconds - 1040.0, 0.0, 40.0) * (seconds < 1080.0)
    sigma = np.full((len(time), 3), 0.02)
    sigma[-len(seconds) :] += 0.5 * (since[:, None] / 40.0) ** 1.5  # m
    session = np.repeat([0, 1], [len(time) - len(seconds), len(seconds)])
    path = CORNER + np.outer(time - START, [0.0, 10.0, 0.0])
    driven = Trajectory(time, path, Rotation.identity(len(time)), sigma, session=session)
    assert timely_sigma(driven, find_steps(driven))[1] == pytest.approx(sigma)


def test_runs_are_parted_at_cuts_within_them():
    "Rows 2 to 4 and 6; a cut at 3 parts the first run, at 6 and 0 none"
    flags = np.array([False, False, True, True, True, False, True])
    assert runs(flags) == [(2, 5), (6, 7)]
    assert runs(flags, np.array([0, 3, 6])) == [(2, 3), (3, 5), (6, 7)]
