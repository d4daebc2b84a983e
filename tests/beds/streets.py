"""A straight street with targets on both sides, observed and surveyed."""

import numpy as np

from mlscorr.frames import attitude_from_angles
from mlscorr.survey import Matched, Trajectory
from tests.beds.discs import observed_discs, surveyed_discs

START = np.array([523000.0, 3378000.0, 20.0])
TIME = 413200.0
SHIFT = np.array([0.42, -0.31, 0.27])
LENGTH = 400.0
DURATION = 100.0
SIGMA = 0.003
UP = np.array([0.0, 0.0, 2.0])


def trajectory(sigma=0.05):
    "A straight drive to the north-east at 4 m/s"
    time = TIME + np.arange(0.0, DURATION + 0.05, 0.1)
    along = (time - TIME) / DURATION * LENGTH
    heading = np.full(len(time), np.radians(60.0))
    ahead = np.array([np.sin(heading[0]), np.cos(heading[0]), 0.0])
    return Trajectory(
        gps_time=time,
        position=START + along[:, None] * ahead,
        attitude=attitude_from_angles(0.0 * time, 0.0 * time, heading),
        position_sigma=None if sigma is None else np.full((len(time), 3), sigma),
        attitude_sigma=np.full((len(time), 3), 1e-4),
    )


def targets(rng, n=16, first=3.0, last=97.0):
    "Places (n, 3) beside the drive, and the times at which it passes them"
    drive = trajectory()
    time = np.sort(TIME + rng.uniform(first, last, n))
    time[[0, -1]] = TIME + first, TIME + last
    ahead = np.array([np.sin(np.radians(60.0)), np.cos(np.radians(60.0)), 0.0])
    right = np.array([ahead[1], -ahead[0], 0.0])
    beside = rng.choice([-1.0, 1.0], n) * rng.uniform(4.0, 12.0, n)
    up = rng.uniform(-2.0, 5.0, n)[:, None] * [0.0, 0.0, 1.0]
    return drive.at(time).position + beside[:, None] * right + up, time


def observed(place, time, surveyed, name=None):
    "Observations at places, matched to the control points that they belong to"
    n = len(place)
    if name is None:
        name = tuple(f"T{i:02d}" for i in range(n))
    control = surveyed_discs(name, surveyed, SIGMA, normal=np.nan)
    observations = observed_discs(name, time, place, 0.001, normal=[0.6, -0.8, 0.0])
    return Matched(observations, control[control.rows(name)])


def on_a_line(n, rng):
    "Targets on one straight and level line"
    time = TIME + np.linspace(3.0, 97.0, n)
    return trajectory().at(time).position + UP, time


def on_a_plane(n, rng):
    "Targets on both sides of the street, all on one level"
    place, time = targets(rng, n)
    return place * [1, 1, 0] + [0, 0, 22.0], time
