"""Angles and axes as the interface says, Eq. 1 forward and backward, and its derivatives."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mlscorr.frames import (
    angles_from_attitude,
    attitude_from_angles,
    from_polar,
    georeference,
    georeferenced_anew,
    mounting_partials,
    partials_by_scanner,
    pose_partials,
    scanner_position,
    skew,
    to_scanner,
)
from mlscorr.survey import Mounting, Trajectory
from tests.beds.drives import MOUNTING, START, drive

EAST, NORTH, UP = np.eye(3)
RIGHT, FORWARD, ABOVE = np.eye(3)


@pytest.mark.parametrize(
    ("angles", "body", "map_axis"),
    [
        ((0, 0, 0), FORWARD, NORTH),
        ((0, 0, 0), RIGHT, EAST),
        ((0, 0, 90), FORWARD, EAST),  # heading clockwise from north
        ((0, 0, 90), RIGHT, -NORTH),
        ((0, 90, 0), FORWARD, UP),  # pitch nose up
        ((90, 0, 0), RIGHT, -UP),  # roll right side down
        ((90, 0, 0), ABOVE, EAST),
    ],
)
def test_attitude_follows_the_interface(angles, body, map_axis):
    "Heading is clockwise from north, positive pitch lifts the nose, positive roll drops the right"
    assert attitude_from_angles(*np.radians(angles)).apply(body) == pytest.approx(map_axis)


def test_attitude_is_the_written_product_of_rotations():
    "R_P^G = Rz(-heading) Rx(pitch) Ry(roll)"
    rng = np.random.default_rng(1)
    for roll, pitch, heading in rng.uniform(-1.5, 1.5, (50, 3)):
        about = [("z", -heading), ("x", pitch), ("y", roll)]
        z, x, y = (Rotation.from_euler(axis, angle).as_matrix() for axis, angle in about)
        assert attitude_from_angles(roll, pitch, heading).as_matrix() == pytest.approx(z @ x @ y)


def test_places_in_range_and_angles_lie_where_a_scanner_draws_them():
    "Angles count from X towards Y and from there to Z, and the length is the range, to 1e-12 m"
    rng = np.random.default_rng(3)
    distance, angle, elevation = rng.uniform([1, -3, -1.5], [90, 3, 1.5], (100, 3)).T
    xyz = from_polar(distance, angle, elevation)
    assert np.linalg.norm(xyz, axis=1) == pytest.approx(distance, abs=1e-12)  # m
    assert np.arctan2(xyz[:, 1], xyz[:, 0]) == pytest.approx(angle, abs=1e-12)  # rad
    assert xyz[:, 2] == pytest.approx(distance * np.sin(elevation), abs=1e-12)  # m


def test_angles_survive_the_round_trip():
    "Roll, pitch and heading come back from the rotation to 1e-12 rad"
    rng = np.random.default_rng(2)
    roll = rng.uniform(-np.pi, np.pi, 1000)
    heading = rng.uniform(0, 2 * np.pi, 1000)
    pitch = rng.uniform(-1.5, 1.5, 1000)
    found = angles_from_attitude(attitude_from_angles(roll, pitch, heading))
    assert np.abs(np.subtract(found, [roll, pitch, heading])).max() < 1e-12  # rad


def test_georeferencing_is_equation_1():
    "X_G = T_G + R_P^G (R_L^P X_L + T_L^P), point by point with plain matrices, to 1e-9 m"
    trajectory = drive()
    rng = np.random.default_rng(2)
    rows = rng.integers(len(trajectory), size=50)
    scanner = rng.uniform(-80, 80, (50, 3))
    found = georeference(trajectory, MOUNTING, scanner, trajectory.gps_time[rows])
    for row, beam, point in zip(rows, scanner, found, strict=True):
        body = MOUNTING.boresight.as_matrix() @ beam + MOUNTING.lever_arm
        expected = trajectory.position[row] + trajectory.attitude[row].as_matrix() @ body
        assert np.abs(point - expected).max() < 2e-9  # m; the last bit of UTM northings is 5e-10


def test_the_inverse_returns_the_scanner_coordinates():
    "Map points go back to the scanner and return, to 1e-6 m"
    trajectory = drive()
    rng = np.random.default_rng(3)
    gps_time = START + rng.uniform(0, 19.9, 5000)
    scanner = rng.uniform(-80, 80, (5000, 3))
    xyz = georeference(trajectory, MOUNTING, scanner, gps_time)
    assert np.abs(to_scanner(trajectory, MOUNTING, xyz, gps_time) - scanner).max() < 1e-6  # m


def test_each_scanner_has_its_own_mounting():
    "Points of two scanners are georeferenced anew, and differentiated, as those of each alone"
    trajectory = drive()
    rng = np.random.default_rng(6)
    gps_time = START + rng.uniform(0, 19.9, 200)
    xyz = rng.uniform(-80, 80, (200, 3))
    xyz += trajectory.position[0]
    arm = np.array([0.2, 0.1, -0.3])  # m
    other = Mounting(arm, Rotation.from_rotvec([0.0, 0.02, 0.0]) * MOUNTING.boresight)
    recorded = [MOUNTING, other]
    mountings = [other, MOUNTING]
    scanner = rng.integers(2, size=200)
    moved = georeferenced_anew(trajectory, recorded, mountings, xyz, gps_time, scanner)
    numbered = dict(enumerate(mountings))
    partials = partials_by_scanner(mounting_partials, trajectory, numbered, xyz, gps_time, scanner)
    assert partials.shape == (200, 3, 12)
    for number in (0, 1):
        rows = scanner == number
        seen = to_scanner(trajectory, recorded[number], xyz[rows], gps_time[rows])
        alone = georeference(trajectory, mountings[number], seen, gps_time[rows])
        assert np.array_equal(moved[rows], alone)
        its = mounting_partials(trajectory, mountings[number], xyz[rows], gps_time[rows])
        columns = slice(6 * number, 6 * number + 6)
        assert np.array_equal(partials[rows][:, :, columns], its)
        assert not partials[~rows][:, :, columns].any()


def test_skew_is_the_cross_product():
    "Phi(a) b = a x b (Eq. 4)"
    a, b = np.random.default_rng(4).normal(size=(2, 100, 3))
    assert (skew(a) @ b[:, :, None])[:, :, 0] == pytest.approx(np.cross(a, b))


def test_partials_are_the_numerical_derivatives_of_equation_1():
    "A small pose change moves points as -Phi(G) says (Eq. 9); the printed Eq. 10 turns them round"
    trajectory = drive()
    rng = np.random.default_rng(5)
    small = 1e-4
    gps_time = START + rng.uniform(0, 19.9, 100)
    scanner = rng.uniform(-80, 80, (100, 3))
    xyz = georeference(trajectory, MOUNTING, scanner, gps_time)
    partials = pose_partials(trajectory, xyz, gps_time)

    def moved(change):
        turned = Rotation.from_rotvec(change[3:]) * trajectory.attitude
        there = replace(trajectory, position=trajectory.position + change[:3], attitude=turned)
        return georeference(there, MOUNTING, scanner, gps_time)

    for column, change in enumerate(small * np.eye(6)):
        numerical = (moved(change) - moved(-change)) / (2 * small)
        assert np.abs(partials[:, :, column] - numerical).max() < 2e-5  # m/m, m/rad
    printed = skew(xyz - trajectory.at(gps_time).position)  # as Eq. 10 prints it
    assert partials[:, :, 3:] == pytest.approx(-printed)


def test_a_turn_to_the_left_moves_what_is_ahead_to_the_west():
    "A turn of 1 mrad about Up carries a point 100 m north of the car 0.1 m to the west"
    trajectory = drive()
    ahead = trajectory.position[:1] + np.array([0.0, 100.0, 0.0])
    partials = pose_partials(trajectory, ahead, trajectory.gps_time[:1])
    assert partials[0] @ [0, 0, 0, 0, 0, 1e-3] == pytest.approx([-0.1, 0.0, 0.0])


def test_the_scanner_stands_where_its_own_origin_is_georeferenced():
    "Lever arm and zero beam are one place, to a nanometre"
    trajectory = drive()
    gps_time = START + np.linspace(0.1, 19.0, 50)
    origin = georeference(trajectory, MOUNTING, np.zeros((50, 3)), gps_time)
    assert np.abs(scanner_position(trajectory, MOUNTING, gps_time) - origin).max() < 1e-9  # m


# ---- drawn values

ROUNDING = 1e-8  # m: a unit in the last place of a northing is 5e-10 m
angle = st.floats(-np.pi, np.pi)
steep = st.floats(-1.5, 1.5)  # rad, of pitch: at 90 deg roll and heading are one
offset = st.floats(-100.0, 100.0)  # m


@given(roll=angle, pitch=steep, heading=st.floats(0.0, 6.28))
def test_angles_come_back(roll, pitch, heading):
    "Roll, pitch and heading of a rotation made of them are the same rotation to 1e-12 rad"
    attitude = attitude_from_angles([roll], [pitch], [heading])
    again = attitude_from_angles(*angles_from_attitude(attitude))
    assert (again * attitude.inv()).magnitude()[0] < 1e-12


@given(heading=st.floats(-1e4, 1e4))
def test_headings_lie_in_one_turn(heading):
    "Whatever turns a heading counts, it comes back between 0 and 360 degrees"
    _, _, again = angles_from_attitude(attitude_from_angles([0.0], [0.0], [heading]))
    assert 0.0 <= again[0] < 2 * np.pi + 1e-12


@settings(max_examples=50)
@given(
    place=st.tuples(st.floats(1e5, 9e5), st.floats(0.0, 1e7), st.floats(-100.0, 9000.0)),
    start=st.floats(0.0, 604_000.0),
    angles=st.tuples(angle, steep, angle),
    lever_arm=st.tuples(offset, offset, offset),
    boresight=st.tuples(angle, angle, angle),
    beam=st.tuples(offset, offset, offset),
)
def test_eq_1_is_undone_by_its_inverse(place, start, angles, lever_arm, boresight, beam):
    "A scanner point put into the map and back is itself to 1e-8 m, wherever the zone has it"
    gps_time = start + np.arange(3.0)
    attitude = attitude_from_angles(*(np.full(3, value) for value in angles))
    trajectory = Trajectory(gps_time, place + np.arange(3.0)[:, None], attitude)
    mounting = Mounting(np.array(lever_arm), Rotation.from_euler("xyz", boresight))
    at = gps_time[:1] + 0.5
    scanner = np.array([beam])
    xyz = georeference(trajectory, mounting, scanner, at)
    np.testing.assert_allclose(
        to_scanner(trajectory, mounting, xyz, at), scanner, rtol=0, atol=ROUNDING
    )
