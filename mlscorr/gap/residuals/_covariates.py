"""What a difference may depend on: when, where and how a thing was seen."""

import numpy as np
from scipy.spatial import cKDTree

from mlscorr.frames import angles_from_attitude, scanner_position, to_scanner
from mlscorr.gap.residuals.rows import SamplePulses
from mlscorr.gap.residuals.settings import SETTINGS
from mlscorr.survey import Survey, Trajectory


def scanner_origin(survey: Survey, gps_time: np.ndarray) -> np.ndarray:
    """Where the scanner was; the navigation centre where the mounting is not known.

    Parameters
    ----------
    survey : Survey
    gps_time : (n,) array
        Units: s.

    Returns
    -------
    (n, 3) array
        Units: m.
    """
    return scanner_position(survey.trajectory, survey.mounting, gps_time)


def to_scanner_or_nan(survey: Survey, xyz: np.ndarray, gps_time: np.ndarray) -> np.ndarray:
    """Scanner coordinates of map points; NaN where the mounting is not known.

    Parameters
    ----------
    survey : Survey
    xyz : (n, 3) array
        Units: m.
    gps_time : (n,) array
        Units: s.

    Returns
    -------
    (n, 3) array
        Units: m.
    """
    if survey.mounting is None:
        return np.full_like(xyz, np.nan)
    return to_scanner(survey.trajectory, survey.mounting, xyz, gps_time)


def covariates(
    survey: Survey,
    gps_time: np.ndarray,
    position: np.ndarray,
    pulses: SamplePulses,
    item: np.ndarray,
    pass_number: np.ndarray,
    direction: np.ndarray,
) -> dict[str, np.ndarray]:
    """Covariates (m,) of items or rows by their names; see Rows.

    Parameters
    ----------
    survey : Survey
    gps_time, position, item, pass_number, direction : (m, ...) arrays
    pulses : SamplePulses
        Range, incidence, scan angle and intensity are their means over each item.
    """
    trajectory = survey.trajectory
    speed, turn_rate, heading = _motion(trajectory, gps_time)
    away = np.linalg.norm(pulses.xyz - scanner_origin(survey, pulses.gps_time), axis=1)
    angle = np.arctan2(pulses.scanner_xyz[:, 1], pulses.scanner_xyz[:, 0])
    mean = _mean_of(pulses.item, item)
    counts = np.log10(np.maximum(pulses.intensity, 1.0))
    largest = np.argmax(np.abs(direction), axis=1)
    return {
        "time": gps_time - trajectory.gps_time[0],
        "location": _location(trajectory, gps_time, position),
        "range": mean(away),
        "incidence": np.arccos(np.clip(mean(pulses.incidence), 0.0, 1.0)),
        "scan_angle": np.arctan2(mean(np.sin(angle)), mean(np.cos(angle))),
        "intensity": mean(counts),
        "speed": speed,
        "turn_rate": turn_rate,
        "heading": heading,
        "pass": pass_number.astype(float),
        "axis": np.where(direction.any(axis=1), largest, -1).astype(float),
    }


def _mean_of(pulse_item, item):
    """Function that gives an item's mean (m,) of values (k,) of the pulses."""
    known, row = np.unique(pulse_item, return_inverse=True)
    count = np.bincount(row)
    place = np.searchsorted(known, item)

    def mean(values):
        return (np.bincount(row, values) / count)[place]

    return mean


def poses_about(
    trajectory: Trajectory, gps_time: np.ndarray, lag: float
) -> tuple[Trajectory, Trajectory]:
    """Poses shortly before and after times (k,), within their passes.

    Parameters
    ----------
    trajectory : Trajectory
    gps_time : (k,) array
        Units: s.
    lag : float
        Units: s.
    """
    start, end = trajectory.passes[trajectory.segment(gps_time)].T
    before = np.maximum(gps_time - lag, start)
    after = np.minimum(gps_time + lag, end)
    return trajectory.at(before), trajectory.at(after)


def _motion(trajectory, gps_time):
    """Speed (m/s), rate of heading to the right (rad/s) and heading (rad) at times (m,)."""
    before, after = poses_about(trajectory, gps_time, SETTINGS.motion_step)
    duration = after.gps_time - before.gps_time
    way = np.linalg.norm(after.position - before.position, axis=1)
    turn = (after.attitude * before.attitude.inv()).as_rotvec()[:, 2]
    heading = angles_from_attitude(trajectory.at(gps_time).attitude)[2]
    return way / duration, -turn / duration, heading


def _location(trajectory, gps_time, position):
    """Way (m,) along the first pass to the place beside it; along its own pass, where that is far.

    Units: m.
    """
    steps = np.linalg.norm(np.diff(trajectory.position, axis=0, prepend=np.nan), axis=1)
    segment = trajectory.segment(trajectory.gps_time)
    steps[np.append(True, np.diff(segment) != 0)] = 0.0
    way = np.cumsum(steps)
    way -= way[np.searchsorted(segment, segment)]
    first = np.flatnonzero(segment == 0)
    distance, nearest = cKDTree(trajectory.position[first]).query(position)
    own = np.interp(gps_time, trajectory.gps_time, way)
    return np.where(distance <= SETTINGS.beside, way[first][nearest], own)
