"""Fall-backs of a filtered POS stand in its recorded path."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from mlscorr.frames import attitude_from_angles
from mlscorr.pos import find_steps
from mlscorr.survey import Trajectory

# s, m
START = 413200.0
CORNER = np.array([528000.0, 3379000.0, 20.0])


def city_drive(rate=10.0, seconds=300.0):
    "Times, and a path at UTM size with turns and braking of a car in town"
    time = np.arange(0.0, seconds, 1 / rate)
    heading = 0.8 * np.sin(time / 15.0)
    speed = 8.0 + 5.0 * np.sin(time / 11.0)
    way = speed[:, None] * np.column_stack([np.sin(heading), np.cos(heading), 0.02 * heading])
    return time, CORNER + np.cumsum(way, axis=0) / rate


def outage(time, begin=100.0, end=160.0, size=(1.2, -0.8, 0.4)):
    "An error that grows from nothing and is gone when GNSS is back"
    share = np.where((time >= begin) & (time < end), (time - begin) / (end - begin), 0.0)
    return share[:, None] ** 1.5 * size


def recorded(time, path):
    return Trajectory(START + time, path, Rotation.identity(len(time)))


@pytest.mark.parametrize("rate", [5.0, 10.0, 50.0, 200.0])
def test_a_fall_back_is_found_with_its_time_and_size(rate):
    "One step of 1.5 m at the end of an outage, to 3 cm, at any rate of the trajectory"
    time, path = city_drive(rate)
    steps = find_steps(recorded(time, path - outage(time)))
    assert len(steps) == 1
    assert steps.before[0] < START + 160.0 <= steps.after[0] + 1e-6
    assert steps.size[0] == pytest.approx([1.2, -0.8, 0.4], abs=0.03)  # m


def test_a_fall_back_over_some_epochs_is_one_step():
    "A filter that takes 0.2 s to fall back at 50 Hz makes one step of the whole size"
    time, path = city_drive(50.0)
    error = outage(time)
    late = (time >= 160.0) & (time < 160.2)
    error[late] = np.outer(1 - (time[late] - 160.0) / 0.2, [1.2, -0.8, 0.4])
    steps = find_steps(recorded(time, path - error))
    assert len(steps) == 1
    assert steps.size[0] == pytest.approx([1.2, -0.8, 0.4], abs=0.1)  # m


@pytest.mark.parametrize("seed", range(5))
def test_nothing_else_is_a_step(seed):
    "Turns, braking, noise of 5 mm and GNSS updates of 2 cm each second are none"
    time, path = city_drive(10.0)
    rng = np.random.default_rng(seed)
    updates = np.repeat(rng.normal(0.0, 0.02, (300, 3)), 10, axis=0)
    assert len(find_steps(recorded(time, path + updates))) == 0
    assert len(find_steps(recorded(time, path + rng.normal(0.0, 0.005, path.shape)))) == 0


def test_a_car_that_stands_longer_than_it_drives_makes_no_steps():
    "After 400 s at rest, 300 s of starting, stopping and turning at 1 Hz show no fall-back but one"
    time = np.arange(0.0, 700.0, 0.1)
    driven = np.maximum(time - 400.0, 0.0)
    speed = 6.0 - 6.0 * np.cos(driven / 3.0)
    heading = 0.8 * np.sin(driven / 5.0)
    way = speed[:, None] * np.column_stack([np.sin(heading), np.cos(heading), 0.0 * heading])
    path = CORNER + np.cumsum(way, axis=0) / 10.0
    assert len(find_steps(recorded(time[::10], path[::10]))) == 0
    steps = find_steps(recorded(time[::10], (path - 3.0 * outage(time, 500.0, 560.0))[::10]))
    assert steps.after - START == pytest.approx([560.0])  # s
    assert steps.size[0] == pytest.approx([3.6, -2.4, 1.2], abs=0.7)  # m


def test_time_stamps_that_jitter_make_no_steps():
    "10 ms of jitter in the time stamps is no fall-back"
    time, path = city_drive(10.0)
    late = time + np.random.default_rng(1).uniform(-0.01, 0.01, len(time))
    assert len(find_steps(recorded(late, path))) == 0


def test_passes_are_looked_at_apart():
    "Motion of a vehicle in a gap of the trajectory is no step"
    time, path = city_drive(10.0)
    apart = np.where(time > 150.0, time + 500.0, time)
    assert len(find_steps(recorded(apart, path + np.where(time > 150.0, 300.0, 0.0)[:, None]))) == 0


@pytest.mark.parametrize("rate", [1.0, 2.0, 10.0])
def test_braking_and_turning_is_no_step_at_any_rate(rate):
    "Each minute from 10 to 5 m/s in 4 s, a quarter turn in 6 s, and on: jerks of 1.5 m/s^3"
    fine = np.arange(0.0, 400.0, 0.005)
    within = fine % 60.0
    speed = 10.0 - 5.0 * np.clip(np.minimum((within - 15.0) / 4.0, (31.0 - within) / 4.0), 0.0, 1.0)
    turning = np.clip((within - 20.0) / 6.0, 0.0, 1.0)
    heading = np.pi / 2 * (fine // 60.0 + turning - np.sin(2 * np.pi * turning) / (2 * np.pi))
    way = speed[:, None] * np.column_stack([np.sin(heading), np.cos(heading), 0.0 * heading])
    every = slice(None, None, round(200.0 / rate))
    path = CORNER + 0.005 * np.cumsum(way, axis=0)
    assert len(find_steps(recorded(fine[every], path[every]))) == 0


@pytest.mark.parametrize("rate", [1.0, 5.0, 10.0, 100.0, 200.0])
def test_a_brisk_corner_is_no_step(rate):
    "A quarter turn of 10 m radius at 8 m/s: the vehicle turns with its way, drives on, and no step"
    fine = np.arange(0.0, 60.0, 1e-3)
    curvature = np.where(np.abs(fine - 30.0) < 10.0 * np.pi / 32, 0.1, 0.0)  # 1/m
    curvature = gaussian_filter1d(curvature, 250)  # over 2 m
    heading = np.cumsum(8.0 * curvature) * 1e-3
    path = np.cumsum(8.0 * np.column_stack([np.sin(heading), np.cos(heading), 0 * heading]), axis=0)
    rows = slice(0, None, round(1000 / rate))
    attitude = attitude_from_angles(0.0, 0.0, heading[rows])
    driven = CORNER + path[rows] * 1e-3
    assert len(find_steps(Trajectory(START + fine[rows], driven, attitude))) == 0
    if rate > 1.0:
        driven[fine[rows] > 45.0] += [0.3, -0.2, 0.1]
        steps = find_steps(Trajectory(START + fine[rows], driven, attitude))
        assert steps.size == pytest.approx(np.array([[0.3, -0.2, 0.1]]), abs=0.02)  # m


def test_a_drone_that_turns_on_its_way_makes_no_steps():
    "5 m/s straight on, turning by 90 deg/s about up: nothing but the way counts there"
    time = np.arange(0.0, 60.0, 0.1)
    path = CORNER + np.outer(time, [3.0, 4.0, 0.0])
    turning = attitude_from_angles(0.0, 0.0, np.radians(90.0) * np.clip(time - 20.0, 0.0, 8.0))
    assert len(find_steps(Trajectory(START + time, path, turning))) == 0


@pytest.mark.parametrize("row", [1, 2, -2, -1])
def test_a_step_in_the_outermost_epochs_is_no_half_step_beside_them(row):
    "A step at the first or last epoch of a pass is not separable from one next to it"
    path = CORNER + np.outer(np.arange(600) * 0.1, [0.0, 10.0, 0.0])
    path[row:] += [1.5, 0.0, 0.0]
    trajectory = Trajectory(START + np.arange(600) * 0.1, path, Rotation.identity(600))
    assert not np.any(find_steps(trajectory).size[:, 0] < 0.75)  # m
