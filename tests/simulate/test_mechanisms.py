"""Errors drawn from a grammar move points by what their sentence says."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.frames import attitude_from_angles
from mlscorr.simulate import Mechanism, RecordedPoints, mechanisms
from mlscorr.simulate._mechanisms import DIRECTIONS
from mlscorr.survey import Mounting, Trajectory

START = 413200.0
PLACE = np.array([523000.0, 3378000.0, 20.0])
MOUNTING = Mounting(
    np.array([0.1, -0.6, 0.4]), Rotation.from_euler("ZX", [35.0, 90.0], degrees=True)
)


@pytest.fixture(scope="module")
def seen():
    "Points around a vehicle that turns to the left at 6 deg/s and brakes by 0.2 m/s^2"
    t = np.arange(0.0, 30.0, 0.01)
    heading = -np.radians(6.0) * t
    speed = 11.0 - 0.2 * t
    step = 0.01 * speed[:, None] * np.column_stack([np.sin(heading), np.cos(heading), 0.0 * t])
    attitude = attitude_from_angles(0.01 * np.sin(t), 0.02 * np.sin(t / 3), heading)
    trajectory = Trajectory(START + t, PLACE + np.cumsum(step, axis=0), attitude)
    rng = np.random.default_rng(1)
    time = START + rng.uniform(1, 29, 300)
    angle = rng.uniform(-3, 3, 300)
    away = None
    away = rng.uniform(3.0, 30.0, 300)
    level = np.column_stack([away * np.cos(angle), away * np.sin(angle), 0.0 * away])
    pose = trajectory.at(time)
    xyz = pose.position + pose.attitude.apply(MOUNTING.boresight.apply(level) + MOUNTING.lever_arm)
    return RecordedPoints(time, xyz, level, trajectory, MOUNTING)


def moved(seen, size, *parts):
    return Mechanism(*parts)(seen, size, np.random.default_rng(3))


def test_a_range_error_lies_along_the_beam_and_grows_with_the_range(seen):
    "At 15 m it is zero, at 30 m the size, at any place"
    shift = moved(seen, 0.01, "beam", "range", "linear")
    away = np.linalg.norm(seen.scanner_xyz, axis=1)
    np.testing.assert_allclose(
        np.linalg.norm(shift, axis=1), 0.01 * np.abs(away / 15 - 1), atol=1e-9
    )
    pose = seen.trajectory.at(seen.gps_time)
    beam = seen.xyz - pose.position - pose.attitude.apply(MOUNTING.lever_arm)
    assert np.abs(np.cross(shift, beam)).max() < 1e-6


def test_a_height_error_by_time_rises_from_minus_to_plus_its_size(seen):
    "Between the 5th and the 95th percentile of the drive it goes with time alone"
    shift = moved(seen, 0.02, "height", "elapsed", "linear")
    assert not shift[:, :2].any()
    part = (seen.gps_time - START) / 30.0
    inside = (part > 0.06) & (part < 0.94)
    np.testing.assert_allclose(shift[inside, 2], 0.02 * (2 * part[inside] - 1) / 0.9, atol=1e-4)


def test_a_late_clock_moves_points_along_the_drive(seen):
    "A wave in time of a clock error: points go by speed times error, and turn with the vehicle"
    shift = moved(seen, 0.001, "clock", "scan angle", "threshold")
    size = np.linalg.norm(shift, axis=1)
    assert np.median(size[size > 0]) == pytest.approx(0.008, rel=0.3)


@pytest.mark.long
@pytest.mark.parametrize("direction", DIRECTIONS)
def test_is_linear_in_its_size_and_the_same_each_time(seen, direction):
    "Twice the size moves twice as far, in sentences of every direction"
    for one in [one for one in mechanisms()[::5] if one.direction == direction]:
        rng = [np.random.default_rng(3) for _ in range(2)]
        once, twice = (one(seen, size, r) for size, r in zip((0.01, 0.02), rng, strict=True))
        assert np.isfinite(once).all()
        np.testing.assert_allclose(twice, 2 * once, atol=1e-12)


def test_a_part_of_a_survey_moves_as_the_whole_does(seen):
    "Chunks move like the whole survey, to a nanometer"
    half = RecordedPoints(
        seen.gps_time[:100], seen.xyz[:100], seen.scanner_xyz[:100], seen.trajectory, MOUNTING
    )
    for one in mechanisms()[::37]:
        whole, part = (one(each, 0.1, np.random.default_rng(3)) for each in (seen, half))
        np.testing.assert_allclose(whole[:100], part, atol=1e-9)
