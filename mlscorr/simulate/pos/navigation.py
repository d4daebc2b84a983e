"""Free inertial navigation, aided by GNSS and odometer, and the residual error after filtering.

A wheel odometer and the assumption that a car does not slip sideways or leave the ground together
give a velocity in the body, (0, v, 0). It limits the drift without GNSS: position errors are then
proportional to distance, from errors of the wheel's radius and of the rolling direction.

Heading is observable in a GNSS/INS only under acceleration, so crews drive curves and vary the
speed before and after a survey. The alignment added to a pass does the same: speed and heading vary
smoothly, and match those of the pass at its ends.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.random import Generator
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, Slerp

from mlscorr.frames import angles_from_attitude, skew
from mlscorr.simulate.pos._gnss import RECEIVER, Fixes, gnss_fixes
from mlscorr.simulate.pos._inertial import (
    ATTITUDE,
    POSITION,
    STATES,
    VELOCITY,
    Imu,
    motion,
    propagate,
    sensor_errors,
    start_sigma,
    transitions,
)
from mlscorr.simulate.pos._kalman import Measurement, StateEstimate, kalman_filter, smooth
from mlscorr.simulate.scenario import PosScenario
from mlscorr.simulate.settings import SETTINGS
from mlscorr.survey import Trajectory


@dataclass(frozen=True)
class PosError:
    """Recorded minus true pose at n epochs, and the sigmas that the POS software reports.

    position, position_sigma (n, 3) in m: E, N, H; attitude, attitude_sigma (n, 3) in rad: roll,
    pitch, heading.
    """

    position: np.ndarray
    attitude: np.ndarray
    position_sigma: np.ndarray
    attitude_sigma: np.ndarray


@dataclass(frozen=True)
class Navigation:
    """Free inertial navigation, its estimates, and their inputs.

    Parameters
    ----------
    gps_time : (n,) array
        Epochs of the filter, including alignment before and after the pass. Units: s.
    attitude : Rotation
        True R_P^G.
    error : (n, 15) array
        True error state of the free inertial navigation.
    transition : (n - 1, 15, 15) array
        Of the error state from epoch to epoch.
    filtered, predicted : StateEstimate
        Estimates of that error state.
    fixes : Fixes
    """

    gps_time: np.ndarray
    attitude: Rotation
    error: np.ndarray
    transition: np.ndarray
    filtered: StateEstimate
    predicted: StateEstimate
    fixes: Fixes

    @cached_property
    def smoothed(self) -> StateEstimate:
        """Error state after smoothing, which takes as long as the filter."""
        return smooth(self.transition, self.filtered, self.predicted)

    def at(self, gps_time: np.ndarray, smoothed: bool = True) -> PosError:
        """Return the residual PosError at times (m,), after smoothing or after the filter only.

        Parameters
        ----------
        gps_time : (m,) array
            Units: s.
        smoothed : bool
            True for after smoothing, False for after the filter only.
        """
        estimate = self.smoothed if smoothed else self.filtered
        left = self.error - estimate.state
        attitude, attitude_sigma = angle_errors(
            self.attitude, left[:, ATTITUDE], estimate.covariance[:, ATTITUDE, ATTITUDE]
        )
        variance = np.diagonal(estimate.covariance[:, POSITION, POSITION], axis1=1, axis2=2)
        columns = (left[:, POSITION], attitude, np.sqrt(variance), attitude_sigma)
        return PosError(*(interpolate(gps_time, self.gps_time, column) for column in columns))


def navigate(
    trajectory: Trajectory,
    scenario: PosScenario,
    imu: Imu,
    rng: Generator,
    sky: np.ndarray | None = None,
    start: float | None = None,
) -> Navigation:
    """Navigate a pass with an Imu; for the parameters see pos_error.

    Parameters
    ----------
    trajectory : Trajectory
    scenario : PosScenario
    imu : Imu
    rng : Generator
    sky : (n, 2) array, optional
        Elevation below which the sky is hidden. Units: rad.
    start : float, optional
        gps_time from which outages and canyons count.
    """
    sensor_rng, gnss_rng, belief_rng, odometer_rng = rng.spawn(4)
    start = trajectory.gps_time[0] if start is None else start
    gps_time, every = filter_epochs(trajectory, scenario.gnss_rate)
    position, attitude = aligned_poses(trajectory, gps_time)
    moved = motion(gps_time[1] - gps_time[0], position, attitude)
    transition = transitions(moved)
    error = propagate(transition, *sensor_errors(imu, moved, sensor_rng))

    # GNSS fixes, with the visible sky, and the odometer.
    fix_time = gps_time[::every]
    walls = _walls(fix_time, trajectory, scenario, sky, start)
    heading = angles_from_attitude(attitude[::every])[2]
    fixes = gnss_fixes(fix_time, heading, walls, gnss_rng)
    lost = _inside(fix_time, trajectory, scenario.outages, start)
    fixes = replace(fixes, valid=fixes.valid & ~lost)
    velocity = np.gradient(position, moved.step, axis=0)[::every]
    wheels = None
    if scenario.odometer:
        wheels = odometer(error[::every], velocity, attitude[::every], odometer_rng)

    # Processing by the software, with its own assumptions.
    process, fix_scale = SETTINGS.mistuning ** belief_rng.uniform(-1.0, 1.0, 2)
    process *= SETTINGS.unmodelled
    noise = process**2 * imu.densities**2 * moved.step
    at_fixes = _measurements(error[::every, POSITION], fixes, fix_scale, wheels)
    measurements = dict(zip(range(0, len(error), every), at_fixes, strict=True))
    filtered, predicted = kalman_filter(transition, noise, start_sigma(imu) ** 2, measurements)
    return Navigation(gps_time, attitude, error, transition, filtered, predicted, fixes)


def _measurements(position_error, fixes, fix_scale, wheels) -> Iterator[list[Measurement]]:
    """Yield the measurements of the filter at each epoch of GNSS as a list."""
    for i in range(len(position_error)):
        at_epoch = [] if wheels is None else [wheels[i]]
        if fixes.valid[i]:
            measured = position_error[i] - fixes.error[i]
            covariance = fix_scale**2 * fixes.covariance[i]
            at_epoch.append(Measurement(np.eye(3, STATES), measured, covariance))
        yield at_epoch


def filter_epochs(trajectory: Trajectory, gnss_rate: float) -> tuple[np.ndarray, int]:
    """Epochs of the filter around a pass, in s, and their number between fixes.

    Fixes are at integer multiples of their period, as from receivers.

    Parameters
    ----------
    trajectory : Trajectory
    gnss_rate : float
        Units: Hz.
    """
    every = int(np.ceil(SETTINGS.filter_rate / gnss_rate))
    start, end = trajectory.gps_time[[0, -1]]
    first = int(np.floor((start - SETTINGS.aligning_before) * gnss_rate))
    last = int(np.ceil((end + SETTINGS.aligning_after) * gnss_rate))
    return np.arange(first * every, last * every + 1) / (every * gnss_rate), every


def angle_errors(
    attitude: Rotation, turn: np.ndarray, covariance: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Errors and sigmas (n, 3) of roll, pitch, heading from small turns (n, 3) about map axes. rad.

    d(turn) = u_roll d(roll) + u_pitch d(pitch) + u_heading d(heading), with
    R_P^G = Rz(-heading) Rx(pitch) Ry(roll).

    Parameters
    ----------
    attitude : Rotation
        n rotations R_P^G.
    turn : (n, 3) array
        About the map axes. Units: rad.
    covariance : (n, 3, 3) array
        Of the turn. Units: rad^2.
    """
    heading = angles_from_attitude(attitude)[2]
    right = np.column_stack([np.cos(heading), -np.sin(heading), np.zeros_like(heading)])
    down = np.broadcast_to([0.0, 0.0, -1.0], right.shape)
    about = np.stack([attitude.apply([0.0, 1.0, 0.0]), right, down], axis=-1)
    inverse = np.linalg.inv(about)
    variance = np.einsum("nij,njk,nik->ni", inverse, covariance, inverse)
    return np.einsum("nij,nj->ni", inverse, turn), np.sqrt(variance)


