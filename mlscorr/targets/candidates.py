"""Pass 1 over the cloud: keep the points near control points, whatever the file's size."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from mlscorr.survey import PointCloud

MINIMUM_RADIUS = 2.0  # m: a POS that states less than it errs (datum, mounting) is still found
SIGMAS = 4.0  # of the stated position sigma
REACH = 150.0  # m: scanners on vehicles see no target farther away
RASTER_CELLS = 4_000_000  # of the coarse first cut, one byte each
NO_POINTS = PointCloud(np.empty((0, 3)), np.empty(0), np.empty(0, np.uint16))


@dataclass(frozen=True)
class Candidates:
    """Points near control points, with the pass of each; unplaced are those that have no pose.

    A pass starts with each file and at each gap of the trajectory; passes count from 1 in time.
    """

    cloud: PointCloud
    pass_number: np.ndarray
    unplaced: PointCloud


def search_radius(trajectory, control):
    """Radius (n,) in m about each control point in which its image must lie.

    The largest stated sigma of the trajectory within reach times four, at least two metres, and
    the target's own half diagonal.
    """
    half = control.size / np.sqrt(2)
    if trajectory.position_sigma is None:
        return half + MINIMUM_RADIUS
    sigma = np.linalg.norm(trajectory.position_sigma, axis=1)
    thin = max(1, len(trajectory) // 20_000)
    tree = cKDTree(trajectory.position[::thin, :2])
    near = tree.query_ball_point(control.position[:, :2], REACH)
    largest = np.array([sigma[::thin][rows].max(initial=0.0) for rows in near])
    return half + np.maximum(MINIMUM_RADIUS, SIGMAS * largest)


def collect(clouds, trajectory, control, read_chunks, progress=None):
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

    Returns Candidates.
    """
    near = _Neighbourhood(control.position, search_radius(trajectory, control))
    placed, unplaced, keys, starts = [NO_POINTS], [NO_POINTS], [np.empty(0, int)], {}
    for number, file in enumerate(clouds):
        for chunk in read_chunks(file):
            segment = trajectory.segment(chunk.gps_time)
            key = np.where(segment < 0, -1, number * (len(trajectory.gaps) + 1) + segment)
            for one in np.unique(key[key >= 0]):
                starts[one] = min(starts.get(one, np.inf), chunk.gps_time[key == one].min())
            rows = near.contains(chunk.xyz)
            has_pose = key[rows] >= 0
            placed.append(chunk[rows[has_pose]])
            keys.append(key[rows[has_pose]])
            unplaced.append(chunk[rows[~has_pose]])
            if progress is not None:
                progress(len(chunk))
    return Candidates(
        PointCloud.concatenate(placed),
        _pass_numbers(np.concatenate(keys), starts),
        PointCloud.concatenate(unplaced),
    )


def _pass_numbers(keys, starts):
    """Number (n,) of the pass of each point, by the order of the passes' starts, from 1."""
    number = {key: i for i, key in enumerate(sorted(starts, key=starts.get), start=1)}
    return np.array([number.get(key, 0) for key in range(max(starts, default=0) + 1)])[keys]


class _Neighbourhood:
    """Balls about control points: a raster of their squares first, then exact distances."""

    def __init__(self, position, radius):
        self.position, self.radius = position, radius
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
        column = (xyz[:, :2] - self.low) / self.cell
        rows = np.flatnonzero(((column >= 0) & (column < self.mask.shape)).all(axis=1))
        index = column[rows].astype(int)
        rows = rows[self.mask[index[:, 0], index[:, 1]]]
        if len(rows) == 0:
            return rows
        near = cKDTree(xyz[rows]).query_ball_point(self.position, self.radius)
        return rows[np.unique(np.concatenate([np.asarray(part, int) for part in near]))]
