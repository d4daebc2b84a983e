"""Moments of the points in cells of space and time, summed while a cloud streams.

The sums refer to the middle of each cell, so that no digits are lost at UTM coordinates.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mlscorr.compiled_loops import loop
from mlscorr.surfaces.places import block_chance, place_key
from mlscorr.surfaces.settings import SETTINGS
from mlscorr.survey import Columns, PointCloud

EMPTY = -1
CELL_BITS = 21  # bits of a key for each axis: a million cells to each side of the origin
GROUP_BITS = 24  # bits of a key for the group, below the number of the moment
# Columns of the moments of a cell:
#  0     number of points
#  1     sum of the times since the cell's moment began (s)
#  2-4   sums of x, y, z from the middle (m)
#  5-10  sums of xx, xy, xz, yy, yz, zz (m^2)
# 11     number of points that follow another one of the cell
# 12-17  sums of the products 5-10 of the steps from that one (m^2)
# 18-20  sums of the times' products with x, y, z (m s)
# 21     sum of a value of each point, if any
COLUMNS = 22
ROW_AXES, COLUMN_AXES = np.triu_indices(3)  # of the products: xx, xy, xz, yy, yz, zz
ALWAYS = np.array([[-np.inf, np.inf]])  # s: a single segment, of all times
NO_VALUES = np.empty(0)


@dataclass(frozen=True, eq=False, repr=False)
class Cells(Columns):
    """Cells of space and time, with the moments of their points.

    Parameters
    ----------
    middle : (n, 3) array
        Units: m.
    begin : (n,) array
        Start of their moments. Units: s.
    group : (n,) int array
        Group of the file and the trajectory's segment.
    moments : (n, 22) array
        Sums over the points about the middle and the beginning; see the columns above.
    """

    middle: np.ndarray
    begin: np.ndarray
    group: np.ndarray
    moments: np.ndarray

    @property
    def points(self) -> np.ndarray:
        """Number of points (n,)."""
        return self.moments[:, 0]

    @property
    def gps_time(self) -> np.ndarray:
        """Mean of the points (n,). Units: s."""
        return self.begin + self.moments[:, 1] / self.points

    @property
    def offset(self) -> np.ndarray:
        """Mean of the points (n, 3), from the middle of the cell. Units: m."""
        return self.moments[:, 2:5] / self.points[:, None]

    @property
    def centre(self) -> np.ndarray:
        """Mean of the points (n, 3). Units: m."""
        return self.middle + self.offset

    @property
    def covariance(self) -> np.ndarray:
        """Covariance of the points (n, 3, 3). Units: m^2."""
        return covariances(self.moments)

    @property
    def value(self) -> np.ndarray:
        """Mean of the points' values (n,)."""
        return self.moments[:, 21] / self.points

    @property
    def key(self) -> np.ndarray:
        """Key (n,) of the position and moment, the same in all clouds (see place_key)."""
        return place_key(self.middle, self.begin)

    @property
    def chance(self) -> np.ndarray:
        """Random number (n,) of the ground block, from 0 to 1."""
        return block_chance(self.middle)


def covariances(moments: np.ndarray) -> np.ndarray:
    """Covariances (n, 3, 3) of the points of cells; zero without points. Units: m^2.

    Parameters
    ----------
    moments : (n, 22) array
    """
    count = np.maximum(moments[:, :1], 1.0)
    mean = moments[:, 2:5] / count
    return _symmetric(moments[:, 5:11] / count - mean[:, ROW_AXES] * mean[:, COLUMN_AXES])


def neighbour_covariances(moments: np.ndarray) -> np.ndarray:
    """Noise covariances (n, 3, 3) of the points of cells, from consecutive points. Units: m^2.

    They are half the mean product of differences, because the surface is common to neighbors.

    Parameters
    ----------
    moments : (n, 22) array
    """
    return _symmetric(moments[:, 12:18] / np.maximum(2 * moments[:, 11:12], 1.0))


def _symmetric(products):
    matrix = np.empty((len(products), 3, 3))
    matrix[:, ROW_AXES, COLUMN_AXES] = matrix[:, COLUMN_AXES, ROW_AXES] = products
    return matrix


@loop(inline="always")
def _slot_of(cell, moment, table, keys):
    """Slot of a key, or a free slot for it, in an open hash table whose size is a power of two."""
    mask = len(table) - 1
    mixed = (cell ^ (moment * np.int64(0x2545F4914F6CDD1D))) * np.int64(-7046029254386353131)
    slot = (mixed ^ (mixed >> 29)) & mask
    while table[slot] != EMPTY:
        row = table[slot]
        if keys[row, 0] == cell and keys[row, 1] == moment:
            break
        slot = (slot + 1) & mask
    return slot