def _inside(gps_time, trajectory, spans, start):
    """Flag (n,) of times of the pass within intervals (start, duration)."""
    inside = np.zeros(len(gps_time), dtype=bool)
    for begin, duration in spans:
        elapsed = gps_time - start - begin
        inside |= (elapsed >= 0) & (elapsed < duration)
    return inside & (gps_time >= trajectory.gps_time[0]) & (gps_time <= trajectory.gps_time[-1])


def _walls(gps_time, trajectory, scenario, sky, start):
    """Elevation (n, 2) of sky obstruction left and right; zero during alignment. rad."""
    walls = np.zeros((len(gps_time), 2))
    if sky is not None:
        inside = _inside(gps_time, trajectory, ((0.0, np.inf),), trajectory.gps_time[0])
        walls[inside] = interpolate(gps_time[inside], trajectory.gps_time, np.asarray(sky))
    canyon = _inside(gps_time, trajectory, scenario.canyons, start)
    walls[canyon] = np.maximum(walls[canyon], RECEIVER.canyon)
    return walls


def interpolate(gps_time: np.ndarray, epochs: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Interpolate columns (n, k) linearly in time to values (m, k).

    Parameters
    ----------
    gps_time : (m,) array
        Units: s.
    epochs : (n,) array
        Units: s.
    values : (n, k) array
        At the epochs.
    """
    return np.column_stack([np.interp(gps_time, epochs, column) for column in values.T])


@dataclass(frozen=True)
class Odometer:
    """One sigma of a wheel odometer's errors.

    Parameters
    ----------
    noise : float
        Noise of each component once per second: i2Nav-WHU/OB_GINS dataset/ob_gins.yaml. Units: m/s.
    wheel : float
        0.6 mm of a radius of 0.3 m, from load, pressure, temperature. Units: ratio.
    direction : float
        Direction error from mounting, load and side slip. Units: rad.
    """

    noise: float = 0.05
    wheel: float = 0.002
    direction: float = np.radians(0.1)


SENSOR = Odometer()


def odometer(
    error: np.ndarray, velocity: np.ndarray, attitude: Rotation, rng: Generator
) -> list[Measurement]:
    """Simulate measurements of the error state, one at each of n epochs.

    Parameters
    ----------
    error : (n, 15) array
        True error state.
    velocity : (n, 3) array
        True, in map axes. Units: m/s.
    attitude : Rotation
        n true rotations R_P^G.
    rng : Generator
    """
    direction = SENSOR.direction * rng.standard_normal(2)
    wheel = 1 + SENSOR.wheel * rng.standard_normal()
    body = attitude.inv().apply(velocity)
    forward = body[:, 1]
    measured = np.column_stack([0 * forward, wheel * forward, 0 * forward])
    measured[:, [0, 2]] += forward[:, None] * direction
    measured += SENSOR.noise * rng.standard_normal(measured.shape)

    # v_body = R^T v, so that its error is R^T (velocity error + v x attitude error).
    to_body = attitude.inv().as_matrix()
    design = np.zeros((len(forward), 3, STATES))
    design[:, :, VELOCITY] = to_body
    design[:, :, ATTITUDE] = to_body @ skew(velocity)
    noise = SENSOR.noise**2 * np.eye(3)
    misclosure = np.einsum("nij,nj->ni", design, error) + body - measured
    return [Measurement(*row, noise) for row in zip(design, misclosure, strict=True)]


def aligned_poses(trajectory: Trajectory, gps_time: np.ndarray) -> tuple[np.ndarray, Rotation]:
    """Position (n, 3) from the pass's first epoch, and attitude, at increasing times (n,) in s.

    Within the trajectory's time these are its own poses, before and after it those of an alignment.

    Parameters
    ----------
    trajectory : Trajectory
    gps_time : (n,) array
        Rising. Units: s.
    """
    spline = CubicSpline(trajectory.gps_time, trajectory.position - trajectory.position[0])
    start, end = trajectory.gps_time[[0, -1]]
    inside = np.clip(gps_time, start, end)
    position = spline(inside)
    attitude = Slerp(trajectory.gps_time, trajectory.attitude)(inside)
    for outside, edge in ((gps_time < start, start), (gps_time > end, end)):
        if outside.any():
            elapsed = gps_time[outside] - edge
            nose = attitude[np.argmax(outside)].apply([0.0, 1.0, 0.0])
            position[outside] += _driven(elapsed, spline(edge, 1), nose)
            attitude[outside] = _turned(elapsed) * attitude[outside]
    return position, attitude


def _driven(elapsed, velocity, nose):
    """Displacement (n, 3) from the edge of a pass, given the velocity (3,) there. Units: m."""
    speed = np.linalg.norm(velocity)
    course = nose
    if speed > 0.5:  # a standing vehicle has no course
        course = velocity / speed
    fine = np.linspace(0.0, elapsed[np.argmax(np.abs(elapsed))], 4001)
    faster = (
        speed + SETTINGS.aligning_speed * np.sin(np.pi * fine / SETTINGS.aligning_speed_period) ** 2
    )
    moving = faster[:, None] * _turned(fine).apply(course)
    steps = (moving[1:] + moving[:-1]) / 2 * np.diff(fine)[:, None]
    driven = np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])
    if fine[-1] > 0:
        return CubicSpline(fine, driven)(elapsed)
    return CubicSpline(fine[::-1], driven[::-1])(elapsed)


def _turned(elapsed):
    """Rotations of the vehicle about the vertical since (or before) the edge of the pass."""
    heading = SETTINGS.aligning_turn * np.sin(np.pi * elapsed / SETTINGS.aligning_turn_period) ** 2
    return Rotation.from_euler("z", -heading[:, None])
