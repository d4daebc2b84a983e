"""Pass 1 over the cloud: keep the points near control points, whatever the file's size."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numba import njit
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from mlscorr.matching import SETTINGS as MATCHING
from mlscorr.survey import ControlPoints, PointCloud, Survey
from mlscorr.targets.settings import SETTINGS

NO_POINTS = PointCloud(np.empty((0, 3)), np.empty(0), np.empty(0, np.uint16))


@dataclass(frozen=True)
class Candidates:
    """Points near control points.

    Parameters
    ----------
    cloud : PointCloud
    pass_number : (n,) int array
        Of each point. A pass starts with each file and at each gap of the trajectory; passes count
        from 1 in time.
    unplaced : PointCloud
        Those that have no pose.
    passes : dict
        Numbers of passes by (number of the file, segment of the trajectory).
    starts : dict
        When these begin, likewise. Units: s.
    """

    cloud: PointCloud
    pass_number: np.ndarray
    unplaced: PointCloud
    passes: dict[tuple[int, int], int]
    starts: dict[tuple[int, int], float] = field(default_factory=dict)


def search_radius(survey: Survey, points: ControlPoints) -> np.ndarray:
    """Radius (n,) about surveyed points in which their images must lie. Units: m.

    The survey's, and the target's own half diagonal.

    Parameters
    ----------
    survey : Survey
    points : ControlPoints
    """
    return survey.search_radius + points.size / np.sqrt(2)


def collect(
    survey: Survey,
    read: Callable,
    progress: Callable | None = None,
    finished: Callable | None = None,
) -> Candidates:
    """Stream a survey's cloud files and keep the points near its surveyed points.

    Parameters
    ----------
    survey : Survey
    read : function of a CloudFile
        Gives an iterator of PointCloud.
    progress : function of a number of points, optional
    finished : function, optional
        ``finished(file, cloud, segment, since)`` is given the number of a file, points of it near
        control points, and the segment of the trajectory of each, when the file has ended, or
        earlier, where many points are held, those near control points that were passed. What it
        will still be given of the file so far is not older than since (s). Points that it was
        given are not kept: memory does not grow with the files, as long as their points come about
        in order of time.
    """
    trajectory, points = survey.trajectory, survey.surveyed
    near = Neighbourhoods(points.position, search_radius(survey, points))
    kept, numbers, unplaced, starts = [NO_POINTS], [np.empty((0, 2), int)], [NO_POINTS], {}
    for number, file in enumerate(survey.clouds):
        held, segments, limit = NO_POINTS, np.empty(0, int), SETTINGS.held_points
        for chunk in read(file):
            segment = trajectory.segment(chunk.gps_time)
            for part in np.unique(segment[segment >= 0]).tolist():
                start = chunk.gps_time[segment == part].min()
                starts[number, part] = min(starts.get((number, part), np.inf), start)
            rows = near.contains(chunk.xyz)
            has_pose = segment[rows] >= 0
            held = PointCloud.concatenate([held, chunk[rows[has_pose]]])
            segments = np.append(segments, segment[rows[has_pose]])
            unplaced.append(chunk[rows[~has_pose]])
            if finished is not None and len(held) > limit:
                passed = near.passed(held, chunk.gps_time.max() - MATCHING.pause)
                late = held[~passed]
                since = late.gps_time.min(initial=chunk.gps_time.max())
                finished(number, held[passed], segments[passed], since)
                held, segments = late, segments[~passed]
                limit = max(SETTINGS.held_points, 2 * len(held))
            if progress is not None:
                progress(len(chunk))
        if finished is not None:
            finished(number, held, segments, np.inf)
        else:
            kept.append(held)
            numbers.append(np.column_stack([np.full(len(segments), number), segments]))
    passes = number_passes(starts)
    keys = map(tuple, np.concatenate(numbers).tolist())
    pass_number = np.array([passes[key] for key in keys], int)
    clouds = map(PointCloud.concatenate, (kept, unplaced))
    return Candidates(next(clouds), pass_number, next(clouds), passes, starts)


def number_passes(starts: dict[tuple[int, int], float]) -> dict[tuple[int, int], int]:
    """Numbers of passes from 1 in time, by (number of the file, segment of the trajectory).

    Parameters
    ----------
    starts : dict
        When each begins. Units: s.
    """
    return {key: i for i, key in enumerate(sorted(starts, key=starts.get), start=1)}


class Neighbourhoods:
    """Balls about places: a raster of their squares first, then exact distances.

    Parameters
    ----------
    position : (b, 3) array
        Units: m.
    radius : (b,) array
        Units: m.
    """

    def __init__(self, position: np.ndarray, radius: np.ndarray):
        self.position, self.radius = position, radius
        if len(position) == 0:
            self.low, self.cell, self.mask = np.zeros(2), 1.0, np.zeros((0, 0), bool)
            return
        self.low = (position[:, :2] - radius[:, None]).min(axis=0)
        extent = (position[:, :2] + radius[:, None]).max(axis=0) - self.low
        self.cell = max(1.0, float(np.sqrt(extent.prod() / SETTINGS.held_points)))
        self.mask = np.zeros(np.ceil(extent / self.cell).astype(int) + 1, dtype=bool)
        first = np.floor((position[:, :2] - self.low - radius[:, None]) / self.cell).astype(int)
        last = np.floor((position[:, :2] - self.low + radius[:, None]) / self.cell).astype(int) + 1
        for (west, south), (east, north) in zip(first.clip(0), last, strict=True):
            self.mask[west:east, south:north] = True

    def contains(self, xyz: np.ndarray) -> np.ndarray:
        """Rows (k,) of the points in any ball, in order.

        Parameters
        ----------
        xyz : (n, 3) array
            Units: m.
        """
        return np.unique(np.concatenate([np.empty(0, int), *self.each(xyz)]))

    def each(self, xyz: np.ndarray) -> list[np.ndarray]:
        """Rows of the points within each ball, in order.

        Parameters
        ----------
        xyz : (n, 3) array
            Units: m.
        """
        rows = _rows_in_mask(xyz, self.low, self.cell, self.mask)
        if len(rows) == 0:
            return [np.empty(0, int)] * len(self.position)
        near = cKDTree(xyz[rows]).query_ball_point(self.position, self.radius, return_sorted=True)
        return [rows[np.asarray(part, int)] for part in near]

    def passed(self, cloud: PointCloud, before: float) -> np.ndarray:
        """Points (n,) in balls that no later point is in, nor in balls that overlap with these.

        Parameters
        ----------
        cloud : PointCloud
        before : float
            Time from which on a point is later. Units: s.
        """
        pairs = cKDTree(self.position).query_pairs(2 * self.radius.max(), output_type="ndarray")
        apart = np.linalg.norm(np.diff(self.position[pairs], axis=1)[:, 0], axis=1)
        pairs = pairs[apart < self.radius[pairs].sum(axis=1)].T
        graph = coo_array((np.ones(pairs.shape[1], bool), pairs), shape=(len(self.position),) * 2)
        groups = connected_components(graph, directed=False)[1]
        group = np.zeros(len(cloud), int)
        for label, rows in zip(groups, self.each(cloud.xyz), strict=True):
            group[rows] = label
        latest = np.full(len(groups), -np.inf)
        np.maximum.at(latest, group, cloud.gps_time)
        return latest[group] < before


@njit(cache=True)
def _rows_in_mask(xyz, low, cell, mask):
    """Rows (k,) of the points whose cell of a horizontal raster is marked."""
    rows, count = np.empty(len(xyz), np.int64), 0
    for i in range(len(xyz)):
        x, y = (xyz[i, 0] - low[0]) / cell, (xyz[i, 1] - low[1]) / cell
        inside = x >= 0 and y >= 0 and x < mask.shape[0] and y < mask.shape[1]
        if inside and mask[int(x), int(y)]:
            rows[count] = i
            count += 1
    return rows[:count].copy()
