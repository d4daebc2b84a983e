"""What is kept of a cloud while it is read, so that its channels can be compared.

Cells of space and time hold how many points there are, how bright, how far, how steep. Their sums
add up over chunks. Which blocks of the ground are kept a hash of their place tells: the same in all
clouds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from mlscorr.gap.contrast._edges import EdgeCollector, Edges
from mlscorr.gap.contrast._settings import SETTINGS
from mlscorr.gap.residuals import SETTINGS as OBSERVE
from mlscorr.gap.residuals import (
    Patches,
    block_chance,
    cell_corner,
    chance,
    place_key,
    scanner_origin,
)
from mlscorr.survey import Columns, PointCloud, Survey
from mlscorr.targets import NO_POINTS

PRODUCTS = tuple(zip(*np.triu_indices(3), strict=True))  # of two axes, in a symmetric matrix


@dataclass(frozen=True)
class ChannelSample:
    """A bounded part of a cloud.

    Parameters
    ----------
    cells : Cells
    share : float
        Of the ground, of which all cells are there.
    edges : Edges
    edge_share : float
        Of the moments, of which all edges are there.
    points : PointCloud
        Of whole cells.
    point_share : float
        Of all cells, whose points are there.
    patches : Patches or None
    """

    cells: Cells
    share: float
    edges: Edges
    edge_share: float
    points: PointCloud
    point_share: float
    patches: Patches | None = None

    @property
    def has_intensity(self) -> bool:
        """Whether its intensities tell anything: some differ."""
        return len(self.points) > 0 and bool(np.ptp(self.points.intensity) > 0)


def of_shared_moments(samples: Sequence[ChannelSample]) -> list[ChannelSample]:
    """The samples at moments in which all of them have points: a cloud may be of a part of a drive.

    Parameters
    ----------
    samples : sequence of ChannelSample
    """
    moments = reduce(np.intersect1d, (sample.cells.moment for sample in samples))

    def has(time):
        return np.isin(np.floor(time / OBSERVE.moment) * OBSERVE.moment, moments)

    return [
        replace(
            sample,
            cells=sample.cells[has(sample.cells.moment)],
            edges=sample.edges[has(sample.edges.gps_time)],
            points=sample.points[has(sample.points.gps_time)],
        )
        for sample in samples
    ]


class SampleCollector:
    """Keeps a ChannelSample of the chunks that it is given.

    Parameters
    ----------
    survey : Survey
    """

    def __init__(self, survey: Survey):
        self._cells, self._edges = CellCollector(survey), EdgeCollector(survey)

    def add(self, chunk: PointCloud) -> None:
        """Take what it needs of a chunk."""
        self._cells.add(chunk)
        self._edges.add(chunk)

    def sample(self, patches: Patches | None) -> ChannelSample:
        """The ChannelSample of all chunks so far.

        Parameters
        ----------
        patches : Patches or None
            Of the same chunks.
        """
        cells = self._cells
        edges = self._edges
        return ChannelSample(
            cells.cells(),
            cells.share,
            edges.edges(),
            edges.share,
            cells.points(),
            cells.point_share,
            patches,
        )


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
