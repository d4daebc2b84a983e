import numpy as np
import pytest

from mlscorr.frames import attitude_from_angles
from mlscorr.survey import Pos, Trajectory
from mlscorr.targets.clusters import split_by_time
from mlscorr.targets.visits import motion_covariance, scanner_path, split_visits

ORIGIN = np.array([523_000.0, 3_378_000.0, 42.0])  # m, UTM
START = 413_200.0  # s of the GPS week


def drive(*legs):
    "Times and places of a vehicle at 20 Hz that drives legs of (duration, speed north)"
    speed = np.concatenate([np.full(int(20 * duration), v) for duration, v in legs])
    north = np.cumsum(speed) / 20
    return START + np.arange(len(speed)) / 20, ORIGIN + np.outer(north, [0.0, 1.0, 0.0])


def test_a_stop_is_one_visit():
    "Ten seconds at a standstill before a target do not part what was seen before and after"
    assert len(split_visits(*drive((2, 5), (10, 0), (2, 5)))) == 1


def test_a_turn_back_is_two_visits():
    "The second begins where the vehicle turned, to half a metre, also after a stop there"
    time, place = drive((4, 5), (3, 0), (4, -5))
    first, second = split_visits(time, place)
    assert len(first) + len(second) == len(time)
    assert np.linalg.norm(place[second[0]] - place[80]) < 0.5  # m


def test_a_pause_is_two_visits():
    "Points three seconds apart were seen at two visits, in any order of points"
    time, place = drive((4, 5))
    time[40:] += 3.0
    order = np.random.default_rng(0).permutation(len(time))
    visits = split_visits(time[order], place[order])
    assert [len(rows) for rows in visits] == [40, 40]
    assert np.all(np.diff(time[order][visits[1]]) > 0)


def test_motion_of_the_pos_error_grows_with_its_sigma_and_the_time(straight_trajectory):
    "3 mm where a POS of 0.1 m is watched for half a second; nothing in no time"
    found = motion_covariance(straight_trajectory, Pos(), [START + 10.0], [0.5])[0]
    assert np.sqrt(np.diag(found)) == pytest.approx(0.1 * np.sqrt(3) / 30 * 0.5)  # m
    assert not motion_covariance(straight_trajectory, Pos(), [START + 10.0], [0.0]).any()


@pytest.fixture
def straight_trajectory():
    time, place = drive((20, 5))
    still = attitude_from_angles(0.0, 0.0, np.zeros(len(time)))
    return Trajectory(time, place, still, np.full((len(time), 3), 0.1))


def test_the_scanner_sits_on_its_lever_arm(straight_trajectory):
    "Half a metre to the right of a drive north is half a metre east of it, between epochs too"
    time = START + np.array([3.0, 3.02])
    path = scanner_path(time, straight_trajectory, np.array([0.5, 0.0, 0.0]))
    arm = path - straight_trajectory.at(time).position
    assert arm == pytest.approx(np.tile([0.5, 0.0, 0.0], (2, 1)), abs=1e-6)  # m


def test_split_by_time():
    "Runs come in time, each in time, and a pause of just the limit does not split"
    runs = split_by_time(START + np.array([9.0, 0.0, 1.0, 3.0, 8.5]), 2.0)
    assert [run.tolist() for run in runs] == [[1, 2, 3], [4, 0]]
