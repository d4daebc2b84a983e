"""A pass is entered and left on a smooth way that accelerates."""

import numpy as np
import pytest

from mlscorr.frames import attitude_from_angles
from mlscorr.simulate.pos.navigation import aligned_poses
from mlscorr.survey import Trajectory

START = 413_200.0  # s
CORNER = np.array([532_000.0, 3_374_000.0, 42.0])  # m
TIME = START + np.arange(0.0, 20.0, 0.05)
OUTSIDE = START + np.arange(-30.0, 50.0, 0.05)


def drive(speed=8.0):
    "20 s to the north-east"
    heading = np.full(len(TIME), np.radians(40.0))
    way = np.outer(TIME - START, [np.sin(heading[0]), np.cos(heading[0]), 0.0]) * speed
    return Trajectory(TIME, CORNER + way, attitude_from_angles(0.0, 0.0, heading))


def test_within_the_pass_its_own_poses_are_kept():
    "At its epochs to 1 um and 1e-9 rad"
    trajectory = drive()
    position, attitude = aligned_poses(trajectory, TIME)
    np.testing.assert_allclose(position + trajectory.position[0], trajectory.position, atol=1e-6)
    assert (attitude * trajectory.attitude.inv()).magnitude().max() < 1e-9


@pytest.mark.parametrize("speed", [0.0, 3.0, 15.0])
def test_position_speed_and_attitude_meet_at_the_ends(speed):
    "No step beyond what the speed makes of 0.05 s, no jump of velocity or heading"
    position, attitude = aligned_poses(drive(speed), OUTSIDE)
    velocity = np.diff(position, axis=0) / 0.05
    assert np.abs(np.diff(velocity, axis=0)).max() < 0.05 * 5.0  # m/s: 5 m/s^2
    turn = (attitude[1:] * attitude[:-1].inv()).magnitude()
    assert turn.max() < 0.05 * np.radians(40.0)


def test_the_way_swings_in_speed_and_heading():
    "Before and after the pass the vehicle goes faster and turns, within it does neither"
    position, attitude = aligned_poses(drive(), OUTSIDE)
    speed = np.linalg.norm(np.diff(position, axis=0), axis=1) / 0.05
    heading = attitude.apply([0.0, 1.0, 0.0])
    within = (TIME[0] <= OUTSIDE) & (TIME[-1] >= OUTSIDE)
    assert np.ptp(speed[within[1:]][1:-1]) < 1e-3  # m/s
    assert np.ptp(speed[OUTSIDE[1:] < START]) > 0.5  # m/s
    turned = np.arccos(np.clip(heading @ heading[within][0], -1.0, 1.0))
    assert turned[within].max() < 1e-6 and turned[OUTSIDE < START].max() > np.radians(5.0)
    assert turned[TIME[-1] < OUTSIDE].max() > np.radians(5.0)


def test_the_vehicle_goes_where_its_nose_points():
    "On the way of the alignment velocity and nose agree to 1 deg"
    position, attitude = aligned_poses(drive(), OUTSIDE)
    course = np.diff(position, axis=0)
    course /= np.linalg.norm(course, axis=1, keepdims=True)
    nose = attitude[:-1].apply([0.0, 1.0, 0.0])
    assert np.degrees(np.arccos(np.clip(np.sum(course * nose, axis=1), -1, 1))).max() < 1.0
