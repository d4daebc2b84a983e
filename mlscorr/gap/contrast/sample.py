"""Sample of a cloud for the comparison of channels, collected while it is read.

Cells of space and time contain number, brightness, range and incidence of points, as sums over
chunks. Ground blocks are selected by a hash of their position, which is the same in all clouds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from mlscorr.gap.contrast._edges import EdgeCollector, Edges
from mlscorr.gap.contrast._settings import SETTINGS
from mlscorr.gap.residuals import SETTINGS as OBSERVE
from mlscorr.gap.residuals import Patches
from mlscorr.surfaces import (
    BoundedChoice,
    Cells,
    CellTable,
    block_chance,
    cell_corner,
    chance,
    place_key,
)
from mlscorr.survey import PointCloud, Survey
from mlscorr.targets import NO_POINTS


@dataclass(frozen=True)
class ChannelSample:
    """Limited sample of a cloud.

    Parameters
    ----------
    cells : Cells
        In the order of their keys; the value of a point is log10 of its intensity in counts.
    share : float
        Share of the ground with all its cells.
    edges : Edges
    edge_share : float
        Share of the moments with all their edges.
    points : PointCloud
        Points of complete cells.
    point_share : float
        Share of all cells whose points are included.
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
        """True if intensities carry information, that is, some differ."""
        return len(self.points) > 0 and bool(np.ptp(self.points.intensity) > 0)


def of_shared_moments(samples: Sequence[ChannelSample]) -> list[ChannelSample]:
    """Restrict samples to moments with points in all of them, as a cloud may cover part of a drive.

    Parameters
    ----------
    samples : sequence of ChannelSample
    """
    moments = reduce(np.intersect1d, (sample.cells.begin for sample in samples))

    def has(time):
        return np.isin(np.floor(time / OBSERVE.moment) * OBSERVE.moment, moments)

    return [
        replace(
            sample,
            cells=sample.cells[has(sample.cells.begin)],
            edges=sample.edges[has(sample.edges.gps_time)],
            points=sample.points[has(sample.points.gps_time)],
        )
        for sample in samples
    ]


class SampleCollector:
    """Collector of a ChannelSample from chunks.

    Parameters
    ----------
    survey : Survey
    """

    def __init__(self, survey: Survey):
        self._cells, self._edges = CellCollector(survey), EdgeCollector(survey)

    def add(self, chunk: PointCloud) -> None:
        """Add a chunk."""
        self._cells.add(chunk)
        self._edges.add(chunk)

    def sample(self, patches: Patches | None) -> ChannelSample:
        """Return the ChannelSample of all chunks so far.

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


class CellCollector:
    """Collector of about `limit` cells of chunks, and of all points of some of them.

    Parameters
    ----------
    survey : Survey
    limit, points : int
        Largest numbers of cells and points.
    """

    def __init__(
        self, survey: Survey, limit: int = SETTINGS.kept, points: int = SETTINGS.distance_points
    ):
        self._survey = survey
        self._limit = limit
        self._table = CellTable(cell_corner(survey.trajectory.position[0]))
        self._points: BoundedChoice[PointCloud] = BoundedChoice(points)
        self.share = 1.0

    def add(self, chunk: PointCloud) -> None:
        """Add the cells of a chunk."""
        inside = chunk[self._survey.trajectory.segment(chunk.gps_time) >= 0]
        if self.share < 1:
            some = inside[block_chance(inside.xyz) < self.share]
        else:
            some = inside
        counts = np.maximum(some.intensity.astype(float), 1.0)
        self._table.add(some, values=np.log10(counts))
        while self._table.count > self._limit:
            self.share /= 2
            self._table.remove(self._table.of().chance >= self.share)
        self._points.add(inside, cell_chance(inside))

    def cells(self) -> Cells:
        """Return the cells of all chunks so far, in the order of their keys."""
        cells = self._table.of()
        return cells[np.argsort(cells.key)]

    def points(self) -> PointCloud:
        """Return all points of the cells whose points are kept."""
        return PointCloud.concatenate([NO_POINTS, *self._points.parts()])

    @property
    def point_share(self) -> float:
        """Share of the cells whose points are kept."""
        return self._points.share


def sampled(cloud: PointCloud, share: float) -> PointCloud:
    """Points of a share of all cells: complete cells, the same in all clouds.

    Parameters
    ----------
    cloud : PointCloud
    share : float
    """
    if share >= 1:
        return cloud
    return cloud[cell_chance(cloud) < share]


def cell_chance(cloud: PointCloud) -> np.ndarray:
    """Random number from 0 to 1 (n,) for the cell and moment of points, the same in all clouds.

    Parameters
    ----------
    cloud : PointCloud
    """
    return chance(place_key(cloud.xyz, cloud.gps_time))
