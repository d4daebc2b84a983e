"""Sample of a cloud for pictures, collected in one pass with flat memory."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from mlscorr.evaluate import TargetRow
from mlscorr.io import SETTINGS as IO_SETTINGS
from mlscorr.report.settings import SETTINGS
from mlscorr.survey import PointCloud


class EvenSample:
    """Every step-th point; the step doubles if there are too many points.

    Parameters
    ----------
    limit : int
        Number of points kept; up to twice as many occur.
    """

    def __init__(self, limit: int):
        self.limit = limit
        self.step = 1
        self.count = 0
        self.parts = []

    def add(self, cloud: PointCloud) -> None:
        """Add the step-th points of a further part."""
        picked = cloud[-self.count % self.step :: self.step]
        self.parts.append(PointCloud.concatenate([picked]))  # a copy, or all would remain in memory
        self.count += len(cloud)
        while sum(map(len, self.parts)) > 2 * self.limit:
            self.step *= 2
            self.parts = _every_second(self.parts)


def _every_second(parts):
    """Every second point of parts as if they were one, copied."""
    halves = []
    first = 0
    for part in parts:
        halves.append(PointCloud.concatenate([part[-first % 2 :: 2]]))
        first += len(part)
    return halves


@dataclass(frozen=True)
class CloudSample:
    """Every step-th point of a cloud, and for step > 1 all points near targets and walls."""

    cloud: PointCloud
    step: int

    def chunks(self) -> Iterator[PointCloud]:
        """Yield the points in chunks, like those of a file."""
        for first in range(0, len(self.cloud), IO_SETTINGS.chunk_points):
            yield self.cloud[first : first + IO_SETTINGS.chunk_points]


class CloudSampler:
    """Collector of the sample of a cloud from chunks.

    Parameters
    ----------
    targets : list of TargetRow
        Targets near which points are kept.
    walls : (k, 3) array
        Further positions near which points are kept. Units: m.
    limit : int
        Number of points spread over the cloud, near targets, and near walls; at most twice as many.
    """

    def __init__(
        self, targets: list[TargetRow], walls: np.ndarray, limit: int = SETTINGS.sample_points
    ):
        self._regions = (_cells(targets), _about(walls, SETTINGS.plan_cell))
        self._cells = np.unique(np.concatenate(self._regions))
        self._spread = EvenSample(limit)
        self._near = [EvenSample(limit) for _ in self._regions]

    def add(self, chunk: PointCloud) -> None:
        """Add the relevant points of a chunk."""
        self._spread.add(chunk)
        number = _cell_numbers(chunk.xyz)
        rows = np.flatnonzero(_is_in(number, self._cells))
        for cells, sample in zip(self._regions, self._near, strict=True):
            sample.add(chunk[rows[_is_in(number[rows], cells)]])

    @property
    def sample(self) -> CloudSample:
        """Sample of all added chunks."""
        parts = [*self._spread.parts]
        if self._spread.step > 1:
            parts += [part for near in self._near for part in near.parts]
        return CloudSample(PointCloud.concatenate(parts), self._spread.step)


def gather(
    chunks: Iterable[PointCloud],
    targets: list[TargetRow],
    walls: np.ndarray,
    limit: int = SETTINGS.sample_points,
) -> CloudSample:
    """Collect the sample of a cloud that is streamed in chunks.

    Parameters
    ----------
    chunks : iterable of PointCloud
    targets, walls, limit
        See CloudSampler.
    """
    sampler = CloudSampler(targets, walls, limit)
    for chunk in chunks:
        sampler.add(chunk)
    return sampler.sample


def near_rows(xyz: np.ndarray, targets: list[TargetRow]) -> np.ndarray:
    """Rows of points (n, 3) that a close-up of a target may show.

    Parameters
    ----------
    xyz : (n, 3) array
        Units: m.
    targets : list of TargetRow
    """
    return np.flatnonzero(_is_in(_cell_numbers(xyz), _cells(targets)))


def _cells(targets):
    """Sorted numbers of the plan cells around the targets."""
    # four times half of a close-up's width, as it is oblique; no target is over 1 m
    radius = [2 * np.linalg.norm(row.before) + 4.0 for row in targets]
    middle = [(row.surveyed + row.observed) / 2 for row in targets]
    return _about(np.reshape(middle, (-1, 3)), np.array(radius)[:, None])


def _about(places, radius):
    """Sorted numbers of the plan cells within a radius of positions (n, 3) along both axes."""
    low, high = (
        np.floor((places[:, :2] + s * radius) / SETTINGS.plan_cell).astype(int) for s in (-1, 1)
    )
    cells = [[np.iinfo(np.int64).max]]  # is no cell, and ends any search
    for first, last in zip(low, high, strict=True):
        columns, rows = (np.arange(a, b + 1) for a, b in zip(first, last, strict=True))
        cells.append(_number(*np.meshgrid(columns, rows)).ravel())
    return np.unique(np.concatenate(cells))


def _number(column, row):
    """One number for each cell."""
    return column * (1 << 31) + row


def _cell_numbers(xyz):
    """Number of the plan cell of each point."""
    return _number(*np.floor(xyz[:, :2] / SETTINGS.plan_cell).astype(np.int64).T)


def _is_in(number, cells):
    """Flag of numbers that are among those of the cells (sorted)."""
    return cells[np.searchsorted(cells, number)] == number
