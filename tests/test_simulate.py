import ast
import json
import tomllib
from dataclasses import replace
from pathlib import Path

import laspy
import numpy as np
import pytest

import mlscorr.simulate
from mlscorr.georeference import georeference, to_scanner
from mlscorr.simulate import DEMO, Scenario, simulate
from mlscorr.simulate.pos_error import outage_drift, pos_error
from mlscorr.simulate.scanner import scan
from mlscorr.survey import PointCloud

SHORT = replace(DEMO, duration=6.0, control=2, check=1, outages=(), canyons=())
ELAPSED = np.arange(8001) / 100.0  # s
START, END = 20.0, 60.0  # s, of an outage
LOST = (START < ELAPSED) & (ELAPSED < END)
SEEDS = range(40)


@pytest.fixture(scope="module")
def demo():
    return simulate(DEMO, np.random.default_rng(1))


@pytest.fixture(scope="module")
def short():
    return simulate(SHORT, np.random.default_rng(1))


@pytest.fixture(scope="module")
def drives():
    "Errors of many drives with an outage of 40 s and a canyon"
    scenario = Scenario(duration=80.0, outages=((START, END - START),), canyons=((2.0, 15.0),))
    return [pos_error(ELAPSED, scenario, np.random.default_rng(seed)) for seed in SEEDS]


def test_pulses_without_noise_return_the_points_they_hit():
    "Scanner, mounting and drive obey Eq. 1: the true trajectory gives the true points to 1e-6 m"
    quiet = replace(SHORT, range_noise=0.0, angle_noise=0.0)
    survey = simulate(quiet, np.random.default_rng(2))
    xyz = georeference(
        survey.true_trajectory,
        survey.mounting,
        survey.pulses.scanner_xyz,
        survey.pulses.gps_time,
    )
    assert np.abs(xyz - survey.pulses.point).max() < 1e-6  # m


def test_points_lie_on_the_triangles_they_hit(short):
    "float32 ray casting costs nothing on the plane, and 1 mm at most along a triangle's edge"
    points = short.pulses.point - np.array(SHORT.origin)
    corners = short.scene.mesh.triangles[short.pulses.triangle]
    normal = short.scene.normal[short.pulses.triangle]
    height = np.einsum("ij,ij->i", points - corners[:, 0], normal)
    assert np.abs(height).max() < 1e-6  # m
    for i in range(3):
        edge = corners[:, (i + 1) % 3] - corners[:, i]
        inward = np.cross(normal, edge / np.linalg.norm(edge, axis=1, keepdims=True))
        depth = np.einsum("ij,ij->i", points - corners[:, i], inward)
        assert depth.min() > -1e-3  # m


def test_the_range_noise_on_planes_is_as_stated(short):
    "Along the beam, measured points scatter about the planes they hit by the stated 4 mm"
    xyz = georeference(
        short.true_trajectory, short.mounting, short.pulses.scanner_xyz, short.pulses.gps_time
    )
    normal = short.scene.normal[short.pulses.triangle]
    ray = georeference(
        short.true_trajectory, short.mounting, 0 * short.pulses.scanner_xyz, short.pulses.gps_time
    )
    beam = short.pulses.point - ray
    beam /= np.linalg.norm(beam, axis=1, keepdims=True)
    incidence = np.einsum("ij,ij->i", beam, normal)
    steep = np.abs(incidence) > 0.5
    off_plane = np.einsum("ij,ij->i", xyz - short.pulses.point, normal)[steep] / incidence[steep]
    assert off_plane.std() == pytest.approx(SHORT.range_noise, rel=0.03)
    assert abs(off_plane.mean()) < 1e-4  # m


def test_the_same_seed_gives_the_same_survey_and_another_seed_does_not(short):
    "Every number of a survey follows from its seed"
    again = simulate(SHORT, np.random.default_rng(1))
    other = simulate(SHORT, np.random.default_rng(2))
    np.testing.assert_array_equal(again.cloud.xyz, short.cloud.xyz)
    np.testing.assert_array_equal(again.cloud.intensity, short.cloud.intensity)
    np.testing.assert_array_equal(again.targets.position, short.targets.position)
    assert len(other.cloud) != len(short.cloud)


def test_stages_do_not_disturb_each_other(short):
    "Losing GNSS changes what the POS records and nothing else"
    lost = simulate(replace(SHORT, outages=((1.0, 4.0),)), np.random.default_rng(1))
    np.testing.assert_array_equal(lost.pulses.range, short.pulses.range)
    np.testing.assert_array_equal(lost.targets.position, short.targets.position)
    np.testing.assert_array_equal(lost.true_trajectory.position, short.true_trajectory.position)
    assert np.abs(lost.trajectory.position - short.trajectory.position).max() > 0.005  # m


