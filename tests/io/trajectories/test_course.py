"""A heading beside the course over ground all along is warned of, with the number."""

import re
import warnings

import numpy as np
import pytest

import mlscorr
from mlscorr.frames import angles_from_attitude, attitude_from_angles
from mlscorr.io.trajectories import (
    TrajectorySection,
    export_trajectory,
    read_poses,
    read_trajectory,
)
from mlscorr.io.trajectories._course import check_heading, heading_and_course
from mlscorr.io.trajectories.trajectory import read_trajectory_file
from mlscorr.survey import Trajectory
from tests.beds.shared import shared
from tests.io.surveys.test_survey_file import CONTROL, TOML, write_las
from tests.io.trajectories.test_trajectory_io import csv_of, table_of

# m
CRS = "EPSG:32650"
CORNER = np.array([532_000.0, 3_374_000.0, 42.0])
WORDS = r"deviates from the course over ground by ([+-][\d.]+) deg throughout"


def drive(course, speed=9.0, crab=0.0, turned=0.0, wind=None):
    "Along courses (deg) at 20 Hz, heading into a wind (m/s towards east, north), perhaps turned"
    course = np.radians(course)
    along = np.column_stack([np.sin(course), np.cos(course), 0 * course])
    heading = course + np.radians(crab)
    if wind is not None:
        aside = wind[0] * np.cos(course) - wind[1] * np.sin(course)
        heading = course - np.arcsin(aside / speed)
    position = CORNER + np.cumsum(0.05 * speed * along, axis=0)
    attitude = attitude_from_angles(0.0, 0.0, heading + np.radians(turned))
    return Trajectory(413_200.0 + 0.05 * np.arange(len(course)), position, attitude)


ROUND = np.linspace(0.0, 360.0, 800)  # deg
STREET = np.repeat([63.0, 243.0], 300)  # deg, there and back
STRAIGHT = np.full(400, 300.0)  # deg


def offset_of(path, **read):
    "The number (deg) that reading a file warns of; None without a warning"
    with warnings.catch_warnings(record=True, action="always") as caught:
        read_trajectory(path, **read)
    found = [re.search(WORDS, str(warning.message)) for warning in caught]
    assert len(found) == len(caught) <= 1
    if found:
        return float(found[0][1])
    return None


@pytest.mark.parametrize("turned", [20.0, -8.0, 29.0])
@pytest.mark.parametrize("course", [ROUND, STREET])
def test_a_turned_heading_is_said_with_its_angle(course, turned, tmp_path):
    "20 deg beside the course there and back or all around: to 0.2 deg, in CSV and SBET"
    recorded = drive(course, turned=turned)
    said = offset_of(csv_of(tmp_path / "t.csv", table_of(recorded)))
    assert said == pytest.approx(turned, abs=0.2)
    export_trajectory(tmp_path / "t.sbet", recorded, CRS)
    assert offset_of(tmp_path / "t.sbet", crs=CRS) == pytest.approx(turned, abs=0.2)


def test_a_turned_heading_on_one_course_is_said(tmp_path):
    "20 deg on a straight drive are more than any crab; 12 deg may be the wind's"
    said = offset_of(csv_of(tmp_path / "t.csv", table_of(drive(STRAIGHT, turned=20.0))))
    assert said == pytest.approx(20.0, abs=0.2)
    assert offset_of(csv_of(tmp_path / "t.csv", table_of(drive(STRAIGHT, crab=12.0)))) is None


@pytest.mark.parametrize("speed_and_wind", [(60.0, (15.0, 5.0)), (3.0, (0.7, -0.6))])
@pytest.mark.parametrize("course", [ROUND, STREET])
def test_crab_of_aircraft_and_boats_is_no_turned_heading(course, speed_and_wind, tmp_path):
    "A wind of 16 m/s or a current of 0.9 m/s sets headings aside by 15 to 18 deg: nothing is said"
    speed, wind = speed_and_wind
    assert offset_of(csv_of(tmp_path / "t.csv", table_of(drive(course, speed, wind=wind)))) is None
    table = table_of(drive(course, speed, wind=wind, turned=0.0))
    table[:, 6] += 10.0
    said = offset_of(csv_of(tmp_path / "t.csv", table))
    assert said == pytest.approx(10.0, abs=1.0)


