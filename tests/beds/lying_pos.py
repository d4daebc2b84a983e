"""Drives whose POS errs, and says nothing of it."""

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.survey import Matched, Trajectory
from tests.beds.discs import observed_discs, surveyed_discs

# s, m
START = 413200.0
CORNER = np.array([528000.0, 3379000.0, 20.0])
TIME = np.arange(0.0, 240.0, 0.1)


def walk(rng, begin, end, velocity=0.006):
    "An error that GNSS holds to 1 cm, and that a velocity random walk lets grow in between"
    error = 0.01 * np.sin(TIME[:, None] / [7.0, 11.0, 13.0] + rng.uniform(0, 6, 3))
    inside = (begin <= TIME) & (end > TIME)
    steps = velocity * np.sqrt(0.1) * rng.normal(size=(inside.sum(), 3))
    error[inside] += np.cumsum(np.cumsum(steps, axis=0), axis=0) * 0.1
    return error


def survey(rng, error, times):
    "A recorded drive of 10 m/s that lacks an error, and targets 8 m beside it"
    path = CORNER + np.outer(TIME, [6.0, 8.0, 0.0])
    trajectory = Trajectory(START + TIME, path - error, Rotation.identity(len(TIME)))
    rows = np.searchsorted(TIME, times)
    n = len(times)
    place = trajectory.position[rows] + [6.4, -4.8, 0.5]
    name = tuple(f"T{i:02d}" for i in range(n))
    surveyed = place + error[rows] + 0.003 * rng.normal(size=(n, 3))
    place = place + 0.003 * rng.normal(size=(n, 3))
    observed = observed_discs(name, START + TIME[rows], place, 0.003)
    return trajectory, Matched(observed, surveyed_discs(name, surveyed, 0.003))
