import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.frames import attitude_from_angles
from mlscorr.survey import Mounting, PointCloud, Scanner, Survey, Trajectory
from mlscorr.targets.scanner_path import split_visits
from tests.targets.test_extract import control_point

ORIGIN = np.array([523_000.0, 3_378_000.0, 42.0])  # m, UTM
START = 413_200.0  # s of the GPS week


def drive(*legs):
    "Times and places of a vehicle at 20 Hz that drives legs of (duration, speed north)"
    speed = np.concatenate([np.full(int(20 * duration), v) for duration, v in legs])
    north = np.cumsum(speed) / 20
    return START + np.arange(len(speed)) / 20, ORIGIN + np.outer(north, [0.0, 1.0, 0.0])


def survey_along(time, place, lever_arm=(0.0, 0.0, 0.0)):
    "A survey of a drive without a turn of the vehicle"
    trajectory = Trajectory(time, place, attitude_from_angles(0.0, 0.0, np.zeros(len(time))))
    mounting = Mounting(np.array(lever_arm), Rotation.identity())
    none = control_point(ORIGIN, "circle")[[]]
    return Survey("street", None, None, (), trajectory, mounting, none, none, Scanner())


def visits(time, place, seen=None):
    "Numbers of the epochs of a drive at which each visit was, by points at some epochs"
    seen = np.arange(len(time)) if seen is None else seen
    cloud = PointCloud(place[seen], time[seen], 1.0 * seen)
    parts = split_visits(cloud, survey_along(time, place))
    return [part.intensity.astype(int).tolist() for _, part in parts]


def test_a_stop_is_one_visit():
    "Ten seconds at a standstill before a target do not part what was seen before and after"
    assert len(visits(*drive((2, 5), (10, 0), (2, 5)))) == 1


def test_a_turn_back_is_two_visits():
    "The second begins where the vehicle turned, to half a metre, also after a stop there"
    time, place = drive((4, 5), (3, 0), (4, -5))
    first, second = visits(time, place)
    assert first + second == list(range(len(time)))
    assert np.linalg.norm(place[second[0]] - place[80]) < 0.5  # m


def test_a_pause_is_two_visits():
    "Points three seconds apart were seen at two visits, in any order of points"
    seen = np.r_[:40, 100:140]
    order = np.random.default_rng(0).permutation(80)
    for k in (slice(None), order):
        first, second = visits(*drive((12, 5)), seen[k])
        assert (first, second) == (list(range(40)), list(range(100, 140)))


def test_a_gap_of_the_trajectory_parts_visits():
    "Points of two segments are of two visits, and one in the gap is of none"
    time, place = drive((12, 5))
    survey = survey_along(*(np.delete(rows, np.s_[100:130], 0) for rows in (time, place)))
    seen = np.r_[90:100, 115, 130:140]
    parts = split_visits(PointCloud(place[seen], time[seen], 1.0 * seen), survey)
    assert [(segment, len(part)) for segment, part in parts] == [(0, 10), (1, 10)]
    assert parts[1][1].intensity[0] == 130


def test_a_turn_before_the_first_point_parts_nothing():
    "Points after a turn are one visit; a single point is one, and no points are none"
    time, place = drive((4, 5), (4, -5))
    for seen in (np.arange(81, 160), np.array([159])):
        assert visits(time, place, seen) == [seen.tolist()]
    assert visits(time, place, np.empty(0, int)) == []
