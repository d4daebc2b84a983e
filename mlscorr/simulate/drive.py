"""The true trajectory of a vehicle along a street."""

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicSpline

from mlscorr.simulate.scene import CROWN, ROAD
from mlscorr.survey import Trajectory, attitude_from_angles

POS_HEIGHT = 1.8  # m of the navigation centre above the road: on a car's roof
VIBRATION = (0.25, 0.15, 0.05)  # deg of roll, pitch, heading: a car on its springs
HEAVE = 0.012  # m, the same in height
FREQUENCIES = np.array([0.13, 0.37, 0.9, 1.6])  # Hz, road to body resonance


def distance_along(elapsed, speed, rng):
    """Distance (n,) travelled at a mean cruising speed (m/s) that varies, and slows down once."""
    slow_at = rng.uniform(0.3, 0.7) * elapsed[-1]
    swing = np.sin(2 * np.pi * elapsed / 23.0 + rng.uniform(0, 2 * np.pi))
    slowdown = 1.0 - 0.6 * np.exp(-(((elapsed - slow_at) / 4.0) ** 2))
    return cumulative_trapezoid(speed * (1.0 + 0.1 * swing) * slowdown, elapsed, initial=0.0)


def drive(line, distance, gps_time, origin, rng):
    """Trajectory in map coordinates along a centre line, looking where it goes.

    Parameters
    ----------
    line : CentreLine
    distance, gps_time : (n,) array
        Units: m, s.
    origin : (3,) array
        Map coordinates of the centre line's local origin. Units: m.
    """
    lateral = 0.25 * np.sin(distance / 9.0 + rng.uniform(0, 2 * np.pi))
    path = line.place(distance, lateral, CROWN * ROAD + POS_HEIGHT)
    east, north, up = CubicSpline(gps_time, path).derivative()(gps_time).T
    roll, pitch, heading = (np.radians(v) * _vibration(gps_time, rng) for v in VIBRATION)
    position = path + origin
    position[:, 2] += HEAVE * _vibration(gps_time, rng)
    return Trajectory(
        gps_time,
        position,
        attitude_from_angles(
            roll,
            pitch + np.arctan2(up, np.hypot(east, north)),
            heading + np.arctan2(east, north),
        ),
    )


def _vibration(gps_time, rng):
    """Smooth vibration (n,) of unit RMS, weaker at higher frequencies."""
    phase = rng.uniform(0, 2 * np.pi, len(FREQUENCIES))
    amplitude = FREQUENCIES**-0.5
    waves = amplitude * np.sin(2 * np.pi * gps_time[:, None] * FREQUENCIES + phase)
    return waves.sum(axis=1) / np.sqrt((amplitude**2).sum() / 2)
