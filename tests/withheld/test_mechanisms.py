"""Each mechanism moves points by what its sentence says, at UTM and GPS size."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import mlscorr
from mlscorr.effects.catalogue import SYSTEMATIC
from mlscorr.frames import attitude_from_angles
from mlscorr.simulate import RecordedPoints, load_mechanisms
from mlscorr.survey import Mounting, Trajectory

FILE = Path(__file__).with_name("mechanisms.py")
MECHANISMS, UNITS, LEADS = (
    {name: parts[number] for name, parts in load_mechanisms(FILE).items()} for number in range(3)
)
START = 413200.0
PLACE = np.array([523000.0, 3378000.0, 20.0])
# m/s, rad/s to the left, m/s^2
SPEED = 8.0
TURNING = np.radians(10.0)
SLOWING = 1.0
MOUNTING = Mounting(
    np.array([0.1, -0.6, 0.4]), Rotation.from_euler("ZX", [35.0, 90.0], degrees=True)
)


def seen(heading, along, duration=20.0, n=400):
    "Points around a vehicle with a heading (rad) and a way (m) that are functions of time"
    t = np.arange(0.0, duration, 0.01)
    h = heading(t)
    s = along(t)
    step = np.diff(s, prepend=s[0])[:, None] * np.column_stack([np.sin(h), np.cos(h), 0.0 * h])
    attitude = attitude_from_angles(np.zeros_like(t), np.zeros_like(t), h)
    trajectory = Trajectory(START + t, PLACE + np.cumsum(step, axis=0), attitude)
    rng = np.random.default_rng(1)
    time = START + rng.uniform(1.0, duration - 1.0, n)
    angle = rng.uniform(-np.pi, np.pi, n)
    away = rng.uniform(3.0, 30.0, n)
    level = np.column_stack([away * np.cos(angle), away * np.sin(angle), 0.0 * away])
    pose = trajectory.at(time)
    body = MOUNTING.boresight.apply(level) + MOUNTING.lever_arm
    return RecordedPoints(
        time, pose.position + pose.attitude.apply(body), level, trajectory, MOUNTING
    )


def straight(duration=20.0, heading=0.0):
    return seen(lambda t: np.full_like(t, heading), lambda t: SPEED * t, duration)


def turning():
    return seen(lambda t: -TURNING * t, lambda t: SPEED * t)


def moved(name, points, size, seed=3):
    return MECHANISMS[name](points, size, np.random.default_rng(seed))


def arm(points):
    return points.xyz - points.trajectory.at(points.gps_time).position


def beam(points):
    pose = points.trajectory.at(points.gps_time)
    start = pose.position + pose.attitude.apply(MOUNTING.lever_arm)
    return (points.xyz - start) / np.linalg.norm(points.xyz - start, axis=1, keepdims=True)


def along(points, shift):
    "Component along the beams, after a check that there is no other"
    size = np.einsum("ni,ni->n", shift, beam(points))
    np.testing.assert_allclose(shift, size[:, None] * beam(points), atol=1e-9)
    return size


def test_lifts_by_its_size_at_eight_metres_a_second():
    "The lift at 8 m/s is the size, straight up"
    shift = moved("lift with speed", straight(), 0.02)
    np.testing.assert_allclose(shift, np.tile([0.0, 0.0, 0.02], (400, 1)), atol=1e-6)


def test_a_warm_scanner_measures_too_long_by_its_size():
    "After a minute a share of 1 - 1 / e of the size is reached, along the beam"
    points = straight(80.0)
    longer = along(points, moved("thermal range drift", points, 0.01))
    elapsed = points.gps_time - START
    minute = np.argmin(np.abs(elapsed - 60.0))
    assert longer[minute] == pytest.approx(0.01 * (1 - np.exp(-elapsed[minute] / 60)), abs=1e-9)
    assert longer[minute] == pytest.approx(0.00632, abs=1e-4)


def test_rolls_by_its_size_at_ten_degrees_a_second():
    "At 10 deg/s to the left the points turn about the forward axis by the size"
    points = turning()
    shift = moved("roll with turn rate", points, 0.1)
    forward = points.trajectory.at(points.gps_time).attitude.apply([0.0, 1.0, 0.0])
    expected = np.radians(0.1) * np.cross(forward, arm(points))
    np.testing.assert_allclose(shift, expected, atol=1e-5)
    assert np.abs(moved("roll with turn rate", straight(), 0.1)).max() < 1e-9


def test_facets_throw_beams_out_of_the_scan_plane():
    "Points move along the scanner's axis alone, at most by size times range"
    points = straight()
    shift = moved("mirror wobble", points, 0.01)
    axis = points.trajectory.at(points.gps_time).attitude.apply(
        MOUNTING.boresight.apply([0.0, 0.0, 1.0])
    )
    away = np.linalg.norm(points.scanner_xyz, axis=1)
    out = np.einsum("ni,ni->n", shift, axis) / away
    np.testing.assert_allclose(shift, (out * away)[:, None] * axis, atol=1e-9)
    assert np.abs(out).max() == pytest.approx(np.radians(0.01), rel=0.01)


def test_crosstalk_repeats_with_the_range():
    "Ranges are wrong by the size at most, and alike where the range is"
    points = straight()
    longer = along(points, moved("cyclic range", points, 0.005))
    away = np.linalg.norm(points.scanner_xyz, axis=1)
    assert np.abs(longer).max() == pytest.approx(0.005, rel=0.01)
    order = np.argsort(away)
    assert (
        np.abs(np.diff(longer[order])).max() < 0.005 * 2 * np.pi / 3.0 * np.diff(away[order]).max()
    )


def test_the_ground_sinks_about_one_place():
    "Points sink by the size at most, straight down, and far away not at all"
    points = straight(40.0)
    shift = moved("local subsidence", points, 0.03)
    assert np.abs(shift[:, :2]).max() == 0.0
    assert shift[:, 2].min() == pytest.approx(-0.03, rel=0.15)
    assert np.abs(shift[:, 2]).min() < 1e-3


def test_the_attitude_comes_late_by_its_size():
    "A recorded attitude that is late by 10 ms moves points as georeferencing with it does"
    points = turning()
    pose, late = (points.trajectory.at(points.gps_time - lag) for lag in (0.0, 0.01))
    body = pose.attitude.inv().apply(arm(points))
    expected = late.attitude.apply(body) - pose.attitude.apply(body)
    np.testing.assert_allclose(moved("attitude lag", points, 0.01), expected, atol=1e-4)


@pytest.mark.parametrize(("heading", "place"), [(0.0, [1, 0, 0]), (np.pi / 2, [0, 1, 0])])
def test_reflections_turn_with_the_car(heading, place):
    "Driving north points are off to the east, driving east to the north"
    shift = moved("heading-dependent bias", straight(heading=heading), 0.02)
    np.testing.assert_allclose(shift, np.tile(0.02 * np.array(place), (400, 1)), atol=1e-9)


def test_dives_by_its_size_at_a_metre_a_second_squared():
    "While it brakes by 1 m/s^2, points ahead go down by the size times their distance"
    points = seen(lambda t: 0.0 * t, lambda t: 15.0 * t - 0.5 * SLOWING * t**2, duration=12.0)
    shift = moved("brake dive", points, 0.1)
    ahead = arm(points)[:, 1]
    np.testing.assert_allclose(shift[:, 2], -np.radians(0.1) * ahead, atol=2e-5)
    assert np.abs(shift[:, 0]).max() < 1e-9


def test_a_tilted_window_lengthens_the_way_to_one_side():
    "By the size at 60 deg from the glass's normal, by nothing behind it, never shorter"
    points = straight()
    longer = along(points, moved("tilted window", points, 0.004))
    assert longer.min() > -1e-12
    assert longer.max() == pytest.approx(0.004, rel=0.01)
    assert (longer == 0.0).mean() == pytest.approx(0.5, abs=0.1)


@pytest.mark.parametrize("name", MECHANISMS)
def test_is_linear_in_its_size_and_the_same_each_time(name):
    "Twice the size moves twice as far, with the same draws, and nothing moves at zero"
    points = turning()
    once = moved(name, points, 0.01)
    twice = moved(name, points, 0.02)
    np.testing.assert_allclose(twice, 2 * once, atol=1e-12)
    assert not moved(name, points, 0.0).any()
    assert np.isfinite(once).all()


def test_no_library_knows_the_mechanisms():
    "Names, leads and units belong together, and no file of the package knows one of them"
    assert set(MECHANISMS) == set(LEADS) == set(UNITS)
    assert not set(MECHANISMS) & set(SYSTEMATIC)
    assert len(MECHANISMS) >= 8
    package = Path(mlscorr.__file__).parent
    told = "".join(path.read_text() for path in package.rglob("*.py"))
    assert not [name for name in MECHANISMS if MECHANISMS[name].__name__ in told]