def test_blocks_of_any_size_give_the_same_pulses(short):
    "Memory is one block of pulses, and its size leaves no trace"
    setting = short.scene, np.array(SHORT.origin), short.true_trajectory, short.mounting, SHORT
    whole = scan(*setting, np.random.default_rng(4))
    blocks = scan(*setting, np.random.default_rng(4), block=31_000)
    np.testing.assert_array_equal(blocks.gps_time, whole.gps_time)
    np.testing.assert_array_equal(blocks.range, whole.range)
    np.testing.assert_array_equal(blocks.intensity, whole.intensity)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_every_target_is_seen_on_its_bright_part(seed):
    "The coarse demo leaves 40 points on every target; denser scenarios leave more"
    survey = simulate(DEMO, np.random.default_rng(seed))
    bright = survey.scene.mesh.reflectance[survey.pulses.triangle] > 0.8
    counts = np.bincount(survey.target[bright], minlength=DEMO.control + DEMO.check)
    assert counts.min() >= 40
    assert set(survey.scene.targets.support) == {"post", "wall", "road"}


def test_targets_stand_out_by_intensity(demo):
    "A disc is several times brighter than its own board, and the mean of its points its centre"
    bright = demo.scene.mesh.reflectance[demo.pulses.triangle] > 0.8
    for i, kind in enumerate(demo.targets.kind):
        on_target = demo.target == i
        if kind == "circle":
            disc = np.median(demo.cloud.intensity[on_target & bright])
            board = np.median(demo.cloud.intensity[on_target & ~bright])
            assert disc > 5 * board
        centroid = demo.pulses.point[on_target & bright].mean(axis=0)
        assert np.linalg.norm(centroid - demo.true_centre[i]) < 0.08  # m


def test_intensity_falls_with_range(demo):
    "The same paint returns less from afar"
    bright = demo.scene.mesh.reflectance[demo.pulses.triangle] > 0.8
    near, far = demo.pulses.range < 4.0, demo.pulses.range > 5.5
    intensity = demo.pulses.intensity
    assert np.median(intensity[bright & near]) > np.median(intensity[bright & far])


def test_an_outage_drifts_by_decimetres_to_metres_and_comes_back(drives):
    "Without GNSS for 40 s the position drifts by 0.3 to 4 m; 1 s later it holds to centimetres"
    size = np.array([np.linalg.norm(drive.position, axis=1) for drive in drives])
    largest = size[:, LOST].max(axis=1)
    assert 0.3 < np.median(largest) < 4.0  # m
    assert largest.min() > 0.1  # m
    after = END + 1.0 < ELAPSED
    assert np.sqrt((size[:, after] ** 2).mean()) < 0.03  # m
    assert size[:, after].max() < 0.10  # m


def test_drift_starts_and_ends_at_nothing():
    "The smoother ties the inertial solution to the fixes on both sides of an outage"
    elapsed = np.arange(1, 2500) / 100.0
    drift, variance = outage_drift(elapsed, 25.0, 0.01, np.random.default_rng(3))
    assert np.abs(drift[[0, -1]]).max() < 0.005  # m
    assert np.abs(np.diff(drift, axis=0)).max() < 0.005  # m in 0.01 s: smooth
    assert variance[1250].max() > 0.1  # m^2


def test_the_reported_sigmas_are_honest_within_a_factor_of_two(drives):
    "Over many drives, error by reported sigma is 1 within a factor of 2, in and out of outages"
    position = np.array([drive.position / drive.position_sigma for drive in drives])
    attitude = np.array([drive.attitude / drive.attitude_sigma for drive in drives])
    for ratio in (position[:, LOST], position[:, ~LOST], attitude):
        rms = np.sqrt((ratio**2).mean(axis=(0, 1)))
        assert (rms > 0.5).all()
        assert (rms < 2.0).all()


def test_the_demo_shows_a_drift_worth_correcting(demo):
    "The demo's outage of 25 s leaves at least half a metre in the recorded cloud"
    moved = np.linalg.norm(demo.cloud.xyz - demo.pulses.point, axis=1)
    assert moved.max() > 0.5  # m
    assert 0.5e6 < len(demo.cloud) < 2e6


