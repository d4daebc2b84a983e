"""Pass 1 over the cloud: keep the points near control points, whatever the file's size."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from mlscorr.survey import PointCloud

MINIMUM_RADIUS = 2.0  # m: a POS that states less than it errs (datum, mounting) is still found
SIGMAS = 4.0  # of the stated position sigma
REACH = 150.0  # m: scanners on vehicles see no target farther away
RASTER_CELLS = 4_000_000  # of the coarse first cut, one byte each
NO_POINTS = PointCloud(np.empty((0, 3)), np.empty(0), np.empty(0))


@dataclass(frozen=True)
class Candidates:
    """Points near control points, with the number of the file and of the trajectory segment.

    unplaced are those points near control points that have no pose.
    """

    cloud: PointCloud
    file: np.ndarray
    segment: np.ndarray
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
    clouds_near, files, segments, unplaced = [NO_POINTS], [], [], [NO_POINTS]
    for number, file in enumerate(clouds):
        for chunk in read_chunks(file):
            kept = chunk[near.contains(chunk.xyz)]
            segment = trajectory.segment(kept.gps_time)
            placed = segment >= 0
            clouds_near.append(kept[placed])
            unplaced.append(kept[~placed])
            files.append(np.full(placed.sum(), number))
            segments.append(segment[placed])
            if progress is not None:
                progress(len(chunk))
    return Candidates(
        PointCloud.concatenate(clouds_near),
        np.concatenate([np.empty(0, int), *files]),
        np.concatenate([np.empty(0, int), *segments]),
        PointCloud.concatenate(unplaced),
    )


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