@loop
def hash_rows(keys: np.ndarray, count: int, size: int) -> np.ndarray:
    """Make an open hash table of the first rows of keys.

    Parameters
    ----------
    keys : (k, 2) int array
    count : int
        Number of rows.
    size : int
        Size of the table, a power of two.
    """
    table = np.full(size, EMPTY, np.int64)
    for row in range(count):
        table[_slot_of(keys[row, 0], keys[row, 1], table, keys)] = row
    return table


@loop
def add_points(
    xyz: np.ndarray,
    gps_time: np.ndarray,
    values: np.ndarray,
    begin: int,
    grid: np.ndarray,
    passes: np.ndarray,
    group: int,
    starts: np.ndarray,
    table: np.ndarray,
    keys: np.ndarray,
    moments: np.ndarray,
    count: int,
    rows: np.ndarray,
) -> tuple[int, int]:
    """Add points to the moments of their cells, until all are added or no row is free.

    Parameters
    ----------
    xyz, gps_time : (n, 3), (n,) arrays
    values : (n,) or (0,) array
        Values to sum, if any.
    begin : int
        Index of the first point to add.
    grid : (6,) array
        Origin (m) and start (s) of the cells, their edge (m) and duration (s).
    passes : (s, 2) array
        Start and end of the trajectory's segments. Units: s.
    group : int
        Group of the first segment; the key of a cell contains group + segment.
    starts : (s,) array
        First time of each segment; updated.
    table, keys, moments : (t,), (k, 2), (k, 22) arrays
        Hash table, key and moments of each cell; updated.
    count : int
        Rows in use.
    rows : (n,) int array
        Row of each point's cell, to be filled; unchanged for points outside the segments.

    Returns
    -------
    begin, count : int
        Index of the first point that was not added, and the rows in use.
    """
    low = np.inf
    high = -np.inf
    segment = -1
    row = -1
    last_cell = np.int64(EMPTY)
    last_moment = np.int64(EMPTY)
    last_x = last_y = last_z = 0.0
    for i in range(begin, len(xyz)):
        time = gps_time[i]
        if not low <= time <= high:
            segment = np.searchsorted(passes[:, 0], time, side="right") - 1
            if segment < 0 or time > passes[segment, 1]:
                low = np.inf
                high = -np.inf
                last_moment = np.int64(EMPTY)
                continue
            low, high = passes[segment]
        starts[segment] = min(starts[segment], time)
        second = np.floor((time - grid[3]) / grid[5])
        moment = (np.int64(second) << GROUP_BITS) + group + segment
        cell, x, y, z = _split(xyz[i], grid)
        follows = cell == last_cell and moment == last_moment
        if not follows:
            slot = _slot_of(cell, moment, table, keys)
            if table[slot] == EMPTY:
                if count == len(keys):
                    return i, count
                table[slot] = count
                keys[count, 0] = cell
                keys[count, 1] = moment
                moments[count] = 0.0
                count += 1
            row = table[slot]
            last_cell = cell
            last_moment = moment
        rows[i] = row
        sums = moments[row]
        _add_point(sums, time - grid[3] - second * grid[5], x, y, z)
        if len(values) > 0:
            sums[21] += values[i]
        if follows:
            _add_difference(sums, x - last_x, y - last_y, z - last_z)
        last_x = x
        last_y = y
        last_z = z
    return len(xyz), count


@loop(inline="always")
def _split(place, grid):
    """Key of the cell that contains a position, and the offset (m) from its middle."""
    x = place[0] - grid[0]
    y = place[1] - grid[1]
    z = place[2] - grid[2]
    a = np.floor(x / grid[4])
    b = np.floor(y / grid[4])
    c = np.floor(z / grid[4])
    cell = (((np.int64(a) << CELL_BITS) + np.int64(b)) << CELL_BITS) + np.int64(c)
    x = x - (a + 0.5) * grid[4]
    y = y - (b + 0.5) * grid[4]
    z = z - (c + 0.5) * grid[4]
    return cell, x, y, z


@loop(inline="always")
def _add_point(sums, since, x, y, z):
    """Add a point, given relative to start and middle of its cell, to the cell's sums."""
    sums[0] += 1.0
    sums[1] += since
    sums[2] += x
    sums[3] += y
    sums[4] += z
    _add_products(sums, 5, x, y, z)
    sums[18] += since * x
    sums[19] += since * y
    sums[20] += since * z


@loop(inline="always")
def _add_difference(sums, x, y, z):
    """Add the step from the previous point."""
    sums[11] += 1.0
    _add_products(sums, 12, x, y, z)


@loop(inline="always")
def _add_products(sums, column, x, y, z):
    """Add xx, xy, xz, yy, yz, zz to the columns starting at one."""
    sums[column] += x * x
    sums[column + 1] += x * y
    sums[column + 2] += x * z
    sums[column + 3] += y * y
    sums[column + 4] += y * z
    sums[column + 5] += z * z


