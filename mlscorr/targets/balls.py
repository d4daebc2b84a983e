"""Balls about places and the points of a cloud in each, by a raster of what reaches where."""

import numpy as np
from numba import njit

from mlscorr.io import SETTINGS as IO


class Neighbourhoods:
    """Balls about places: a raster of what reaches their squares first, then exact distances.

    Parameters
    ----------
    position : (b, 3) array
        Units: m.
    radius : (b,) array
        Units: m.
    """

    def __init__(self, position: np.ndarray, radius: np.ndarray):
        self.position = np.ascontiguousarray(position, float)
        self.radius = radius
        margin = radius[:, None] * (1 + 1e-9)  # distances alone decide, not what is rounded here
        ends = [self.position[:, :2] + sign * margin for sign in (-1, 1)]
        low = ends[0].min(axis=0, initial=np.inf)
        extent = ends[1].max(axis=0, initial=-np.inf) - low
        edge = max(1.0, float(np.sqrt(max(extent.prod(), 0.0) / IO.chunk_points)))
        first, last = (np.floor((end - low) / edge).astype(int) for end in ends)
        shape = last.max(axis=0, initial=-1) + 1
        self._raster = low, edge, shape, *_reaching(first, last, shape)

    def __getitem__(self, numbers: np.ndarray) -> "Neighbourhoods":
        return Neighbourhoods(self.position[numbers], self.radius[numbers])

    def contains(self, xyz: np.ndarray) -> np.ndarray:
        """Rows (k,) of the points in any ball, in order.

        Parameters
        ----------
        xyz : (n, 3) array
            Units: m.
        """
        return np.flatnonzero(np.bincount(np.concatenate([np.empty(0, int), *self.each(xyz)])))

    def each(self, xyz: np.ndarray) -> list[np.ndarray]:
        """Rows of the points within each ball, in order.

        Parameters
        ----------
        xyz : (n, 3) array
            Units: m.
        """
        balls = self._raster, self.position, self.radius**2
        xyz = np.ascontiguousarray(xyz)
        counts = np.zeros(len(self.position), int)
        _enter(xyz, *balls, counts, np.empty(0, int))
        ends = np.cumsum(counts)
        rows = np.empty(counts.sum(), int)
        _enter(xyz, *balls, ends - counts, rows)
        if len(ends):
            return np.split(rows, ends[:-1])
        return []


def _reaching(first, last, shape):
    """Numbers of the balls that reach each cell, cell by cell, and where those of a cell start."""
    cells = [
        np.arange(x, east + 1)[:, None] * shape[1] + np.arange(y, north + 1)
        for (x, y), (east, north) in zip(first, last, strict=True)
    ]
    ball = np.repeat(np.arange(len(cells)), [part.size for part in cells])
    cell = np.concatenate([np.empty(0, int), *map(np.ravel, cells)])
    starts = np.concatenate([[0], np.cumsum(np.bincount(cell, minlength=shape.prod()))])
    return starts, ball[np.argsort(cell, kind="stable")]


@njit(cache=True)
def _enter(xyz, raster, position, squares, free, rows):
    """Enter the row of each point at the free place of each ball it is in, or count them alone
    where there is no room.
    """
    low, edge, shape, starts, balls = raster
    for i in range(len(xyz)):
        x = (xyz[i, 0] - low[0]) / edge
        y = (xyz[i, 1] - low[1]) / edge
        if not (x >= 0 and y >= 0 and x < shape[0] and y < shape[1]):
            continue
        cell = int(x) * shape[1] + int(y)
        for k in range(starts[cell], starts[cell + 1]):
            ball = balls[k]
            apart = 0.0
            for axis in range(3):
                apart += (xyz[i, axis] - position[ball, axis]) ** 2
            if apart <= squares[ball]:
                if len(rows) > 0:
                    rows[free[ball]] = i
                free[ball] += 1
