"""Positions of the scanner from the trajectory, at and between its epochs."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.frames import attitude_from_angles
from mlscorr.survey import Mounting, Scanner, Survey, Trajectory
from mlscorr.targets import ScannerPath
from tests.targets.test_extract import ORIGIN, START, control_point

ARM = np.array([0.4, -0.7, 1.2])  # m
EPOCHS = START + np.arange(0.0, 60.0, 0.005)  # s


@pytest.fixture(scope="module")
def survey():
    "A drive on a circle of 50 m at 10 m/s, its scanner on a lever arm"
    turn = 0.2 * (EPOCHS - START)  # rad
    path = ORIGIN + 50.0 * np.column_stack([np.cos(turn), np.sin(turn), np.zeros(len(turn))])
    trajectory = Trajectory(EPOCHS, path, attitude_from_angles(0.01, -0.02, -turn))
    none = control_point(ORIGIN, "circle")[[]]
    mounting = Mounting(ARM, Rotation.identity())
    return Survey("street", None, None, (), trajectory, mounting, none, none, Scanner())


def test_the_path_is_that_of_the_pose_and_the_lever_arm(survey):
    "In a curve, between epochs, to a tenth of a millimetre of position + R arm (Eq. 1)"
    time = START + np.sort(np.random.default_rng(3).uniform(20.0, 24.0, 1000))
    pose = survey.trajectory.at(time)
    expected = pose.position + pose.attitude.apply(ARM)
    assert np.abs(ScannerPath.of(survey, time).at(time) - expected).max() < 1e-4  # m


@pytest.mark.parametrize("time", [EPOCHS[[0]], EPOCHS[[-1]], EPOCHS[[7]], EPOCHS[[7]] + 0.001])
def test_one_time_has_two_epochs_about_it_at_least(survey, time):
    "At the ends of the trajectory too, so that a place lies between two of them"
    path = ScannerPath.of(survey, time)
    assert len(path.gps_time) >= 2 and path.gps_time[0] <= time <= path.gps_time[-1]
    assert len(path.gps_time) <= 4


def test_from_an_origin_only_the_coordinates_differ(survey):
    "Local coordinates of a piece: the same path, moved"
    time = START + np.array([3.0, 3.5])
    path = ScannerPath.of(survey, time)
    assert path.seen_from(ORIGIN).at(time) + ORIGIN == pytest.approx(path.at(time), abs=1e-9)  # m
