"""As much of a cloud as pictures of it need, gathered in one pass and in flat memory."""

from dataclasses import dataclass

import numpy as np

from mlscorr.survey import PointCloud

MOST = 1_000_000  # points of each part; up to twice as many while they are gathered
CELL = 2.0  # m, of the plan grid that tells which points are near a target
REACH = 4.0  # times half of what a close-up of a target shows: it is seen from aside, too
PIECE = 250_000  # points that are worked on at once


@dataclass(frozen=True)
class Sample:
    """Every step-th point of a cloud, and where step > 1 all points near some targets, too."""

    cloud: PointCloud
    step: int

    def pieces(self):
        """The points in pieces."""
        for first in range(0, len(self.cloud), PIECE):
            yield self.cloud[first : first + PIECE]


def gather(chunks, targets, most=MOST):
    """The Sample of a cloud that is streamed as chunks.

    Parameters
    ----------
    chunks : iterable of PointCloud
    targets : list of dict
        Rows as report.json has them, of the targets near which points are kept.
    most : int
        Of the points spread over the cloud, and of those near the targets: at most twice as many.
    """
    cells = _cells(targets)
    kept, steps, seen = ([], []), [1, 1], [0, 0]
    for chunk in chunks:
        for k, part in enumerate((chunk, chunk[_near(chunk, cells)])):
            picked = part[-seen[k] % steps[k] :: steps[k]]
            kept[k].append(PointCloud.concatenate([picked]))  # a copy, or all would stay in memory
            seen[k] += len(part)
            while sum(map(len, kept[k])) > 2 * most:
                steps[k] *= 2
                kept[k][:] = [PointCloud.concatenate(kept[k])[::2]]
    return Sample(PointCloud.concatenate(kept[0] + (kept[1] if steps[0] > 1 else [])), steps[0])


def _cells(targets):
    """Sorted numbers of the plan cells about the targets."""
    cells = [np.empty(0, np.int64)]
    for row in targets:
        half = np.linalg.norm(row["before"]) / 2 + 1.0  # m: no target is so large
        middle = (np.array(row["surveyed"]) + row["observed"])[:2] / 2
        low, high = (np.floor((middle + s * REACH * half) / CELL).astype(int) for s in (-1, 1))
        columns, rows = (np.arange(a, b + 1) for a, b in zip(low, high, strict=True))
        cells.append(_number(*np.meshgrid(columns, rows)).ravel())
    return np.unique(np.concatenate(cells))


def _number(column, row):
    """One number for each cell."""
    return column * (1 << 31) + row


def _near(chunk, cells):
    """Which points lie in the cells (sorted)."""
    if len(cells) == 0:
        return np.zeros(len(chunk), bool)
    columns, rows = (np.floor(chunk.xyz[:, k] / CELL).astype(np.int64) for k in (0, 1))
    number = _number(columns, rows)
    place = np.minimum(np.searchsorted(cells, number), len(cells) - 1)
    return cells[place] == number