def test_the_survey_folder_is_whole_and_as_promised(short, tmp_path):
    "survey.toml, cloud, trajectory, control and truth stand as the readers expect them"
    short.write(tmp_path)
    names = {"survey.toml", "pass-1.laz", "trajectory.csv", "control.csv"}
    assert {p.name for p in tmp_path.iterdir()} == names | {"truth.npz", "truth.json"}
    settings = tomllib.loads((tmp_path / "survey.toml").read_text())
    assert set(settings) == {
        *("name", "crs", "cloud", "trajectory", "mounting", "control", "scanner", "pos"),
    }
    assert settings["mounting"] == {"lever_arm": [0.1, -0.6, 0.4], "boresight": [90.0, 0.0, 35.0]}
    assert settings["cloud"] == {"files": ["pass-1.laz"], "gps_time": "week"}
    assert set(settings["scanner"]) == {"range_noise", "angle_noise", "lines_per_second"}
    assert set(settings["pos"]) == {"position_sigma", "attitude_sigma", "correlation_time"}
    header = (tmp_path / "trajectory.csv").read_text().splitlines()[0]
    assert header.startswith("gps_time,easting,northing,height,roll,pitch,heading,sigma_easting")
    rows = (tmp_path / "control.csv").read_text().splitlines()
    assert rows[0] == (
        "name,easting,northing,height,sigma_horizontal,sigma_vertical,kind,size,role"
    )
    assert [row.split(",")[-1] for row in rows[1:]] == ["control", "check", "control"]
    assert json.loads((tmp_path / "truth.json").read_text())["effect"] == "none"


def test_the_written_cloud_keeps_frames_and_signs(short, tmp_path):
    "Back in the scanner frame, written points lie in the scan plane, at the LAS scan angle"
    short.write(tmp_path)
    las = laspy.read(tmp_path / "pass-1.laz")
    assert las.header.point_format.id == 6
    assert las.header.parse_crs().to_epsg() == 32650
    assert las.header.global_encoding.gps_time_type == laspy.header.GpsTimeType.WEEK_TIME
    np.testing.assert_array_equal(las.gps_time, short.pulses.gps_time)
    xyz = to_scanner(short.trajectory, short.mounting, las.xyz, np.array(las.gps_time))
    assert np.sqrt((xyz[:, 2] ** 2).mean()) < 0.0004  # m, the rounding to 1 mm
    angle = np.degrees(np.arctan2(xyz[:, 1], xyz[:, 0]))
    difference = np.mod(angle - np.array(las.scan_angle) * 0.006 + 180.0, 360.0) - 180.0
    assert np.sqrt((difference**2).mean()) < 0.006  # deg
    truth = np.load(tmp_path / "truth.npz")
    error = (
        georeference(short.true_trajectory, short.mounting, xyz, np.array(las.gps_time))
        - truth["point_xyz"]
    )
    assert np.sqrt((error**2).mean()) < 0.004  # m: range noise, in file order


def test_the_same_seed_writes_the_same_bytes(short, tmp_path):
    "A survey can be made again, bit for bit, on another day"
    short.write(tmp_path / "a")
    simulate(SHORT, np.random.default_rng(1)).write(tmp_path / "b")
    for path in (tmp_path / "a").iterdir():
        assert path.read_bytes() == (tmp_path / "b" / path.name).read_bytes(), path.name


def test_a_cloud_that_is_not_finite_is_refused(tmp_path):
    "A NaN must never become the coordinate -2147483.648 in a file"
    from mlscorr.io.las_writer import write_cloud

    xyz = np.array([[532_000.0, 3_374_000.0, 42.0], [np.nan, 3_374_000.0, 42.0]])
    cloud = PointCloud(xyz, np.array([357_700.0, 357_700.1]), np.zeros(2, np.uint16))
    with pytest.raises(ValueError, match="1 of 2 points"):
        write_cloud(tmp_path / "cloud.laz", cloud)
    assert not list(tmp_path.iterdir())


def test_an_outage_beyond_the_drive_is_refused():
    "A scenario that contradicts itself names the value and the limit"
    with pytest.raises(ValueError, match=r"outages of 30 s from 50 s.*drive of 60"):
        Scenario(outages=((50, 30),))


def test_the_simulator_does_not_know_the_estimators_model():
    "Drift is never drawn from the covariance family that the estimator assumes"
    for path in Path(mlscorr.simulate.__file__).parent.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom):
                names = [f"{node.module}.{a.name}" for a in node.names]
            for name in names:
                assert "covariance" not in name, path.name
                assert "collocation" not in name, path.name
