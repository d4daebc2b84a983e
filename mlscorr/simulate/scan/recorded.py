"""Pulses of a survey as they were recorded: worked out of points, trajectory and mounting."""

from dataclasses import dataclass

import numpy as np

from mlscorr.simulate.scan.rays import Platform
from mlscorr.survey import Columns, PointCloud, Survey


@dataclass(frozen=True, repr=False)
class RecordedPulses(Columns):
    """Pulses of a survey as they were recorded.

    Parameters
    ----------
    gps_time : (n,) array
        Units: s.
    angle, elevation, range : (n,) array
        From the zero beam, out of the scan plane, along the beam, by the recorded mounting.
        Units: rad, m.
    intensity : (n,) array
        Counts of 16 bits.
    incidence : (n,) array
        Cosine of the angle between beam and surface normal.
    """

    gps_time: np.ndarray
    angle: np.ndarray
    elevation: np.ndarray
    range: np.ndarray
    intensity: np.ndarray
    incidence: np.ndarray


def aim(
    platform: Platform, gps_time: np.ndarray, angle: np.ndarray, elevation: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Start (n, 3) about the platform's origin, in m, and unit direction (n, 3) of pulses.

    Parameters
    ----------
    platform : Platform
    gps_time : (n,) array
        Units: s.
    angle : (n,) array
        From the zero beam. Units: rad.
    elevation : (n,) array
        Out of the scan plane. Units: rad.
    """
    start = platform.scanner(gps_time)
    return start, _towards(platform, gps_time, angle, elevation) - start


def _towards(platform, gps_time, angle, elevation):
    """Where pulses are (n, 3), about the platform's origin, a metre after their start."""
    return platform.place(gps_time, angle, elevation, np.ones(len(gps_time)), np.zeros(3))


def recorded_platform(survey: Survey, origin: np.ndarray) -> Platform:
    """Platform of the trajectory and mounting as they were recorded, about an origin (3,) in m.

    Parameters
    ----------
    survey : Survey
    origin : (3,) array
        Map coordinates of the local origin. Units: m.
    """
    return Platform.of(survey.trajectory, survey.assumed_mounting, np.asarray(origin, float))


def recorded_pulses(
    platform: Platform, cloud: PointCloud, origin: np.ndarray, normal: np.ndarray
) -> RecordedPulses:
    """RecordedPulses of points within the trajectory.

    Parameters
    ----------
    platform : Platform
        As recorded_platform gives it, about the origin.
    cloud : PointCloud
    origin : (3,) array
        Units: m.
    normal : (n, 3) array, or (3,) of all
        Unit normals of the surfaces they lie on.
    """
    time = cloud.gps_time
    level = np.zeros(len(cloud))
    quarter = np.full(len(cloud), np.pi / 2)
    start, x = aim(platform, time, level, level)
    ends = _towards(platform, time, quarter, level), _towards(platform, time, level, quarter)
    axes = x, *(end - start for end in ends)
    sight = cloud.xyz - origin - start
    x, y, z = (np.einsum("ni,ni->n", sight, axis) for axis in axes)
    away = np.sqrt(x**2 + y**2 + z**2)
    slant = np.einsum("ni,ni->n", sight, np.broadcast_to(normal, sight.shape)) / away
    return RecordedPulses(
        gps_time=time,
        angle=np.arctan2(y, x),
        elevation=np.arcsin(np.clip(z / away, -1.0, 1.0)),
        range=away,
        intensity=cloud.intensity.astype(float),
        incidence=np.abs(slant),
    )