@pytest.mark.parametrize("backwards", [slice(0, 100), slice(100, 600)])
def test_a_vehicle_that_reverses_is_no_turned_heading(backwards, tmp_path):
    "Half a turn from the course for a sixth of the way or most of it: nothing is said"
    recorded = table_of(drive(STREET))
    recorded[backwards, 6] += 180.0
    assert offset_of(csv_of(tmp_path / "t.csv", recorded)) is None


@pytest.mark.parametrize("course", [ROUND, np.full(400, 80.0)])
def test_exchanged_axes_are_no_reversing(course, tmp_path):
    "Easting for northing turns the course about a diagonal: warned of with its median"
    table = table_of(drive(course))
    table[:, [1, 2]] = table[:, [2, 1]]
    with pytest.warns(UserWarning, match="differs from the course over ground by .* swapped"):
        read_trajectory(csv_of(tmp_path / "t.csv", table))


def test_gon_for_degrees_is_refused_by_the_course(tmp_path):
    "A heading of 270 deg that is written as 300: refused with both medians, and read with angles"
    recorded = drive(np.concatenate([STREET, ROUND]))
    table = table_of(recorded)
    table[:, 4:] = np.mod(table[:, 4:], 360.0) / 0.9
    path = csv_of(tmp_path / "t.csv", table)
    with pytest.raises(ValueError, match=r"seem to be in gon.* to 0\.\d deg as gon.*\"gon\""):
        read_trajectory(path)
    section = TrajectorySection(file="", angles="gon")
    again = read_trajectory_file(path, section=section).trajectory
    turn = (again.attitude * recorded.attitude.inv()).magnitude()
    assert np.degrees(turn).max() < 1e-6
    straight = table_of(drive(np.full(400, 210.0)))
    straight[:, 6] = np.mod(straight[:, 6], 360.0) / 0.9
    with pytest.warns(UserWarning, match=r"\+23\.3 deg.*may be gon,.*to 0\.0 deg"):
        read_trajectory(csv_of(tmp_path / "t.csv", straight))


def test_real_cars_are_not_warned_of():
    "Two real drives of cars, 19 min and 190 s; turned by 20 deg they are, to 1 deg"
    boreas = shared("data/vehicle_poses/boreas-2021-08-05-13-34_lidar_poses.csv")
    lidar = np.loadtxt(boreas, delimiter=",", skiprows=1, usecols=9)
    car = lidar + np.radians(43.17)  # by which its lidar is turned
    novatel = shared("data/vehicle_poses/novatel-enu.csv")
    yaw = np.loadtxt(novatel, delimiter=",", skiprows=1, usecols=9)
    for path, heading in ((read_poses(boreas), car), (read_poses(novatel), yaw)):
        for turned in (0.0, 20.0):
            attitude = attitude_from_angles(0.0, 0.0, heading + np.radians(turned))
            recorded = Trajectory(path.gps_time, path.position + CORNER, attitude)
            assert len(heading_and_course(*pose_of(recorded))[0]) > 5_000
            with warnings.catch_warnings(record=True, action="always") as caught:
                check_heading("car.csv", recorded)
            assert bool(caught) == bool(turned)
            if caught:
                said = float(re.search(WORDS, str(caught[0].message))[1])
                assert said == pytest.approx(turned, abs=1.0)


def pose_of(recorded):
    return recorded.gps_time, recorded.position, angles_from_attitude(recorded.attitude)[2]


def test_an_aircraft_with_its_crab_is_not_warned_of():
    "A real airborne SBET on one course heads 5.6 deg beside it"
    assert offset_of(shared("data/leeward_sbet/sbet.out"), crs="EPSG:32611") is None


def test_check_and_correct_say_it(tmp_path):
    "Both list the warning of reading the trajectory"
    (tmp_path / "survey.toml").write_text(TOML)
    (tmp_path / "control.csv").write_text(CONTROL)
    table = table_of(drive(np.full(800, 90.0), speed=5.0, turned=20.0))
    csv_of(tmp_path / "trajectory.csv", table)
    write_las(tmp_path / "pass-1.las", np.linspace(413202.0, 413215.0, 100))
    write_las(tmp_path / "pass-2.las", np.linspace(413220.0, 413235.0, 100))
    said = [text for text in mlscorr.check(tmp_path).warnings if re.search(WORDS, text)]
    assert len(said) == 1 and "+20.0 deg" in said[0]
    with pytest.warns(UserWarning, match=WORDS):
        mlscorr.read_survey(tmp_path)
