"""Discs of 0.6 m as targets, surveyed and observed."""

import numpy as np

from mlscorr.survey import ControlPoints, TargetObservations

UP = np.array([0.0, 0.0, 1.0])


def surveyed_discs(name, position, sigma, normal=UP):
    "ControlPoints (n, 3) of one sigma on all axes. Units: m"
    n = len(name)
    shape = ("circle",) * n, np.full(n, 0.6)
    normal = np.broadcast_to(normal, (n, 3)).copy()
    return ControlPoints(name, position, np.full((n, 3), sigma), *shape, normal)


def observed_discs(name, gps_time, position, sigma, normal=UP, pass_number=1):
    "TargetObservations of 300 points each, of one sigma on all axes. Units: s, m"
    n = len(name)
    return TargetObservations(
        name,
        np.broadcast_to(pass_number, n).copy(),
        gps_time,
        position,
        np.tile(sigma**2 * np.eye(3), (n, 1, 1)),
        np.broadcast_to(normal, (n, 3)).copy(),
        ("circle",) * n,
        np.full(n, 0.6),
        np.full(n, 300),
    )
