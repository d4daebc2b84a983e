"""A whole cloud is searched piece by piece, whatever the chunks are."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mlscorr.frames import attitude_from_angles
from mlscorr.survey import ControlPoints, PointCloud, Survey, Trajectory
from mlscorr.targets import SETTINGS, distinct, search_targets
from mlscorr.targets.extract import _end_of, pieces

ORIGIN = np.array([532_000.0, 3_374_000.0, 42.0])  # m, UTM
START = 413_200.0  # s
SPEED = 5.0  # m/s
DISCS = (4.0, 14.0, 24.0)  # m along the drive
NONE = ControlPoints((), np.empty((0, 3)), np.empty((0, 3)), (), np.empty(0), np.empty((0, 3)))


@pytest.fixture(scope="module")
def survey():
    "A drive of 30 m to the north, 6 m beside a wall"
    time = START + np.arange(0.0, 6.0, 0.01)
    path = ORIGIN + np.outer(time - START, [0.0, SPEED, 0.0])
    still = attitude_from_angles(0.0, 0.0, np.zeros(len(time)))
    drive = Trajectory(time, path, still)
    return Survey("wall", Path("survey.toml"), None, (), drive, None, NONE, NONE)


@pytest.fixture(scope="module")
def cloud():
    "The wall, scanned line by line as it is passed, with a white disc of 0.5 m every 10 m"
    rng = np.random.default_rng(1)
    along, up = (
        g.ravel()
        for g in np.meshgrid(np.arange(0.5, 29, 0.025), np.arange(-1, 1, 0.02), indexing="ij")
    )
    white = np.zeros(len(along), bool)
    for disc in DISCS:
        white |= np.hypot(along - disc, up) < 0.25
    xyz = ORIGIN + np.column_stack([rng.normal(6.0, 0.003, len(along)), along, up])
    intensity = np.where(white, 12_000.0, 3_000.0) * rng.normal(1.0, 0.03, len(along))
    return PointCloud(xyz, START + along / SPEED + 1e-6 * (up + 1.0), intensity)


def found(chunks, survey, shapes=(("circle", 0.5),)):
    "Targets that a search of chunks finds, each once"
    rng = np.random.default_rng(3)
    results = list(search_targets(chunks, survey, shapes, rng))
    return distinct([target for _, targets in results for target in targets])


def assert_discs(targets):
    assert len(targets) == len(DISCS)
    for target, along in zip(targets, DISCS, strict=True):
        assert np.linalg.norm(target.position - ORIGIN - [6.0, along, 0.0]) < 0.005  # m
        assert target.gps_time == pytest.approx(START + along / SPEED, abs=0.02)  # s


def test_all_discs_are_found_and_nothing_else(cloud, survey):
    "Three discs to 5 mm, at the times at which the scanner passed them, in order"
    assert_discs(found([cloud], survey))


@pytest.mark.parametrize("size", [20_000, 45_000])
def test_a_disc_that_a_chunk_cuts_is_found_with_the_next(cloud, survey, size):
    "In chunks of a fifth or a half of the cloud: the same three, each once"
    chunks = [cloud[i : i + size] for i in range(0, len(cloud), size)]
    assert_discs(found(chunks, survey))


def test_chunks_pass_through_as_they_came(cloud, survey):
    "The same objects in their order, with the targets that were found so far"
    chunks = [cloud[:40_000], cloud[40_000:]]
    rng = np.random.default_rng(3)
    passed = [chunk for chunk, _ in search_targets(chunks, survey, [("circle", 0.5)], rng)]
    assert all(a is b for a, b in zip(passed, chunks, strict=True))


def test_sizes_and_kinds_need_not_be_known(cloud, survey):
    "Of all kinds and any size they are circles of half a metre"
    shapes = [("circle", None), ("square", None), ("checkerboard", None)]
    targets = found([cloud[: len(cloud) // 2]], survey, shapes)
    assert {target.kind for target in targets} == {"circle"}
    assert [target.size for target in targets] == pytest.approx([0.5] * len(targets), abs=0.03)


def test_points_without_a_pose_are_left_out(cloud, survey):
    "Nothing is found outside the trajectory, elsewhere the same"
    drive = survey.trajectory
    keep = (drive.gps_time < START + 1.8) | (drive.gps_time > START + 3.8)
    broken = Trajectory(drive.gps_time[keep], drive.position[keep], drive.attitude[keep])
    targets = found([cloud], replace(survey, trajectory=broken))
    assert [round(target.position[1] - ORIGIN[1]) for target in targets] == [4, 24]


def test_two_visits_are_two_pieces(cloud, survey):
    "The same disc scanned again 3 s later: a piece, and a target, for each visit"
    rows = np.abs(cloud.xyz[:, 1] - ORIGIN[1] - 4.0) < 1.0
    first = cloud[rows]
    again = replace(first, gps_time=first.gps_time + 3.0)
    both = PointCloud.concatenate([first, again])
    parts = list(pieces(both, survey))
    assert len(parts) == 2
    spans = [np.ptp(piece.gps_time) for piece, _, _ in parts]
    assert max(spans) < 1.0
    assert len(found([both], survey)) == 2


def test_a_stop_before_a_target_is_cut_in_its_middle(cloud, survey):
    "Of more points than a piece may have the middle ones stay, with their path"
    rows = np.abs(cloud.xyz[:, 1] - ORIGIN[1] - 14.0) < 0.7
    dense = PointCloud.concatenate(
        [replace(cloud[rows], gps_time=cloud.gps_time[rows] + 0.01 * k) for k in range(12)]
    )
    (piece, path, _), *_ = pieces(dense, survey)
    assert len(piece) <= SETTINGS.piece_points
    place = survey.trajectory.at(piece.gps_time).position
    np.testing.assert_allclose(path.at(piece.gps_time), place, atol=0.06)


def test_a_dark_cloud_has_no_piece(cloud, survey):
    "Nothing bright: nothing to fit"
    plain = replace(cloud, intensity=np.full(len(cloud), 3_000.0))
    assert list(pieces(plain, survey)) == [] and found([plain], survey) == []


@pytest.mark.parametrize("share", [0.1, 0.5, 1.0])
def test_little_is_carried_to_the_next_chunk(cloud, share):
    "The last half second and more of a chunk, at most a quarter of it"
    chunk = cloud[: int(share * len(cloud))]
    end = _end_of(chunk)
    assert 0 < len(end) <= SETTINGS.largest_carry * len(chunk) + 1
    assert end.gps_time.max() == chunk.gps_time.max()
    assert (np.diff(end.gps_time) >= 0).all()
