"""Passes and moments of a stream of points."""

from collections.abc import Iterator

import numpy as np

from mlscorr.surfaces.settings import SETTINGS
from mlscorr.survey import PointCloud, Trajectory


def pass_numbers(starts: np.ndarray) -> np.ndarray:
    """Numbers (n,) of passes from 1 in order of time.

    Parameters
    ----------
    starts : array of n values
        First time of each; infinite, and thus last, without one. Units: s.
    """
    number = np.empty(starts.size, int)
    number[np.argsort(starts, axis=None, kind="stable")] = np.arange(1, starts.size + 1)
    return number


class MomentStream:
    """Stream of points grouped by moments, regardless of its chunks.

    Points are roughly in order of time, ascending or descending. Those of the last moments wait for
    further points.

    Parameters
    ----------
    trajectory : Trajectory
    """

    def __init__(self, trajectory: Trajectory):
        self._trajectory = trajectory
        self._cloud = PointCloud(np.empty((0, 3)), np.empty(0), np.empty(0, np.uint16))
        self._number = np.empty(0, int)

    def add(self, cloud: PointCloud, number: np.ndarray) -> None:
        """Add points.

        Parameters
        ----------
        cloud : PointCloud
            Points within the segments of the trajectory.
        number : (n,) int array
            Index of each point in its file.
        """
        self._cloud = PointCloud.concatenate([self._cloud, cloud])
        self._number = np.append(self._number, number)

    def moments(self, time: float = np.inf) -> Iterator[tuple[int, PointCloud, np.ndarray]]:
        """Yield segment, PointCloud and indices (k,) of each complete moment once.

        Parameters
        ----------
        time : float, optional
            Time of the last point so far, around which further points are expected. Units: s.
        """
        cloud = self._cloud
        number = self._number
        segment = self._trajectory.segment(cloud.gps_time)
        moment = np.floor(cloud.gps_time / SETTINGS.moment)
        # alternating beams are slightly late
        is_open = np.abs(moment - np.floor(time / SETTINGS.moment)) <= 1
        self._cloud = cloud[is_open]
        self._number = number[is_open]
        rows = np.lexsort((moment, segment))
        rows = rows[~is_open[rows]]
        is_next = (np.diff(segment[rows]) != 0) | (np.diff(moment[rows]) != 0)
        for part in np.split(rows, np.flatnonzero(is_next) + 1):
            if len(part):
                yield int(segment[part[0]]), cloud[part], number[part]
