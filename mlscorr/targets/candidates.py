"""Pass 1 over the cloud: keep the points near control points, whatever the file's size."""

from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from mlscorr.matching import LARGEST_GATE
from mlscorr.survey import PointCloud

MINIMUM_RADIUS = 2.0  # m: a POS that states less than it errs (datum, mounting) is still found
SIGMAS = 4.0  # of the stated position sigma
REACH = 150.0  # m: scanners on vehicles see no target farther away
RASTER_CELLS = 4_000_000  # of the coarse first cut, one byte each
HELD = 1_000_000  # points near control points, before those that were passed are handed on
PAUSE = 2.0  # s without a point: the vehicle came by twice
NO_POINTS = PointCloud(np.empty((0, 3)), np.empty(0), np.empty(0, np.uint16))


@dataclass(frozen=True)
class Candidates:
    """Points near control points, with the pass of each; unplaced are those that have no pose.

    A pass starts with each file and at each gap of the trajectory; passes count from 1 in time,
    and passes gives their numbers by (number of the file, segment of the trajectory).
    """

    cloud: PointCloud
    pass_number: np.ndarray
    unplaced: PointCloud
    passes: dict[tuple[int, int], int]


def search_radius(trajectory, control):
    """Radius (n,) in m about each control point in which its image must lie.

    The largest stated sigma of the trajectory within reach times four, at least two metres and
    at most the largest gate of the matching, and the target's own half diagonal.
    """
    half = control.size / np.sqrt(2)
    if trajectory.position_sigma is None:
        return half + MINIMUM_RADIUS
    sigma = np.linalg.norm(trajectory.position_sigma, axis=1)
    thin = max(1, len(trajectory) // 20_000)
    tree = cKDTree(trajectory.position[::thin, :2])
    near = tree.query_ball_point(control.position[:, :2], REACH)
    largest = np.array([sigma[::thin][rows].max(initial=0.0) for rows in near])
    return half + np.clip(SIGMAS * largest, MINIMUM_RADIUS, LARGEST_GATE)


def collect(clouds, trajectory, control, read_chunks, progress=None, finished=None):
    """Stream cloud files and keep the points near control points.

    Parameters
    ----------
    clouds : sequence of CloudFile
    trajectory : Trajectory
    control : ControlPoints
        Control and check points together.
    read_chunks : function of a CloudFile
        Gives an iterator of PointCloud.
    progress : function of a number of points, optional
    finished : function, optional
        ``finished(file, cloud, segment)`` is given the number of a file, points of it near control
        points, and the segment of the trajectory of each, when the file has ended, or earlier,
        where more than a million points are held, those near control points that were passed.
        Points that it was given are not kept: memory does not grow with the files, as long as
        their points come about in order of time.

    Returns Candidates.
    """
    near = Neighbourhoods(control.position, search_radius(trajectory, control))
    kept, numbers, unplaced, starts = [NO_POINTS], [np.empty((0, 2), int)], [NO_POINTS], {}
    for number, file in enumerate(clouds):
        held, segments, limit = [NO_POINTS], [np.empty(0, int)], HELD
        for chunk in read_chunks(file):
            segment = trajectory.segment(chunk.gps_time)
            for one in np.flatnonzero(np.bincount(segment + 1, minlength=1)[1:]):
                start = chunk.gps_time[segment == one].min()
                starts[number, int(one)] = min(starts.get((number, int(one)), np.inf), start)
            rows = near.contains(chunk.xyz)
            has_pose = segment[rows] >= 0
            held.append(chunk[rows[has_pose]])
            segments.append(segment[rows[has_pose]])
            unplaced.append(chunk[rows[~has_pose]])
            if finished is not None and sum(map(len, held)) > limit:
                cloud, segment = PointCloud.concatenate(held), np.concatenate(segments)
                passed = near.passed(cloud, chunk.gps_time.max() - PAUSE)
                finished(number, cloud[passed], segment[passed])
                held, segments = [cloud[~passed]], [segment[~passed]]
                limit = max(HELD, 2 * len(held[0]))
            if progress is not None:
                progress(len(chunk))
        cloud, segment = PointCloud.concatenate(held), np.concatenate(segments)
        if finished is not None:
            finished(number, cloud, segment)
        else:
            kept.append(cloud)
            numbers.append(np.column_stack([np.full(len(segment), number), segment]))
    passes = {key: i for i, key in enumerate(sorted(starts, key=starts.get), start=1)}
    table = np.zeros((len(clouds), len(trajectory.gaps) + 1), int)
    for key, i in passes.items():
        table[key] = i
    pass_number = table[tuple(np.concatenate(numbers).T)]
    everything = PointCloud.concatenate(kept), pass_number, PointCloud.concatenate(unplaced)
    return Candidates(*everything, passes)


class Neighbourhoods:
    """Balls about control points: a raster of their squares first, then exact distances."""

    def __init__(self, position, radius):
        self.position, self.radius = position, radius
        if len(position) == 0:
            self.low, self.cell, self.mask = np.zeros(2), 1.0, np.zeros((0, 0), bool)
            return
        self.low = (position[:, :2] - radius[:, None]).min(axis=0)
        extent = (position[:, :2] + radius[:, None]).max(axis=0) - self.low
        self.cell = max(1.0, float(np.sqrt(extent.prod() / RASTER_CELLS)))
        self.mask = np.zeros(np.ceil(extent / self.cell).astype(int) + 1, dtype=bool)
        for centre, reach in zip(position[:, :2] - self.low, radius, strict=True):
            first = np.floor((centre - reach) / self.cell).astype(int).clip(0)
            last = np.floor((centre + reach) / self.cell).astype(int) + 1
            self.mask[first[0] : last[0], first[1] : last[1]] = True

    def contains(self, xyz):
        """Rows (k,) of the points within the radius of a control point, in order."""
        return np.unique(np.concatenate([np.empty(0, int), *self.each(xyz)]))

    def each(self, xyz):
        """Rows of the points within each ball, in order: a list of index arrays."""
        rows = _rows_in_mask(xyz, self.low, self.cell, self.mask)
        if len(rows) == 0:
            return [np.empty(0, int)] * len(self.position)
        near = cKDTree(xyz[rows]).query_ball_point(self.position, self.radius, return_sorted=True)
        return [rows[np.asarray(part, int)] for part in near]

    def passed(self, cloud, before):
        """Which points (n,) lie in balls without any point at or after a time (s), nor in balls
        that overlap with these."""
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
