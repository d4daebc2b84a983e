"""What is kept of a cloud while it is read, so that its channels can be compared."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from mlscorr.gap.contrast._cells import CellCollector, Cells
from mlscorr.gap.contrast._edges import EdgeCollector, Edges
from mlscorr.gap.residuals import SETTINGS as OBSERVE
from mlscorr.gap.residuals import Patches
from mlscorr.survey import PointCloud, Survey


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
