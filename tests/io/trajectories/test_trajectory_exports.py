"""Trajectories out: SBET with smrmsg, and TUM."""

import numpy as np
import pytest
from pyproj import Transformer

from mlscorr.frames import attitude_from_angles
from mlscorr.io.trajectories import (
    SBET_FIELDS,
    check_exports,
    export_trajectory,
    read_trajectory,
)
from mlscorr.io.trajectories.trajectory import read_trajectory_file
from mlscorr.survey import Trajectory
from tests.io.trajectories.test_trajectory_files import CRS, assert_same
from tests.io.trajectories.test_trajectory_io import drive


@pytest.mark.parametrize("name", ["drive.sbet", "drive.out"])
def test_an_sbet_comes_back(name, tmp_path):
    "Positions to 10 um, attitudes to 1e-7 deg, and the sigmas of each epoch"
    written = drive(400)
    names = export_trajectory(tmp_path / name, written, CRS)
    assert names == [name, "smrmsg_drive.out"]
    read = read_trajectory(tmp_path / name, CRS, tmp_path / "smrmsg_drive.out")
    assert_same(read, written, metres=1e-5, degrees=1e-7)
    assert np.abs(read.position_sigma - written.position_sigma).max() < 1e-12
    assert np.abs(read.attitude_sigma - written.attitude_sigma).max() < 1e-12
    unsure = type(written)(written.gps_time, written.position, written.attitude)
    assert export_trajectory(tmp_path / "b.sbet", unsure, CRS) == ["b.sbet"]


RADIUS = 60.0  # m
SPEED = 10.0  # m/s, on the map


def on_circle(seconds):
    "Places on a circle about a place in UTM, driven clockwise, and headings along it"
    angle = SPEED / RADIUS * seconds
    circle = np.column_stack([np.sin(angle), np.cos(angle), np.zeros(len(angle))])
    return RADIUS * circle + [532_000.0, 3_374_000.0, 42.0], angle + np.pi / 2


def circle(seconds):
    "The trajectory of a drive on it, with a roll of 2 deg and a pitch of 0"
    place, heading = on_circle(seconds)
    roll = np.full(len(seconds), np.radians(2.0))
    attitude = attitude_from_angles(roll, np.zeros(len(seconds)), heading)
    return Trajectory(413200.0 + seconds, place, attitude)


def ground_velocity(seconds):
    "North, west, up of a drive on the circle by earth-centered coordinates 1 ms apart. Units: m/s"
    to_degrees = Transformer.from_crs(CRS, "EPSG:4979", always_xy=True)
    to_earth = Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True)

    def places(shift):
        east, north, height = on_circle(seconds + shift)[0].T
        longitude, latitude, _ = to_degrees.transform(east, north, height)
        earth = np.column_stack(to_earth.transform(longitude, latitude, height))
        return np.radians(longitude), np.radians(latitude), earth

    longitude, latitude, _ = places(0.0)
    way = (places(1e-3)[2] - places(-1e-3)[2]) / 2e-3
    sin, cos = np.sin, np.cos
    zero = np.zeros(len(seconds))
    north = np.column_stack(
        [-sin(latitude) * cos(longitude), -sin(latitude) * sin(longitude), cos(latitude)]
    )
    east = np.column_stack([-sin(longitude), cos(longitude), zero])
    return np.column_stack([(way * north).sum(1), -(way * east).sum(1), zero])


def record_of(path):
    "Columns of an SBET by name"
    return dict(zip(SBET_FIELDS, np.fromfile(path, "<f8").reshape(-1, 17).T, strict=True))


def vectors(record, name):
    return np.column_stack([record[f"{name}_{axis}"] for axis in "xyz"])


def test_an_sbet_has_the_motion_of_a_circle(tmp_path):
    "Velocities to 1e-3 m/s, body rates to 1e-5 rad/s, accelerations to 0.01 m/s^2"
    seconds = np.arange(0.0, 40.0, 0.05)
    export_trajectory(tmp_path / "circle.sbet", circle(seconds), CRS)
    record = record_of(tmp_path / "circle.sbet")
    assert np.abs(vectors(record, "velocity") - ground_velocity(seconds)).max() < 1e-3
    turn = SPEED / RADIUS  # rad/s, clockwise: positive about the axis that points down
    tilt = np.radians(2.0)  # the right side is down: the vertical is turned about forward
    expected = np.tile([0.0, turn * np.sin(tilt), turn * np.cos(tilt)], (len(seconds), 1))
    assert np.abs(vectors(record, "rate") - expected).max() < 1e-5
    inward = SPEED**2 / RADIUS  # m/s^2, to the right
    expected = np.tile([0.0, inward * np.cos(tilt), -inward * np.sin(tilt)], (len(seconds), 1))
    assert np.abs(vectors(record, "acceleration") - expected).max() < 0.01


def test_the_motion_of_an_sbet_crosses_no_gap(tmp_path):
    "With 10 s and 30 m of a gap velocities and rates beside it are those of the circle"
    seconds = np.r_[np.arange(0.0, 10.0, 0.05), np.arange(20.0, 30.0, 0.05)]
    whole = circle(seconds)
    apart = whole.position + np.where(seconds < 15.0, 0.0, 30.0)[:, None] * [1.0, 0.0, 0.0]
    export_trajectory(tmp_path / "gap.sbet", Trajectory(whole.gps_time, apart, whole.attitude), CRS)
    record = record_of(tmp_path / "gap.sbet")
    assert np.abs(vectors(record, "velocity") - ground_velocity(seconds)).max() < 1e-3
    assert np.ptp(record["rate_z"]) < 1e-5


def test_tum_comes_back(tmp_path):
    "Times to 1 us, positions to 10 um, quaternions of right, forward, up"
    written = drive(400)
    assert export_trajectory(tmp_path / "drive.tum", written, None) == ["drive.tum"]
    file = read_trajectory_file(tmp_path / "drive.tum")
    assert_same(file.trajectory, written, metres=6e-6, degrees=1e-6)
    assert file.layout.endswith("body axes right-forward-up.")


def test_what_can_not_be_written_is_refused_before_the_work():
    "Folders, unknown suffixes, an SBET without a CRS"
    for name in ("a/b.sbet", "drive.csv", "drive"):
        with pytest.raises(ValueError, match="give a file name without a folder"):
            check_exports([name])
    check_exports(["drive.sbet", "drive.tum"])
    check_exports(["drive.tum"], None, is_read=True)
    with pytest.raises(ValueError, match=r"drive\.out.* is geographic: set crs"):
        check_exports(["drive.out"], None, is_read=True)
