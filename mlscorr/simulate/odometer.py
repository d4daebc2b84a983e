"""A wheel odometer, and the software's belief that a car neither slips sideways nor flies.

Both together are a velocity in the body, (0, v, 0). It bounds the drift without GNSS: positions
then go wrong in proportion to the distance, by what the wheel's radius and the direction in which
the car rolls are wrong.
"""

import numpy as np

from mlscorr.georeference import skew
from mlscorr.simulate.inertial import ATTITUDE, STATES, VELOCITY, Measurement

NOISE = 0.05  # m/s, each component once a second: i2Nav-WHU/OB_GINS dataset/ob_gins.yaml
WHEEL = 0.002  # ratio, one sigma: 0.6 mm of a radius of 0.3 m by load, pressure, temperature
DIRECTION = np.radians(0.1)  # one sigma: how IMU and axle are mounted, by load and side slip


def odometer(error, velocity, attitude, rng):
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
    direction = DIRECTION * rng.standard_normal(2)
    wheel = 1 + WHEEL * rng.standard_normal()
    body = attitude.inv().apply(velocity)
    forward = body[:, 1]
    said = np.column_stack([0 * forward, wheel * forward, 0 * forward])
    said[:, [0, 2]] += forward[:, None] * direction
    said += NOISE * rng.standard_normal(said.shape)

    # v_body = R^T v, so that its error is R^T (velocity error + v x attitude error).
    to_body = attitude.inv().as_matrix()
    design = np.zeros((len(forward), 3, STATES))
    design[:, :, VELOCITY] = to_body
    design[:, :, ATTITUDE] = to_body @ skew(velocity)
    noise = NOISE**2 * np.eye(3)
    measured = np.einsum("nij,nj->ni", design, error) + body - said
    return [Measurement(*row, noise) for row in zip(design, measured, strict=True)]