@loop
def add_near_planes(
    local: np.ndarray,
    since: np.ndarray,
    ends: np.ndarray,
    mean: np.ndarray,
    normal: np.ndarray,
    limit: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Moments of the points near the plane of their group.

    Parameters
    ----------
    local : (n, 3) array
        Points, group after group, relative to a nearby position. Units: m.
    since : (n,) array
        Time since the beginning of each group. Units: s.
    ends : (g + 1,) int array
        Start of each group, and end of the last one.
    mean, normal : (g, 3) arrays
        Point of each plane (m) and its normal.
    limit : (g,) array
        Largest distance from the plane. Units: m.

    Returns
    -------
    moments : (g, 22) array
        Two points are consecutive here if no other point of the group is between them.
    is_near : (n,) bool array
    """
    moments = np.zeros((len(limit), COLUMNS))
    is_near = np.zeros(len(local), np.bool_)
    for g in range(len(limit)):
        sums = moments[g]
        for i in range(ends[g], ends[g + 1]):
            x, y, z = local[i]
            height = (x - mean[g, 0]) * normal[g, 0]
            height += (y - mean[g, 1]) * normal[g, 1]
            height += (z - mean[g, 2]) * normal[g, 2]
            if abs(height) > limit[g]:
                continue
            is_near[i] = True
            _add_point(sums, since[i], x, y, z)
            if i > ends[g] and is_near[i - 1]:
                before = local[i - 1]
                _add_difference(sums, x - before[0], y - before[1], z - before[2])
    return moments, is_near


class CellTable:
    """Cells that may still receive points.

    Parameters
    ----------
    origin : (3,) array
        Corner of a cell, near the points. Units: m.
    start : float
        Start of the moments. Units: s.
    """

    def __init__(self, origin: np.ndarray, start: float = 0.0):
        self._grid = np.array([*origin, start, SETTINGS.cell, SETTINGS.moment])
        self.count = 0
        self.keys = np.empty((1 << 12, 2), np.int64)
        self.moments = np.empty((1 << 12, COLUMNS))
        self._table = hash_rows(self.keys, 0, 1 << 13)

    def add(
        self,
        cloud: PointCloud,
        passes: np.ndarray = ALWAYS,
        group: int = 0,
        starts: np.ndarray | None = None,
        values: np.ndarray = NO_VALUES,
    ) -> np.ndarray:
        """Add points to their cells.

        Parameters
        ----------
        cloud : PointCloud
        passes : (s, 2) array
            Start and end of the trajectory's segments; other points are ignored. Units: s.
        group : int
            Group of the first segment; a cell has group + segment.
        starts : (s,) array, optional
            First time of each segment; updated. Units: s.
        values : (n,) array, optional
            Values to sum in the cells.

        Returns
        -------
        (n,) int array
            Row of each point's cell, until cells are removed; -1 outside the segments.
        """
        if starts is None:
            starts = np.full(len(passes), np.inf)
        rows = np.full(len(cloud), EMPTY)
        begin = 0
        while True:
            begin, self.count = add_points(
                cloud.xyz,
                cloud.gps_time,
                values,
                begin,
                self._grid,
                passes,
                group,
                starts,
                self._table,
                self.keys,
                self.moments,
                self.count,
                rows,
            )
            if begin == len(cloud):
                return rows
            self.keys = np.concatenate([self.keys, np.empty_like(self.keys)])
            self.moments = np.concatenate([self.moments, np.empty_like(self.moments)])
            self._table = hash_rows(self.keys, self.count, 2 * len(self.keys))

    @property
    def moment(self) -> np.ndarray:
        """Index (count,) of each cell's moment."""
        return self.keys[: self.count, 1] >> GROUP_BITS

    def of(self, rows: np.ndarray | slice = slice(None)) -> Cells:
        """Return some cells, or all of them.

        Parameters
        ----------
        rows : (count,) bool array, optional
        """
        keys = self.keys[: self.count][rows]
        moments = self.moments[: self.count][rows]
        half = 1 << (CELL_BITS - 1)
        rest = keys[:, 0]
        cell = np.empty((len(keys), 3))
        for axis in (2, 1):
            cell[:, axis] = ((rest + half) & (2 * half - 1)) - half
            rest = (rest - cell[:, axis].astype(np.int64)) >> CELL_BITS
        cell[:, 0] = rest
        middle = self._grid[:3] + (cell + 0.5) * self._grid[4]
        begin = self._grid[3] + (keys[:, 1] >> GROUP_BITS) * self._grid[5]
        return Cells(middle, begin, keys[:, 1] & ((1 << GROUP_BITS) - 1), moments)

    def remove(self, rows: np.ndarray) -> None:
        """Remove cells to make room for others.

        Parameters
        ----------
        rows : (count,) bool array
        """
        rest = np.flatnonzero(~rows)
        self.keys[: len(rest)] = self.keys[rest]
        self.moments[: len(rest)] = self.moments[rest]
        self.count = len(rest)
        self._table = hash_rows(self.keys, self.count, 2 * len(self.keys))
