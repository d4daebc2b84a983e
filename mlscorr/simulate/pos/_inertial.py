"""Inertial navigation: sensor errors, their propagation, and data for the Kalman filter.

The error state x (15,) is position, velocity, attitude (about the map axes), bias of the gyros and
bias of the accelerometers (in the body), each recorded minus true; phi-angle model in the local
level frame. Earth rate, transport rate and the gradient of gravity are neglected: with attitude
errors of 0.1 deg and position errors of meters they add less than 0.03 deg/h and 1e-5 m/s^2, a
tenth of the biases of the best grade used here.
"""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from scipy.constants import hour
from scipy.spatial.transform import Rotation

from mlscorr.frames import skew
from mlscorr.simulate.settings import SETTINGS

STATES = 15
POSITION, VELOCITY, ATTITUDE, GYRO, ACCELEROMETER = (slice(i, i + 3) for i in range(0, 15, 3))
GRAVITY = 9.80  # m/s^2


@dataclass(frozen=True)
class Imu:
    """Errors of gyros and accelerometers, one sigma each.

    Parameters
    ----------
    gyro_noise, accelerometer_noise : float
        Angular and velocity random walk. Units: rad/sqrt(s), m/s/sqrt(s).
    gyro_bias, accelerometer_bias : float
        Turn-on bias. Units: rad/s, m/s^2.
    gyro_wander, accelerometer_wander : float
        Drift of a bias in bias_time. Units: rad/s, m/s^2.
    bias_time : float
        Correlation time of the biases. Units: s.
    gyro_scale, accelerometer_scale : float
        Error of the scale factor. Units: ratio.
    misalignment : float
        Of each axis toward each other. Units: rad.
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

    @property
    def densities(self) -> np.ndarray:
        """White noise that drives each state (15,), in units of the state per sqrt(s).

        A bias with correlation time bias_time is a random walk over much shorter times.
        """
        wander = np.sqrt(2 / self.bias_time)
        parts = (
            *(0.0, self.accelerometer_noise, self.gyro_noise),
            *(wander * self.gyro_wander, wander * self.accelerometer_wander),
        )
        return np.repeat(parts, 3)


# iMAR-FSAS: biases, velocity random walk, scale factors of NovAtel's SETIMUSPECS
# (docs.novatel.com/OEM7); angular random walk of doi 10.1155/2013/435286, Table 6; in a run
# biases wander by a tenth (SPAN-CPT's data sheet: 1 of 3 to 20 deg/h); misalignment 0.1 mrad,
# left after calibration
TACTICAL = Imu(
    gyro_noise=np.radians(0.1) / np.sqrt(hour),
    accelerometer_noise=0.0198 / np.sqrt(hour),
    gyro_bias=np.radians(0.75) / hour,
    accelerometer_bias=1e-3 * GRAVITY,
    gyro_wander=np.radians(0.075) / hour,
    accelerometer_wander=1e-4 * GRAVITY,
    bias_time=hour,
    gyro_scale=300e-6,
    accelerometer_scale=300e-6,
    misalignment=1e-4,
)
# ADIS16465: angular random walk of its data sheet; velocity random walk on a vehicle, biases and
# their time of i2Nav-WHU/OB_GINS dataset/ob_gins.yaml; scale factors as i2Nav-WHU/KF-GINS allows
# for; misalignment of the data sheet is 0.05 deg at most, and 0.02 deg gives the roll and pitch
# errors of OB_GINS_TXT.err, 0.015 deg
MEMS = Imu(
    gyro_noise=np.radians(0.15) / np.sqrt(hour),
    accelerometer_noise=0.1 / np.sqrt(hour),
    gyro_bias=np.radians(25.0) / hour,
    accelerometer_bias=200e-5,
    gyro_wander=np.radians(25.0) / hour,
    accelerometer_wander=200e-5,
    bias_time=hour,
    gyro_scale=1000e-6,
    accelerometer_scale=1000e-6,
    misalignment=np.radians(0.02),
)
GRADES = {"tactical": TACTICAL, "mems": MEMS}


@dataclass(frozen=True)
class Motion:
    """True motion in each of n equal time steps.

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


def motion(step: float, position: np.ndarray, attitude: Rotation) -> Motion:
    """Compute the motion between n + 1 equidistant poses: position (n + 1, 3) in m, attitude R_P^G.

    Parameters
    ----------
    step : float
        Units: s.
    position : (n + 1, 3) array
        Units: m.
    attitude : Rotation
        n rotations R_P^G.
    """
    turn = (attitude[:-1].inv() * attitude[1:]).as_rotvec()
    acceleration = np.diff(position, 2, axis=0) / step**2
    acceleration = np.vstack([acceleration[:1], acceleration, acceleration[-1:]])
    force = (acceleration[1:] + acceleration[:-1]) / 2 + [0.0, 0.0, GRAVITY]
    return Motion(step, force, turn / step, attitude[:-1] * Rotation.from_rotvec(turn / 2))


def transitions(motion: Motion) -> np.ndarray:
    """Transition matrices (n, 15, 15) of the error state over each step.

    d(position) = velocity, d(velocity) = attitude x force + C accelerometer bias,
    d(attitude) = C gyro bias; to second order in the step.

    Parameters
    ----------
    motion : Motion
    """
    rotation = motion.attitude.as_matrix()
    rates = np.zeros((len(motion.force), STATES, STATES))
    rates[:, POSITION, VELOCITY] = np.eye(3)
    rates[:, VELOCITY, ATTITUDE] = -skew(motion.force)
    rates[:, VELOCITY, ACCELEROMETER] = rotation
    rates[:, ATTITUDE, GYRO] = rotation
    rates *= motion.step
    return np.eye(STATES) + rates + rates @ rates / 2


def sensor_errors(imu: Imu, motion: Motion, rng: Generator) -> tuple[np.ndarray, np.ndarray]:
    """Errors of the sensors added to the error state in each step (n, 15), and its start (15,).

    White noise, drifting biases, and scale factors and misalignments times the true motion.

    Parameters
    ----------
    imu : Imu
    motion : Motion
    rng : Generator
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


def start_sigma(imu: Imu) -> np.ndarray:
    """One sigma (15,) of the error state at the start of the alignment.

    Parameters
    ----------
    imu : Imu
    """
    position, velocity, tilt, heading = SETTINGS.aligning_sigma
    start = [*[position] * 3, *[velocity] * 3, tilt, tilt, heading]
    return np.append(start, np.repeat([imu.gyro_bias, imu.accelerometer_bias], 3))


def propagate(transition: np.ndarray, added: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Propagate the true error state (n + 1, 15) of free inertial navigation from a start (15,).

    Parameters
    ----------
    transition : (n, 15, 15) array
        Over each step.
    added : (n, 15) array
        Errors of the sensors in each step.
    start : (15,) array
    """
    state = np.empty((len(added) + 1, STATES))
    state[0] = start
    for k, (matrix, addition) in enumerate(zip(transition, added, strict=True)):
        state[k + 1] = matrix @ state[k] + addition
    return state
