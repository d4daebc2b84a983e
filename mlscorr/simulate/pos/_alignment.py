"""The way before and after a pass, in which a POS aligns itself.

Heading shows in a GNSS/INS only where the vehicle accelerates, so crews drive curves and vary the
speed before and after a survey. What is added here does that: speed and heading swing smoothly,
and meet those of the pass at its ends.
"""

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, Slerp

from mlscorr.simulate.settings import SETTINGS
from mlscorr.survey import Trajectory


def poses(trajectory: Trajectory, gps_time: np.ndarray) -> tuple[np.ndarray, Rotation]:
    """Position (n, 3) about the pass' first epoch and attitude at rising times (n,) in s.

    Within the trajectory's time its own poses, before and after it the way of an alignment.

    Parameters
    ----------
    trajectory : Trajectory
    gps_time : (n,) array
        Rising. Units: s.
    """
    spline = CubicSpline(trajectory.gps_time, trajectory.position - trajectory.position[0])
    start, end = trajectory.gps_time[[0, -1]]
    inside = np.clip(gps_time, start, end)
    position = spline(inside)
    attitude = Slerp(trajectory.gps_time, trajectory.attitude)(inside)
    for outside, edge in ((gps_time < start, start), (gps_time > end, end)):
        if outside.any():
            elapsed = gps_time[outside] - edge
            nose = attitude[np.argmax(outside)].apply([0.0, 1.0, 0.0])
            position[outside] += _way(elapsed, spline(edge, 1), nose)
            attitude[outside] = _turned(elapsed) * attitude[outside]
    return position, attitude


def _way(elapsed, velocity, nose):
    """Displacement (n, 3) from the edge of a pass with a velocity (3,) there. Units: m."""
    speed = np.linalg.norm(velocity)
    course = velocity / speed if speed > 0.5 else nose  # a standing vehicle has no course
    fine = np.linspace(0.0, elapsed[np.argmax(np.abs(elapsed))], 4001)
    faster = (
        speed + SETTINGS.aligning_speed * np.sin(np.pi * fine / SETTINGS.aligning_speed_period) ** 2
    )
    moving = faster[:, None] * _turned(fine).apply(course)
    steps = (moving[1:] + moving[:-1]) / 2 * np.diff(fine)[:, None]
    way = np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])
    return CubicSpline(*((fine, way) if fine[-1] > 0 else (fine[::-1], way[::-1])))(elapsed)


def _turned(elapsed):
    """Rotations of the vehicle about the vertical since (or before) the edge of the pass."""
    heading = SETTINGS.aligning_turn * np.sin(np.pi * elapsed / SETTINGS.aligning_turn_period) ** 2
    return Rotation.from_euler("z", -heading[:, None])
