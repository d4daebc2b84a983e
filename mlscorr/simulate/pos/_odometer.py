"""A wheel odometer, and the software's belief that a car neither slips sideways nor flies.

Both together are a velocity in the body, (0, v, 0). It bounds the drift without GNSS: positions
then go wrong in proportion to the distance, by what the wheel's radius and the direction in which
the car rolls are wrong.
"""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from scipy.spatial.transform import Rotation

from mlscorr.frames import skew
from mlscorr.simulate.pos._inertial import ATTITUDE, STATES, VELOCITY
from mlscorr.simulate.pos._kalman import Measurement


@dataclass(frozen=True)
class Odometer:
    """One sigma of a wheel odometer's errors.

    Parameters
    ----------
    noise : float
        Each component once a second: i2Nav-WHU/OB_GINS dataset/ob_gins.yaml. Units: m/s.
    wheel : float
        0.6 mm of a radius of 0.3 m by load, pressure, temperature. Units: ratio.
    direction : float
        How IMU and axle are mounted, by load and side slip. Units: rad.
    """

    noise: float = 0.05
    wheel: float = 0.002
    direction: float = np.radians(0.1)


SENSOR = Odometer()


def odometer(
    error: np.ndarray, velocity: np.ndarray, attitude: Rotation, rng: Generator
) -> list[Measurement]:
    """Measurements of the error state, one at each of n epochs: a list.

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
