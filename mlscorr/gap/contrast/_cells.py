"""A cloud as cells of space and time: how many points, how bright, how far, how steep.

The sums of a cell add up over chunks, so that a cell that two of them share is whole in the end.
Which blocks of the ground are kept a hash of their place tells: the same in all clouds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mlscorr.gap.contrast._settings import SETTINGS
from mlscorr.gap.residuals import SETTINGS as OBSERVE
from mlscorr.gap.residuals import block_chance, cell_corner, chance, place_key, scanner_origin
from mlscorr.survey import Columns, PointCloud, Survey
from mlscorr.targets import NO_POINTS

PRODUCTS = tuple(zip(*np.triu_indices(3), strict=True))  # of two axes, in a symmetric matrix


@dataclass(frozen=True, repr=False)
class Cells(Columns):
    """Cells of a cloud, in the order of their keys.

    Parameters
    ----------
    key : (c,) uint64 array
        The same for the same place and moment in all clouds.
    chance : (c,) array
        Of the block of the ground, from 0 to 1.
    corner : (c, 3) array
        Units: m.
    moment : (c,) array
        When it begins. Units: s.
    sums : (c, 12) array
        Over the points: 1, time since the moment (s), place from the corner (m), its six products
        (m^2), log10 of the intensity.
    """

    key: np.ndarray
    chance: np.ndarray
    corner: np.ndarray
    moment: np.ndarray
    sums: np.ndarray

    @property
    def points(self) -> np.ndarray:
        """Number of points (c,)."""
        return self.sums[:, 0]

    @property
    def centre(self) -> np.ndarray:
        """Mean of the points (c, 3). Units: m."""
        return self.corner + self.sums[:, 2:5] / self.points[:, None]

    @property
    def brightness(self) -> np.ndarray:
        """Mean log10 of the intensity (c,), in counts."""
        return self.sums[:, 11] / self.points

    @property
    def scatter(self) -> np.ndarray:
        """Sums of products (c, 3, 3) about the mean. Units: m^2."""
        mean = self.sums[:, 2:5] / self.points[:, None]
        matrix = np.empty((len(self), 3, 3))
        for column, (i, j) in enumerate(PRODUCTS, start=5):
            about = self.sums[:, column] - self.points * mean[:, i] * mean[:, j]
            matrix[:, i, j] = matrix[:, j, i] = about
        return matrix

    def sight(self, survey: Survey) -> np.ndarray:
        """From the scanner to the centre (c, 3), at the mean time of the points. Units: m.

        Parameters
        ----------
        survey : Survey
        """
        time = self.moment + self.sums[:, 1] / self.points
        segment = survey.trajectory.segment(time)
        first, last = survey.trajectory.passes[np.maximum(segment, 0)].T
        return self.centre - scanner_origin(survey, np.clip(time, first, last))

    def merged(self) -> Cells:
        """The same with one row each cell."""
        cells = self[np.argsort(self.key, kind="stable")]
        first = np.flatnonzero(np.append(True, np.diff(cells.key) != 0)[: len(cells)])
        if len(cells):
            sums = np.add.reduceat(cells.sums, first)
        else:
            sums = cells.sums
        return Cells(
            cells.key[first], cells.chance[first], cells.corner[first], cells.moment[first], sums
        )


class CellCollector:
    """Keeps about `limit` cells of the chunks that it is given, and all points of some of them.

    Parameters
    ----------
    survey : Survey
    limit, points : int
        Cells, and points, at most.
    """

    def __init__(
        self, survey: Survey, limit: int = SETTINGS.kept, points: int = SETTINGS.distance_points
    ):
        self._survey = survey
        self._limit = limit
        self._most_points = points
        self._cells = cells_of(NO_POINTS, 1.0)
        self._points = [NO_POINTS]
        self.share = self.point_share = 1.0

    def add(self, chunk: PointCloud) -> None:
        """Take the cells of a chunk."""
        inside = chunk[self._survey.trajectory.segment(chunk.gps_time) >= 0]
        self._cells = Cells.concatenate([self._cells, cells_of(inside, self.share)]).merged()
        while len(self._cells) > self._limit:
            self.share /= 2
            self._cells = self._cells[self._cells.chance < self.share]
        self._points.append(sampled(inside, self.point_share))
        while sum(map(len, self._points)) > self._most_points:
            self.point_share /= 2
            self._points = [sampled(part, self.point_share) for part in self._points]

    def cells(self) -> Cells:
        """Cells of all chunks so far."""
        return self._cells

    def points(self) -> PointCloud:
        """All points of the cells whose points are kept."""
        return PointCloud.concatenate(self._points)


def sampled(cloud: PointCloud, share: float) -> PointCloud:
    """The points of a share of all cells: whole cells, the same in all clouds.

    Parameters
    ----------
    cloud : PointCloud
    share : float
    """
    if share >= 1:
        return cloud
    return cloud[chance(place_key(cloud.xyz, cloud.gps_time)) < share]


def cells_of(cloud: PointCloud, share: float) -> Cells:
    """Cells of a cloud in a share of the blocks of the ground.

    Parameters
    ----------
    cloud : PointCloud
    share : float
    """
    block = block_chance(cloud.xyz)
    if share < 1:
        cloud = cloud[block < share]
        block = block[block < share]
    key = place_key(cloud.xyz, cloud.gps_time)
    order = np.argsort(key, kind="stable")
    key = key[order]
    first = np.flatnonzero(np.append(True, np.diff(key) != 0)[: len(key)])
    xyz = cloud.xyz[order]
    time = cloud.gps_time[order]
    corner = cell_corner(xyz[first])
    moment = np.floor(time[first] / OBSERVE.moment) * OBSERVE.moment
    count = np.diff(np.append(first, len(key)))
    local = xyz - np.repeat(corner, count, axis=0)
    counts = np.log10(np.maximum(cloud.intensity[order].astype(float), 1.0))
    columns = [np.ones(len(key)), time - np.repeat(moment, count), *local.T]
    columns += [local[:, i] * local[:, j] for i, j in PRODUCTS] + [counts]
    table = np.column_stack(columns)
    if len(first):
        sums = np.add.reduceat(table, first)
    else:
        sums = np.empty((0, len(columns)))
    return Cells(key[first], block[order][first], corner, moment, sums)
