"""The error of a position and orientation system, from its causes.

Satellites and reflections make the errors of GNSS fixes; noise, biases, scale factors and
misalignments those of the sensors. Free inertial navigation integrates the latter, and a Kalman
filter and smoother, with beliefs of their own on all this, make of both what is recorded. Nothing
is drawn from a covariance function: the estimator must not be tested on its own model.
"""

from dataclasses import dataclass

import numpy as np

from mlscorr.io.pos_error_series import read_pos_error_series
from mlscorr.simulate import approach
from mlscorr.simulate.gnss import CANYON, gnss_fixes
from mlscorr.simulate.inertial import (
    ATTITUDE,
    GRADES,
    POSITION,
    STATES,
    Measurement,
    kalman_filter,
    motion,
    propagate,
    sensor_errors,
    smooth,
    start_sigma,
    transitions,
)
from mlscorr.simulate.odometer import odometer
from mlscorr.survey import Trajectory, angles_from_attitude, attitude_from_angles

FILTER_RATE = 10.0  # Hz at least; in 0.1 s the better sensors add 0.1 mm/s and 0.0005 deg
MISTUNED = 1.3  # software's noise figures lie within this factor of the truth
UNMODELLED = 1.6  # by which software raises the sensors' noise for what it has no states for, as
# i2Nav-WHU/KF-GINS does for the ADIS16465 (0.24 instead of the data sheet's 0.15 deg/sqrt(h))
LOCAL = 30.0  # s of a given series whose RMS is its sigma: the time constant of such software
SIGMA_FLOOR = 0.005, np.radians(0.005)  # m, rad: the least that such software reports


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


