"""Planes through a place."""

import numpy as np

from mlscorr.targets._plane import Plane


def plane_through(origin, normal):
    """Plane through a point (3,) with a normal of length 1: axes any, sigma 0, no inliers."""
    u = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    u /= np.linalg.norm(u)
    return Plane(origin, np.array([u, np.cross(normal, u), normal]), 0.0, np.empty(0, bool))
