"""Velocities, accelerations and angular rates of a trajectory, for file formats with them.

Frames are those of an SBET with a wander angle of zero: velocities north, west, up; accelerations
and rates about the body axes forward, right, down. Checked on a real airborne SBET: its velocities
are the derivative of its positions in this frame (up to 5 mm/s), its accelerations average zero, so
they exclude gravity, and its rates have the signs of d(roll, pitch, heading)/dt.
"""

import numpy as np
from pyproj import CRS
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from mlscorr.survey import Trajectory

AXES = ("x", "y", "z")


def motion_columns(
    trajectory: Trajectory, place: dict[str, np.ndarray], attitude: Rotation, crs: CRS
) -> dict[str, np.ndarray]:
    """Make columns ``velocity_x`` to ``rate_z`` of an SBET, each (n,). Units: m/s, m/s^2, rad/s.

    Velocities and accelerations are derivatives of a cubic spline through the positions, rates
    those of the rotation between epochs. No derivative crosses a gap; a single epoch between two
    gaps has zeros. Rates are relative to the ground: the earth's rotation is not added.

    Parameters
    ----------
    trajectory : Trajectory
    place : dict
        latitude, longitude (rad) and height (m), each (n,).
    attitude : Rotation
        n rotations from body axes (right, forward, up) to east, north, up.
    crs : CRS
        CRS with the ellipsoid of the position.
    """
    velocity = np.zeros((len(trajectory), 3))  # east, north, up
    acceleration = np.zeros((len(trajectory), 3))
    rate = np.zeros((len(trajectory), 3))
    segment = trajectory.segment(trajectory.gps_time)
    for number in np.unique(segment):
        rows = np.flatnonzero(segment == number)
        if len(rows) < 2:
            continue
        time = trajectory.gps_time[rows] - trajectory.gps_time[rows[0]]
        own = np.column_stack([place[name][rows] for name in ("longitude", "latitude", "height")])
        slope = CubicSpline(time, own - own[0])(time, 1)
        velocity[rows] = slope * _radii(own, crs)
        acceleration[rows] = CubicSpline(time, velocity[rows])(time, 1)
        rate[rows] = _rates(time, attitude[rows])
    east, north, up = velocity.T
    columns = dict(zip((f"velocity_{axis}" for axis in AXES), (north, -east, up), strict=True))
    for name, vector in (("acceleration", attitude.inv().apply(acceleration)), ("rate", rate)):
        right, forward, up = vector.T
        parts = (forward, right, -up)
        columns |= dict(zip((f"{name}_{axis}" for axis in AXES), parts, strict=True))
    return columns


def _radii(place, crs):
    """Meters per radian of longitude and latitude, and per meter of height, (n, 3)."""
    ellipsoid = crs.ellipsoid
    ratio = (ellipsoid.semi_minor_metre / ellipsoid.semi_major_metre) ** 2  # 1 - e^2
    _, latitude, height = place.T
    root = np.sqrt(1.0 - (1.0 - ratio) * np.sin(latitude) ** 2)
    normal = ellipsoid.semi_major_metre / root  # N, of the prime vertical
    meridian = normal * ratio / root**2  # M
    parallel = (normal + height) * np.cos(latitude)
    return np.column_stack([parallel, meridian + height, np.ones(len(place))])


def _rates(time, attitude):
    """Angular rates (n, 3) about the body axes at epochs, from the rotations between them."""
    steps = np.diff(time)
    between = (attitude[:-1].inv() * attitude[1:]).as_rotvec() / steps[:, None]
    padded = np.vstack([between[:1], between, between[-1:]])
    weights = np.concatenate([steps[:1], steps, steps[-1:]])[:, None]
    # a parabola through three epochs: the shorter step has more weight
    return (padded[:-1] * weights[1:] + padded[1:] * weights[:-1]) / (weights[:-1] + weights[1:])
