"""Prior sigmas of the POS: stated ones, and those of survey.toml where none are stated."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.frames import angle_sigma, attitude_from_angles, map_root
from mlscorr.pos.stated import stated_sigma
from mlscorr.survey import Pos, Trajectory

START = 413200.0  # s
ORIGIN = np.array([528000.0, 3379000.0, 20.0])  # m
POS = Pos(position_sigma=0.5, attitude_sigma=np.array([1e-4, 2e-4, 3e-4]))


def drive(sigma=None, heading=0.0):
    "100 s northwards, perhaps with one sigma (n,) for E, N and H"
    elapsed = np.arange(0.0, 100.0, 0.1)
    if sigma is None:
        sigma = None
    else:
        sigma = np.repeat(sigma(elapsed)[:, None], 3, axis=1)
    attitude = attitude_from_angles(0.0, 0.0, np.full(len(elapsed), heading))
    return Trajectory(START + elapsed, ORIGIN + elapsed[:, None] * [0, 10, 0], attitude, sigma)


def test_beliefs_stand_in_for_sigmas_that_are_not_stated():
    "Without sigma columns position and attitude have those of [pos], and all of it is drift"
    stated = stated_sigma(drive(), POS, [START + 5.0, START + 50.0])
    assert stated.position == pytest.approx(0.5)  # m
    assert stated.angles == pytest.approx(np.tile(POS.attitude_sigma, (2, 1)))
    assert stated.drift == pytest.approx(0.5) and not stated.known_gnss.any()


def test_sigma_that_grows_is_split_into_what_stays_and_what_grows():
    "2 cm all the time and 40 cm grown from 60 s on: jitter 2 cm, drift with it 40 cm by squares"
    stated = stated_sigma(drive(lambda t: 0.02 + 0.01 * np.maximum(t - 60.0, 0.0)), POS)
    assert stated.known_gnss == pytest.approx(0.02)  # m
    assert stated.drift[-1] == pytest.approx(np.sqrt(0.419**2 - 0.02**2))
    later = stated.gps_time > stated.gps_time[0] + 62.0
    whole = (stated.drift**2 + stated.known_gnss**2)[later]
    assert whole == pytest.approx(stated.position[later] ** 2)
    assert not stated.drift[0].any()


def test_constant_sigma_tells_nothing_of_when_drift_grows():
    "If sigma(t) never doubles, no part of it is attributed to GNSS"
    assert not stated_sigma(drive(lambda t: 0.02 + 0.0001 * t), POS).known_gnss.any()


def test_roll_turns_about_the_way_of_a_vehicle_that_drives_east():
    "Heading east, roll is a turn about E, pitch one about N, heading one about H; and back"
    attitude = attitude_from_angles(np.zeros(1), 0.0, np.pi / 2)
    root = map_root(attitude, np.array([[1e-4, 2e-4, 3e-4]]))
    assert root[0] == pytest.approx(np.diag([1e-4, 2e-4, 3e-4]), abs=1e-15)  # rad
    turned = Rotation.random(5, random_state=1)
    sigma = np.random.default_rng(1).uniform(1e-4, 1e-3, (5, 3))
    root = map_root(turned, sigma)
    assert angle_sigma(turned, root @ root.swapaxes(1, 2)) == pytest.approx(sigma)


def test_no_times_have_no_sigmas():
    "Asked at no time, with and without sigma columns, it answers with arrays of no rows"
    for trajectory in (drive(), drive(lambda t: np.full(len(t), 0.02))):
        stated = stated_sigma(trajectory, POS, np.empty(0))
        assert stated.position.shape == stated.drift.shape == (0, 3)
        assert stated.largest.shape == (3,)
