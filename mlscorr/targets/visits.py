"""When the scanner came by: one observation of a target for each pass and visit of it."""

import numpy as np
from numba import njit

from mlscorr.matching import SETTINGS as MATCHING
from mlscorr.pos import stated_sigma
from mlscorr.survey import Pos, Trajectory
from mlscorr.targets.clusters import split_by_time
from mlscorr.targets.settings import SETTINGS


def split_visits(gps_time: np.ndarray, scanner: np.ndarray) -> list[np.ndarray]:
    """Visits of a place.

    Parameters
    ----------
    gps_time : (n,) array
        Of points. Units: s.
    scanner : (n, 3) array
        Where the scanner was. Units: m.

    Returns
    -------
    list of int arrays
        Rows of the points of each visit, in time.

    A pause of two seconds parts two visits, and so does a turn back (a U-turn before a target); a
    stop is one visit.

    >>> time = np.arange(0.0, 20.0, 0.1)
    >>> there_and_back = np.abs(time - 10.0)[:, None] * [[0.0, 5.0, 0.0]]
    >>> [len(rows) for rows in split_visits(time, there_and_back)]
    [100, 100]
    """
    runs = split_by_time(gps_time, MATCHING.pause)
    return [part for run in runs for part in _by_direction(run, scanner)]


def _by_direction(rows, scanner):
    """Rows of one run, parted where the vehicle turned back against the way it came."""
    path = scanner[rows]
    marks = _each_step(path, SETTINGS.turn_step)
    steps = np.diff(path[marks, :2], axis=0)
    cuts, forward = [], steps[0] if len(steps) else None
    for number in range(1, len(steps)):
        if steps[number] @ forward < 0:
            first, last = marks[number - 1], marks[number + 1]
            cuts.append(first + int(np.argmax(path[first:last, :2] @ forward)))
            forward = steps[number]
    return np.split(rows, cuts)


@njit(cache=True)
def _each_step(path, step):
    """Rows (k,) of a path, of which each is the first farther than a step from the one before."""
    marks, count = np.zeros(len(path), dtype=np.int64), 1
    for row in range(len(path)):
        east, north = path[row, :2] - path[marks[count - 1], :2]
        if east**2 + north**2 > step**2:
            marks[count] = row
            count += 1
    return marks[:count]


def scanner_path(gps_time: np.ndarray, trajectory: Trajectory, lever_arm: np.ndarray) -> np.ndarray:
    """Where the scanner was (n, 3). Units: m.

    Parameters
    ----------
    gps_time : (n,) array
        Within the trajectory. Units: s.
    trajectory : Trajectory
    lever_arm : (3,) array
        Turned by the attitude of the nearest epoch, which is exact enough for a direction and
        spares slerps. Units: m.
    """
    time = trajectory.gps_time
    epoch = np.clip(np.searchsorted(time, gps_time), 1, len(time) - 1)
    epoch -= gps_time - time[epoch - 1] < time[epoch] - gps_time
    epochs = np.unique(epoch)
    path = trajectory.attitude[epochs].apply(lever_arm)[np.searchsorted(epochs, epoch)]
    for axis, position in enumerate(trajectory.position.T):
        path[:, axis] += np.interp(gps_time, time, position)
    return path


def motion_covariance(
    trajectory: Trajectory, pos: Pos, gps_time: np.ndarray, duration: np.ndarray
) -> np.ndarray:
    """Covariance (n, 3, 3) of centres as the POS error moves while targets are scanned. m^2.

    Parameters
    ----------
    trajectory : Trajectory
    pos : Pos
    gps_time, duration : (n,) array
        Of each centre, and the standard deviation of its points' times. Units: s.

    Source: the rate of a smooth (Matern 3/2) process is sigma sqrt(3) / correlation time; the
    centre's time and the mean time of its points differ by at most their spread. The attitude's
    share is left out: an error of 0.1 mrad moves a target at 10 m by 1 mm in all.
    """
    sigma = stated_sigma(trajectory, pos, gps_time).position
    moved = sigma * np.sqrt(3) / pos.correlation_time * np.asarray(duration)[:, None]
    return moved[:, :, None] ** 2 * np.eye(3)
