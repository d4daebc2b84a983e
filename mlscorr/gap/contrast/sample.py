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
    """A bounded part of a cloud.

    Parameters
    ----------
    cells : Cells
        In the order of their keys; the value of a point is log10 of its intensity in counts.
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
        self._table = CellTable(cell_corner(survey.trajectory.position[0]))
        self._points: BoundedChoice[PointCloud] = BoundedChoice(points)
        self.share = 1.0

    def add(self, chunk: PointCloud) -> None:
        """Take the cells of a chunk."""
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
        """Cells of all chunks so far, in the order of their keys."""
        cells = self._table.of()
        return cells[np.argsort(cells.key)]

    def points(self) -> PointCloud:
        """All points of the cells whose points are kept."""
        return PointCloud.concatenate([NO_POINTS, *self._points.parts()])

    @property
    def point_share(self) -> float:
        """Share of the cells whose points are kept."""
        return self._points.share


def sampled(cloud: PointCloud, share: float) -> PointCloud:
    """The points of a share of all cells: whole cells, the same in all clouds.

    Parameters
    ----------
    cloud : PointCloud
    share : float
    """
    if share >= 1:
        return cloud
    return cloud[cell_chance(cloud) < share]


def cell_chance(cloud: PointCloud) -> np.ndarray:
    """A number from 0 to 1 (n,) for the cell and moment of points, the same in all clouds.

    Parameters
    ----------
    cloud : PointCloud
    """
    return chance(place_key(cloud.xyz, cloud.gps_time))
