"""Free inertial navigation, its aid by GNSS and odometer, and what filter and smoother leave."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.random import Generator
from scipy.spatial.transform import Rotation

from mlscorr.frames import angles_from_attitude
from mlscorr.simulate.pos import _alignment as alignment
from mlscorr.simulate.pos._gnss import RECEIVER, Fixes, gnss_fixes
from mlscorr.simulate.pos._inertial import (
    ATTITUDE,
    POSITION,
    STATES,
    Imu,
    motion,
    propagate,
    sensor_errors,
    start_sigma,
    transitions,
)
from mlscorr.simulate.pos._kalman import Measurement, StateEstimate, kalman_filter, smooth
from mlscorr.simulate.pos._odometer import odometer
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
    """Free inertial navigation, its estimates, and what they had to work with.

    Parameters
    ----------
    gps_time : (n,) array
        Epochs of the filter, alignment before and after the pass included. Units: s.
    attitude : Rotation
        True R_P^G.
    error : (n, 15) array
        True error state of the free inertial navigation.
    transition : (n - 1, 15, 15) array
        Of the error state from epoch to epoch.
    filtered, predicted : StateEstimate
        Of that error state.
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
        """The error state after smoothing, which takes as long as the filter."""
        return smooth(self.transition, self.filtered, self.predicted)

    def at(self, gps_time: np.ndarray, smoothed: bool = True) -> PosError:
        """PosError that is left at times (m,), after smoothing or after the filter alone.

        Parameters
        ----------
        gps_time : (m,) array
            Units: s.
        smoothed : bool
            After smoothing, or after the filter alone.
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
    """Navigation of a pass with an Imu; for the parameters see pos_error.

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
    position, attitude = alignment.poses(trajectory, gps_time)
    moved = motion(gps_time[1] - gps_time[0], position, attitude)
    transition = transitions(moved)
    error = propagate(transition, *sensor_errors(imu, moved, sensor_rng))

    # GNSS fixes, as far as the sky can be seen, and the odometer.
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

    # What the software makes of them, believing its own figures.
    process, fix_scale = SETTINGS.mistuning ** belief_rng.uniform(-1.0, 1.0, 2)
    process *= SETTINGS.unmodelled
    noise = process**2 * imu.densities**2 * moved.step
    at_fixes = _measurements(error[::every, POSITION], fixes, fix_scale, wheels)
    measurements = dict(zip(range(0, len(error), every), at_fixes, strict=True))
    filtered, predicted = kalman_filter(transition, noise, start_sigma(imu) ** 2, measurements)
    return Navigation(gps_time, attitude, error, transition, filtered, predicted, fixes)


def _measurements(position_error, fixes, fix_scale, wheels) -> Iterator[list[Measurement]]:
    """What the filter gets at each epoch of GNSS: a list of Measurement."""
    for i in range(len(position_error)):
        at_epoch = [] if wheels is None else [wheels[i]]
        if fixes.valid[i]:
            measured = position_error[i] - fixes.error[i]
            covariance = fix_scale**2 * fixes.covariance[i]
            at_epoch.append(Measurement(np.eye(3, STATES), measured, covariance))
        yield at_epoch


def filter_epochs(trajectory: Trajectory, gnss_rate: float) -> tuple[np.ndarray, int]:
    """Epochs of the filter around a pass, in s, and how many there are from fix to fix.

    Fixes fall on whole multiples of their period, as receivers give them.

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
    """Errors and sigmas (n, 3) of roll, pitch, heading by small turns (n, 3) about map axes. rad.

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
    """Which times (n,) of the pass lie in spans (start, duration): bool."""
    inside = np.zeros(len(gps_time), dtype=bool)
    for begin, duration in spans:
        elapsed = gps_time - start - begin
        inside |= (elapsed >= 0) & (elapsed < duration)
    return inside & (gps_time >= trajectory.gps_time[0]) & (gps_time <= trajectory.gps_time[-1])


def _walls(gps_time, trajectory, scenario, sky, start):
    """Elevation (n, 2) of what hides the sky left and right; nothing during alignment. rad."""
    walls = np.zeros((len(gps_time), 2))
    if sky is not None:
        inside = _inside(gps_time, trajectory, ((0.0, np.inf),), trajectory.gps_time[0])
        walls[inside] = interpolate(gps_time[inside], trajectory.gps_time, np.asarray(sky))
    canyon = _inside(gps_time, trajectory, scenario.canyons, start)
    walls[canyon] = np.maximum(walls[canyon], RECEIVER.canyon)
    return walls


def interpolate(gps_time: np.ndarray, epochs: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values (m, k) of columns (n, k), linear in time.

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
