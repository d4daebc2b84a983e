"""When the scanner came by: one observation of a target for each pass and visit of it."""

import numpy as np

from mlscorr.survey import Pos
from mlscorr.targets.clusters import split_by_time

PAUSE = 2.0  # s without a point: the vehicle came by twice
STEP = 0.5  # m: a vehicle that moved less may have turned on the spot, or stands and shakes


def split_visits(gps_time, scanner):
    """Visits of a place: index arrays of points, each in time.

    Parameters
    ----------
    gps_time : (n,) array
        Units: s.
    scanner : (n, 3) array
        Where the scanner was. Units: m.

    A pause of two seconds parts two visits, and so does a turn back (a U-turn before a target); a
    stop is one visit.

    >>> time = np.arange(0.0, 20.0, 0.1)
    >>> there_and_back = np.abs(time - 10.0)[:, None] * [[0.0, 5.0, 0.0]]
    >>> [len(rows) for rows in split_visits(time, there_and_back)]
    [100, 100]
    """
    return [part for run in split_by_time(gps_time, PAUSE) for part in _by_direction(run, scanner)]


def _by_direction(rows, scanner):
    """Rows of one run, parted where the vehicle turned back against the way it came."""
    path, marks = scanner[rows], [0]
    far = np.linalg.norm(path[:, :2] - path[0, :2], axis=1)
    while far.max() > STEP and (beyond := np.flatnonzero(far[marks[-1] :] > STEP)).size:
        marks.append(marks[-1] + int(beyond[0]))
        far = np.linalg.norm(path[:, :2] - path[marks[-1], :2], axis=1)
    steps = np.diff(path[marks, :2], axis=0)
    cuts, forward = [], steps[0] if len(steps) else None
    for number in range(1, len(steps)):
        if steps[number] @ forward < 0:
            cuts.append(_farthest(path, marks[number - 1], marks[number + 1], forward))
            forward = steps[number]
    return np.split(rows, cuts)


def _farthest(path, first, last, forward):
    """Row between two where the vehicle was farthest forward."""
    return first + int(np.argmax(path[first:last, :2] @ forward))


def scanner_path(gps_time, trajectory, lever_arm):
    """Where the scanner was (n, 3) at times (n,) within the trajectory; the lever arm (3,) by the
    attitude of the nearest epoch, which is exact enough for a direction and spares slerps."""
    time = trajectory.gps_time
    after = np.clip(np.searchsorted(time, gps_time), 1, len(time) - 1)
    epoch = after - (gps_time - time[after - 1] < time[after] - gps_time)
    epochs, which = np.unique(epoch, return_inverse=True)
    position = [np.interp(gps_time, time, axis) for axis in trajectory.position.T]
    return np.column_stack(position) + trajectory.attitude[epochs].apply(lever_arm)[which]


def motion_covariance(trajectory, gps_time, duration):
    """Covariance (n, 3, 3) of centres as the POS error moves while targets are scanned. m^2.

    Parameters
    ----------
    trajectory : Trajectory
    gps_time, duration : (n,) array
        Of each centre, and the standard deviation of its points' times. Units: s.

    Source: the rate of a smooth (Matern 3/2) process is sigma sqrt(3) / correlation time; the
    centre's time and the mean time of its points differ by at most their spread. The attitude's
    share is left out: an error of 0.1 mrad moves a target at 10 m by 1 mm in all.
    """
    sigma = trajectory.at(gps_time).position_sigma
    sigma = np.full((len(gps_time), 3), Pos().position_sigma) if sigma is None else sigma
    moved = sigma * np.sqrt(3) / Pos().correlation_time * np.asarray(duration)[:, None]
    return moved[:, :, None] ** 2 * np.eye(3)
