"""Nouns of arrays, without a file."""

import warnings

import numpy as np
import pytest

from mlscorr.frames import angles_from_attitude
from mlscorr.survey import ControlPoints, Mounting, PointCloud, Survey, Trajectory

PLACE = np.array([532_000.25, 3_374_000.5, 42.125])  # m, UTM
START = 413_200.0  # s of the GPS week


def drive(n=20):
    "Five meters a second to the north-east"
    time = START + np.arange(n) / 10
    place = PLACE + np.outer(np.arange(n) / 2, [0.5, 0.5, 0.0])
    return Trajectory.from_arrays(time, place, np.tile([1.0, -2.0, 45.0], (n, 1)))


def test_angles_are_those_of_trajectory_csv():
    "Degrees of roll, pitch and heading come back within 1e-12 rad"
    roll, pitch, heading = angles_from_attitude(drive().attitude)
    assert np.allclose(np.degrees([roll[0], pitch[0], heading[0]]), [1.0, -2.0, 45.0], atol=1e-10)


def test_sigmas_may_be_stated_once():
    "One sigma for all epochs is that of each, angles in rad inside"
    path = drive()
    angles = np.tile([0.0, 0.0, 90.0], (len(path), 1))
    stated = Trajectory.from_arrays(
        path.gps_time, path.position, angles, [0.02, 0.02, 0.03], [0.01, 0.01, 0.02]
    )
    assert np.allclose(stated.position_sigma, [0.02, 0.02, 0.03])
    assert np.allclose(stated.attitude_sigma, np.radians([0.01, 0.01, 0.02]))
    frame = stated.to_frame()
    assert np.allclose(frame["sigma_heading"], 0.02) and np.allclose(frame["heading"], 90.0)


@pytest.mark.parametrize(
    ("attitude", "words"),
    [(np.zeros((3, 3)), "give \\(20, 3\\)"), (np.full((20, 3), np.nan), "20 of 20")],
)
def test_attitudes_that_are_none_are_refused(attitude, words):
    "Other shapes and numbers that are not finite"
    path = drive()
    with pytest.raises(ValueError, match=words):
        Trajectory.from_arrays(path.gps_time, path.position, attitude)


def test_a_mounting_is_that_of_survey_toml():
    "Rz(c) Ry(b) Rx(a): 90 degrees about X turn the beam's Y up"
    mounting = Mounting.from_angles([0.1, -0.6, 0.4], [90.0, 0.0, 0.0])
    assert np.allclose(mounting.boresight.apply([0.0, 1.0, 0.0]), [0.0, 0.0, 1.0])
    with pytest.raises(ValueError, match="boresight must be three finite numbers"):
        Mounting.from_angles([0.1, -0.6, 0.4], [90.0, 0.0])


def test_points_share_what_is_stated_once():
    "One kind, size and sigma for all; normals are unknown"
    points = ControlPoints.from_arrays(["A", "B"], [PLACE, PLACE + 5], 0.003, "circle", 0.6)
    assert points.kind == ("circle", "circle") and points.size.tolist() == [0.6, 0.6]
    assert np.isnan(points.normal).all() and points.sigma.shape == (2, 3)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"name": ["A", "A"]}, "names occur twice"),
        ({"kind": "disc"}, "kind = 'disc' is"),
        ({"size": [0.6, np.nan]}, "1 of 2 surveyed points"),
        ({"position": [PLACE]}, "different numbers of rows"),
    ],
)
def test_points_that_are_none_are_refused(changed, words):
    "Names that stand twice, unknown kinds, sizes that are no numbers, unlike lengths"
    given = {"name": ["A", "B"], "position": [PLACE, PLACE], "sigma": 0.003}
    given |= {"kind": "circle", "size": 0.6}
    with pytest.raises(ValueError, match=words):
        ControlPoints.from_arrays(**given | changed)


@pytest.mark.parametrize(
    ("xyz", "time", "words"),
    [
        (np.zeros((4, 2)), np.zeros(4), "\\(4, 2\\)"),
        (np.zeros((4, 3)), np.zeros(3), "xyz 4, gps_time 3"),
        (np.full((4, 3), np.nan), np.zeros(4), "4 of 4 points have coordinates"),
        (np.zeros((4, 3)), np.array([0, 1, np.inf, 2]), "first: point 2"),
    ],
)
def test_clouds_that_are_none_are_refused(xyz, time, words):
    "Shapes, lengths and numbers, each with its count"
    with pytest.raises(ValueError, match=words):
        PointCloud.from_arrays(xyz, time)


def test_float32_at_map_size_says_what_is_lost():
    "A quarter of a meter a step at a northing of 3 374 km; nothing about an origin"
    xyz = np.tile(PLACE, (3, 1)).astype(np.float32)
    with pytest.warns(UserWarning, match="steps of 0.25 m, with errors of up to 0.125 m"):
        PointCloud.from_arrays(xyz, START + np.zeros(3))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        PointCloud.from_arrays((xyz - xyz[0]).astype(np.float32), START + np.zeros(3))


def test_a_cloud_takes_its_attributes_along():
    "Rows, joined clouds and frames have the further columns, too"
    cloud = PointCloud.from_arrays(
        np.tile(PLACE, (4, 1)), START + np.arange(4), attributes={"kind": np.arange(4)}
    )
    assert cloud[cloud.gps_time > START + 1].attributes["kind"].tolist() == [2, 3]
    assert PointCloud.concatenate([cloud, cloud]).attributes["kind"].tolist() == [*range(4)] * 2
    assert cloud.to_frame()["kind"].tolist() == [0, 1, 2, 3]
    assert cloud.plot().axes


def test_a_survey_of_arrays_has_its_points():
    "Two clouds stand for two files with names of their own"
    path = drive()
    cloud = PointCloud.from_arrays(path.position, path.gps_time)
    control = ControlPoints.from_arrays(["A"], [PLACE], 0.003, "circle", 0.6)
    survey = Survey.from_arrays([cloud, cloud], path, control, name="street")
    assert [file.name for file in survey.clouds] == ["street-1.laz", "street-2.laz"]
    assert survey.points == 2 * len(cloud) and len(survey.check) == 0
    with pytest.raises(ValueError, match="at least one point each"):
        Survey.from_arrays([cloud[[]]], path, control)


def test_a_path_has_lines_but_none_across_its_gaps():
    "A pause of ten seconds parts the lines"
    path = drive()
    late = path.gps_time + np.where(np.arange(len(path)) < 10, 0.0, 10.0)
    parted = Trajectory(late, path.position, path.attitude)
    lines = parted.to_open3d(PLACE)
    assert len(lines.line["indices"]) == len(path) - 2
    assert np.allclose(lines.point["positions"].numpy() + PLACE, path.position, atol=1e-9)
    assert parted.plot().axes
