"""Inertial navigation: sensors with errors, how these grow, and the Kalman filter that fights them.

The error state x (15,) is position, velocity, attitude (about the map axes), bias of the gyros and
bias of the accelerometers (in the body), each recorded minus true; phi-angle model in the local
level frame. Earth rate, transport rate and the gradient of gravity are left out: with attitude
errors of 0.1 deg and position errors of metres they add less than 0.03 deg/h and 1e-5 m/s^2, which
the biases of the best grade here exceed ten times.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.georeference import skew

STATES = 15
POSITION, VELOCITY, ATTITUDE, GYRO, ACCELEROMETER = (slice(i, i + 3) for i in range(0, 15, 3))
GRAVITY = 9.80  # m/s^2
HOUR = 3600.0  # s
DEGREE_PER_HOUR = np.radians(1.0) / HOUR  # rad/s
PER_ROOT_HOUR = 1 / np.sqrt(HOUR)  # 1/sqrt(h) in 1/sqrt(s)
MILLIGAL = 1e-5  # m/s^2


@dataclass(frozen=True)
class Imu:
    """Errors of gyros and accelerometers, one sigma each.

    Parameters
    ----------
    gyro_noise, accelerometer_noise : float
        Angular and velocity random walk. Units: rad/sqrt(s), m/s/sqrt(s).
    gyro_bias, accelerometer_bias : float
        What a turn-on leaves. Units: rad/s, m/s^2.
    gyro_wander, accelerometer_wander : float
        How far a bias wanders in bias_time. Units: rad/s, m/s^2.
    bias_time : float
        Correlation time of the biases. Units: s.
    gyro_scale, accelerometer_scale : float
        Error of the scale factor. Units: ratio.
    misalignment : float
        Of each axis towards each other. Units: rad.
    source : str
    """

    gyro_noise: float
    accelerometer_noise: float
    gyro_bias: float
    accelerometer_bias: float
    gyro_wander: float
    accelerometer_wander: float
    bias_time: float
    gyro_scale: float
    accelerometer_scale: float
    misalignment: float
    source: str

    @property
    def densities(self):
        """White noise that drives each state (15,), units of the state per sqrt(s).

        A bias of correlation time bias_time, seen for much less, is a random walk.
        """
        wander = np.sqrt(2 / self.bias_time)
        parts = (
            *(0.0, self.accelerometer_noise, self.gyro_noise),
            *(wander * self.gyro_wander, wander * self.accelerometer_wander),
        )
        return np.repeat(parts, 3)


TACTICAL = Imu(
    gyro_noise=np.radians(0.1) * PER_ROOT_HOUR,
    accelerometer_noise=0.0198 * PER_ROOT_HOUR,
    gyro_bias=0.75 * DEGREE_PER_HOUR,
    accelerometer_bias=1e-3 * GRAVITY,
    gyro_wander=0.075 * DEGREE_PER_HOUR,
    accelerometer_wander=1e-4 * GRAVITY,
    bias_time=HOUR,
    gyro_scale=300e-6,
    accelerometer_scale=300e-6,
    misalignment=1e-4,
    source="iMAR-FSAS: biases, velocity random walk, scale factors of NovAtel's SETIMUSPECS "
    "(docs.novatel.com/OEM7); angular random walk of doi 10.1155/2013/435286, Table 6; in a run "
    "biases wander by a tenth (SPAN-CPT's data sheet: 1 of 3 to 20 deg/h); misalignment 0.1 mrad, "
    "left after calibration",
)
MEMS = Imu(
    gyro_noise=np.radians(0.15) * PER_ROOT_HOUR,
    accelerometer_noise=0.1 * PER_ROOT_HOUR,
    gyro_bias=25.0 * DEGREE_PER_HOUR,
    accelerometer_bias=200 * MILLIGAL,
    gyro_wander=25.0 * DEGREE_PER_HOUR,
    accelerometer_wander=200 * MILLIGAL,
    bias_time=HOUR,
    gyro_scale=1000e-6,
    accelerometer_scale=1000e-6,
    misalignment=np.radians(0.02),
    source="ADIS16465: angular random walk of its data sheet; velocity random walk on a vehicle, "
    "biases and their time of i2Nav-WHU/OB_GINS dataset/ob_gins.yaml; scale factors as "
    "i2Nav-WHU/KF-GINS allows for; misalignment of the data sheet is 0.05 deg at most, and 0.02 "
    "deg gives the roll and pitch errors of OB_GINS_TXT.err, 0.015 deg",
)
GRADES = {"tactical": TACTICAL, "mems": MEMS}

# One sigma at the start of the alignment: a first fix, a first velocity, levelling on the move,
# the course over ground as heading.
START = np.repeat([0.02, 0.05, np.radians(0.3)], 3)
START[8] = np.radians(1.0)


@dataclass(frozen=True)
class Motion:
    """What truly happens in each of n equal steps of time.

    Parameters
    ----------
    step : float
        Units: s.
    force : (n, 3) array
        Specific force in map axes. Units: m/s^2.
    rate : (n, 3) array
        Angular rate in body axes. Units: rad/s.
    attitude : Rotation
        n rotations R_P^G in the middle of the steps.
    """

    step: float
    force: np.ndarray
    rate: np.ndarray
    attitude: Rotation


def motion(step, position, attitude):
    """Motion between n + 1 equidistant poses: position (n + 1, 3) in m, attitude R_P^G."""
    turn = (attitude[:-1].inv() * attitude[1:]).as_rotvec()
    acceleration = np.diff(position, 2, axis=0) / step**2
    acceleration = np.vstack([acceleration[:1], acceleration, acceleration[-1:]])
    force = (acceleration[1:] + acceleration[:-1]) / 2 + [0.0, 0.0, GRAVITY]
    return Motion(step, force, turn / step, attitude[:-1] * Rotation.from_rotvec(turn / 2))


def transitions(motion):
    """Transition matrices (n, 15, 15) of the error state over each step.

    d(position) = velocity, d(velocity) = attitude x force + C accelerometer bias,
    d(attitude) = C gyro bias; to second order in the step.
    """
    rotation = motion.attitude.as_matrix()
    rates = np.zeros((len(motion.force), STATES, STATES))
    rates[:, POSITION, VELOCITY] = np.eye(3)
    rates[:, VELOCITY, ATTITUDE] = -skew(motion.force)
    rates[:, VELOCITY, ACCELEROMETER] = rotation
    rates[:, ATTITUDE, GYRO] = rotation
    rates *= motion.step
    return np.eye(STATES) + rates + rates @ rates / 2


def sensor_errors(imu, motion, rng):
    """What the sensors add to the error state in each step (n, 15), and its start (15,).

    White noise, wandering biases, and scale factors and misalignments times what truly happens.
    """
    start_rng, matrix_rng, noise_rng = rng.spawn(3)
    steps = len(motion.force)
    added = imu.densities * np.sqrt(motion.step) * noise_rng.standard_normal((steps, STATES))
    body_force = motion.attitude.inv().apply(motion.force)
    for part, scale, input_ in (
        (ATTITUDE, imu.gyro_scale, motion.rate),
        (VELOCITY, imu.accelerometer_scale, body_force),
    ):
        sigma = np.where(np.eye(3) > 0, scale, imu.misalignment)
        matrix = sigma * matrix_rng.standard_normal((3, 3))
        added[:, part] += motion.step * motion.attitude.apply(input_ @ matrix.T)
    return added, start_sigma(imu) * start_rng.standard_normal(STATES)


def start_sigma(imu):
    """One sigma (15,) of the error state when the alignment starts."""
    return np.append(START, np.repeat([imu.gyro_bias, imu.accelerometer_bias], 3))


def propagate(transition, added, start):
    """True error state (n + 1, 15) of free inertial navigation from a start (15,)."""
    state = np.empty((len(added) + 1, STATES))
    state[0] = start
    for k, (matrix, addition) in enumerate(zip(transition, added, strict=True)):
        state[k + 1] = matrix @ state[k] + addition
    return state


@dataclass(frozen=True)
class Estimate:
    """Error state (n, 15) as a filter or smoother knows it, and its covariance (n, 15, 15)."""

    state: np.ndarray
    covariance: np.ndarray


@dataclass(frozen=True)
class Measurement:
    """measured (m,) = design (m, 15) x + noise of a covariance (m, m), as the filter has it."""

    design: np.ndarray
    measured: np.ndarray
    covariance: np.ndarray


def kalman_filter(transition, noise, start, measurements):
    """Forward pass of the error-state Kalman filter.

    Parameters
    ----------
    transition : (n, 15, 15) array
    noise : (15,) array
        Variances that a step adds.
    start : (15,) array
        Variances at the first epoch.
    measurements : dict
        Epoch number -> sequence of Measurement.

    Returns the filtered and the predicted Estimate, n + 1 epochs each.
    """
    epochs = len(transition) + 1
    filtered = Estimate(np.zeros((epochs, STATES)), np.empty((epochs, STATES, STATES)))
    predicted = Estimate(np.zeros((epochs, STATES)), np.empty((epochs, STATES, STATES)))
    state, covariance, process = np.zeros(STATES), np.diag(start), np.diag(noise)
    for k in range(epochs):
        if k:
            state = transition[k - 1] @ state
            covariance = transition[k - 1] @ covariance @ transition[k - 1].T + process
        predicted.state[k], predicted.covariance[k] = state, covariance
        for measurement in measurements.get(k, ()):
            state, covariance = _update(state, covariance, measurement)
        filtered.state[k], filtered.covariance[k] = state, covariance
    return filtered, predicted


def _update(state, covariance, measurement):
    """State and covariance after a Measurement; Joseph's form keeps it symmetric, positive."""
    design, noise = measurement.design, measurement.covariance
    cross = design @ covariance
    gain = np.linalg.solve(cross @ design.T + noise, cross).T
    keep = np.eye(STATES) - gain @ design
    state = state + gain @ (measurement.measured - design @ state)
    return state, keep @ covariance @ keep.T + gain @ noise @ gain.T


def smooth(transition, filtered, predicted):
    """Smoothed Estimate: backward pass of Rauch, Tung and Striebel (1965)."""
    forward = transition @ filtered.covariance[:-1]
    gain = np.linalg.solve(predicted.covariance[1:], forward).transpose(0, 2, 1)
    state, covariance = filtered.state.copy(), filtered.covariance.copy()
    for k in range(len(transition) - 1, -1, -1):
        state[k] += gain[k] @ (state[k + 1] - predicted.state[k + 1])
        difference = covariance[k + 1] - predicted.covariance[k + 1]
        covariance[k] += gain[k] @ difference @ gain[k].T
    return Estimate(state, covariance)