def pos_error(trajectory, scenario, rng, sky=None, start=None):
    """PosError at the epochs of one pass.

    Parameters
    ----------
    trajectory : Trajectory
        The true one, without gaps.
    scenario : PosScenario
    rng : Generator
    sky : (n, 2) array, optional
        Elevation below which the sky is hidden to the left and right; needed for sky_view.
        Units: rad.
    start : float, optional
        gps_time from which outages and canyons count; the pass' first epoch when not given.

    Raises ValueError for a trajectory with gaps, a missing sky, or a file that is too short.
    """
    if len(trajectory.gaps):
        raise ValueError(
            f"The true trajectory has {len(trajectory.gaps)} gaps (first at "
            f"{trajectory.gaps[0, 0]:.3f} s); the error of the POS is made for one pass at a time."
        )
    if scenario.error_file is not None:
        return given_error(trajectory, read_pos_error_series(scenario.error_file), rng)
    if scenario.sky_view and sky is None:
        raise ValueError("sky_view needs the elevation of the walls beside the way.")
    sky = sky if scenario.sky_view else None
    navigation = navigate(trajectory, scenario, GRADES[scenario.grade], rng, sky, start)
    return navigation.at(trajectory.gps_time, smoothed=scenario.processing == "smoothed")


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
    filtered, smoothed : Estimate
        Of that error state.
    fix_time : (k,) array
        Units: s.
    fixes : Fixes
    """

    gps_time: np.ndarray
    attitude: object
    error: np.ndarray
    filtered: object
    smoothed: object
    fix_time: np.ndarray
    fixes: object

    def at(self, gps_time, smoothed=True):
        """PosError that is left at times (m,), after smoothing or after the filter alone."""
        estimate = self.smoothed if smoothed else self.filtered
        left = self.error - estimate.state
        attitude, attitude_sigma = angle_errors(
            self.attitude, left[:, ATTITUDE], estimate.covariance[:, ATTITUDE, ATTITUDE]
        )
        variance = np.diagonal(estimate.covariance[:, POSITION, POSITION], axis1=1, axis2=2)
        columns = (left[:, POSITION], attitude, np.sqrt(variance), attitude_sigma)
        return PosError(*(_interpolate(gps_time, self.gps_time, column) for column in columns))


def navigate(trajectory, scenario, imu, rng, sky=None, start=None, agree=False):
    """Navigation of a pass with an Imu.

    With agree, the filter knows the noise as it is: GNSS errors are white and figures not
    mistuned. For the other parameters see pos_error.
    """
    sensor_rng, gnss_rng, belief_rng, odometer_rng = rng.spawn(4)
    start = trajectory.gps_time[0] if start is None else start
    gps_time, every = filter_epochs(trajectory, scenario.gnss_rate)
    position, attitude = approach.poses(trajectory, gps_time)
    moved = motion(gps_time[1] - gps_time[0], position, attitude)
    transition = transitions(moved)
    error = propagate(transition, *sensor_errors(imu, moved, sensor_rng))

    # GNSS fixes, as far as the sky can be seen, and the odometer.
    fix_time = gps_time[::every]
    walls = _walls(fix_time, trajectory, scenario, sky, start)
    heading = angles_from_attitude(attitude[::every])[2]
    fixes = gnss_fixes(fix_time, heading, walls, gnss_rng, white_only=agree)
    fixes = fixes.without(_inside(fix_time, trajectory, scenario.outages, start))
    velocity = np.gradient(position, moved.step, axis=0)[::every]
    wheels = None
    if scenario.odometer:
        wheels = odometer(error[::every], velocity, attitude[::every], odometer_rng)

    # What the software makes of them, believing its own figures.
    process, fix_scale = np.ones(2) if agree else _beliefs(belief_rng)
    noise = process**2 * imu.densities**2 * moved.step
    measurements = _measurements(error[::every, POSITION], fixes, fix_scale, wheels)
    measurements = {every * i: measurement for i, measurement in measurements.items()}
    filtered, predicted = kalman_filter(transition, noise, start_sigma(imu) ** 2, measurements)
    smoothed = smooth(transition, filtered, predicted)
    return Navigation(gps_time, attitude, error, filtered, smoothed, fix_time, fixes)


def _measurements(position_error, fixes, fix_scale, wheels):
    """What the filter gets at each epoch of GNSS: a dict of epoch -> list of Measurement."""
    measurements = {}
    for i in range(len(position_error)):
        at_epoch = [] if wheels is None else [wheels[i]]
        if fixes.found[i]:
            measured = position_error[i] - fixes.error[i]
            covariance = fix_scale**2 * fixes.covariance[i]
            at_epoch.append(Measurement(np.eye(3, STATES), measured, covariance))
        measurements[i] = at_epoch
    return measurements


def filter_epochs(trajectory, gnss_rate):
    """Epochs of the filter around a pass, in s, and how many there are from fix to fix.

    Fixes fall on whole multiples of their period, as receivers give them.
    """
    every = int(np.ceil(FILTER_RATE / gnss_rate))
    start, end = trajectory.gps_time[[0, -1]]
    first = int(np.floor((start - approach.BEFORE) * gnss_rate))
    last = int(np.ceil((end + approach.AFTER) * gnss_rate))
    return np.arange(first * every, last * every + 1) / (every * gnss_rate), every


def angle_errors(attitude, turn, covariance):
    """Errors and sigmas (n, 3) of roll, pitch, heading by small turns (n, 3) about map axes. rad.

    d(turn) = u_roll d(roll) + u_pitch d(pitch) + u_heading d(heading), with
    R_P^G = Rz(-heading) Rx(pitch) Ry(roll).
    """
    _, pitch, heading = angles_from_attitude(attitude)
    zero, one = np.zeros_like(pitch), np.ones_like(pitch)
    about = np.stack(
        [
            np.stack([np.sin(heading), np.cos(heading), np.tan(pitch)], -1)
            * np.cos(pitch)[:, None],
            np.stack([np.cos(heading), -np.sin(heading), zero], -1),
            np.stack([zero, zero, -one], -1),
        ],
        axis=-1,
    )
    inverse = np.linalg.inv(about)
    variance = np.einsum("nij,njk,nik->ni", inverse, covariance, inverse)
    return np.einsum("nij,nj->ni", inverse, turn), np.sqrt(variance)


def given_error(trajectory, series, rng):
    """PosError from a window of a PosErrorSeries, chosen at random.

    The sigmas are the RMS of the series within 15 s, of E and N, and of roll and pitch, together.
    """
    duration = trajectory.gps_time[-1] - trajectory.gps_time[0]
    spare = series.gps_time[-1] - series.gps_time[0] - duration
    if spare < 0:
        raise ValueError(
            f"The error series lasts {series.gps_time[-1] - series.gps_time[0]:.1f} s, the pass "
            f"{duration:.1f} s: take a longer series or a shorter pass."
        )
    begin = series.gps_time[0] + rng.uniform(0.0, spare)
    gps_time = np.clip(
        begin + trajectory.gps_time - trajectory.gps_time[0], None, series.gps_time[-1]
    )
    columns = (
        series.position,
        series.attitude,
        *(
            np.maximum(_local_rms(series.gps_time, values), floor)
            for values, floor in zip((series.position, series.attitude), SIGMA_FLOOR, strict=True)
        ),
    )
    return PosError(*(_interpolate(gps_time, series.gps_time, column) for column in columns))


def record(trajectory, error):
    """Trajectory that the POS records of a true one."""
    angles = np.column_stack(angles_from_attitude(trajectory.attitude)) + error.attitude
    return Trajectory(
        trajectory.gps_time,
        trajectory.position + error.position,
        attitude_from_angles(*angles.T),
        error.position_sigma,
        error.attitude_sigma,
    )


def _beliefs(rng):
    """Factors of the software's sigmas of the sensors and of the fixes."""
    return np.array([UNMODELLED, 1.0]) * MISTUNED ** rng.uniform(-1.0, 1.0, 2)


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
        walls[inside] = _interpolate(gps_time[inside], trajectory.gps_time, np.asarray(sky))
    canyon = _inside(gps_time, trajectory, scenario.canyons, start)
    walls[canyon] = np.maximum(walls[canyon], CANYON)
    return walls


def _local_rms(gps_time, values):
    """RMS (n, 3) of values (n, 3) within LOCAL / 2 of each time, the first two axes together."""
    first = np.searchsorted(gps_time, gps_time - LOCAL / 2)
    last = np.searchsorted(gps_time, gps_time + LOCAL / 2, side="right")
    total = np.vstack([np.zeros(3), np.cumsum(values**2, axis=0)])
    mean = (total[last] - total[first]) / (last - first)[:, None]
    mean[:, :2] = mean[:, :2].mean(axis=1, keepdims=True)
    return np.sqrt(mean)


def _interpolate(gps_time, epochs, values):
    """Values (m, k) of columns (n, k), linear in time."""
    return np.column_stack([np.interp(gps_time, epochs, column) for column in values.T])
