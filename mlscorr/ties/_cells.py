"""Moments of the points in cells of space and time, summed while a cloud streams.

The sums are about the middle of each cell, so that no digit is lost at coordinates of UTM size.
"""

import numpy as np

from mlscorr.compiled_loops import loop
from mlscorr.survey import PointCloud

EMPTY = -1
CELL_BITS = 21  # of a key for each axis: a million cells to each side of the origin
GROUP_BITS = 24  # of a key for the group, below the number of the moment
# Columns of the moments of a cell: number of points; sums of their times since the cell's moment
# began, of x, y, z; of xx, xy, xz, yy, yz, zz; number of points that follow another one of the
# cell, and the sums of the same products of the differences from that; sums of the times' products
# with x, y, z.
COLUMNS = 21


@loop(inline="always")
def _slot_of(cell, moment, table, keys):
    """Where the row of a key stands, or would stand, in an open hash table of a power of two."""
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
    """An open hash table of the first rows of keys.

    Parameters
    ----------
    keys : (k, 2) int array
    count : int
        Of rows.
    size : int
        Of the table: a power of two.
    """
    table = np.full(size, EMPTY, np.int64)
    for row in range(count):
        table[_slot_of(keys[row, 0], keys[row, 1], table, keys)] = row
    return table


@loop
def add_points(
    xyz: np.ndarray,
    gps_time: np.ndarray,
    begin: int,
    grid: np.ndarray,
    passes: np.ndarray,
    group: int,
    starts: np.ndarray,
    table: np.ndarray,
    keys: np.ndarray,
    moments: np.ndarray,
    count: int,
) -> tuple[int, int]:
    """Add points to the moments of their cells, until all are added or no row is left.

    Parameters
    ----------
    xyz, gps_time : (n, 3), (n,) arrays
    begin : int
        The first point to add.
    grid : (6,) array
        Origin (m) and beginning (s) of the cells, their edge (m) and duration (s).
    passes : (s, 2) array
        Start and end of the trajectory's segments. Units: s.
    group : int
        Of the first segment: the key of a cell holds group + segment.
    starts : (s,) array
        First time of each segment, which is updated.
    table, keys, moments : (t,), (k, 2), (k, 21) arrays
        Hash table, key and moments of each cell, which are updated.
    count : int
        Rows in use.

    Returns
    -------
    begin, count : int
        The first point that was not added, and the rows in use then.
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
        sums = moments[row]
        sums[0] += 1.0
        since = time - grid[3] - second * grid[5]
        sums[1] += since
        _add_place(sums, 2, 1.0, x, y, z)
        _add_place(sums, 18, since, x, y, z)
        _add_products(sums, 5, x, y, z)
        if follows:
            sums[11] += 1.0
            _add_products(sums, 12, x - last_x, y - last_y, z - last_z)
        last_x = x
        last_y = y
        last_z = z
    return len(xyz), count


@loop(inline="always")
def _split(place, grid):
    """Key of the cell that holds a place, and the way (m) to that from its middle."""
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
def _add_place(sums, column, factor, x, y, z):
    """Add x, y, z times a factor to the columns from one on."""
    sums[column] += factor * x
    sums[column + 1] += factor * y
    sums[column + 2] += factor * z


@loop(inline="always")
def _add_products(sums, column, x, y, z):
    """Add xx, xy, xz, yy, yz, zz to the columns from one on."""
    sums[column] += x * x
    sums[column + 1] += x * y
    sums[column + 2] += x * z
    sums[column + 3] += y * y
    sums[column + 4] += y * z
    sums[column + 5] += z * z


class CellTable:
    """Cells that points may still fall into.

    Parameters
    ----------
    origin : (3,) array
        Of the cells; whole metres keep their borders. Units: m.
    start : float
        Of the moments. Units: s.
    edge, duration : float
        Of a cell. Units: m, s.
    """

    def __init__(self, origin: np.ndarray, start: float, edge: float, duration: float):
        self._grid = np.array([*origin, start, edge, duration])
        self.count = 0
        self.keys = np.empty((1 << 12, 2), np.int64)
        self.moments = np.empty((1 << 12, COLUMNS))
        self._table = hash_rows(self.keys, 0, 1 << 13)

    def add(self, cloud: PointCloud, passes: np.ndarray, group: int, starts: np.ndarray) -> None:
        """Add points, as add_points does.

        Parameters
        ----------
        cloud : PointCloud
        passes : (s, 2) array
        group : int
        starts : (s,) array
        """
        begin = 0
        while True:
            begin, self.count = add_points(
                cloud.xyz,
                cloud.gps_time,
                begin,
                self._grid,
                passes,
                group,
                starts,
                self._table,
                self.keys,
                self.moments,
                self.count,
            )
            if begin == len(cloud):
                return
            self.keys = np.concatenate([self.keys, np.empty_like(self.keys)])
            self.moments = np.concatenate([self.moments, np.empty_like(self.moments)])
            self._table = hash_rows(self.keys, self.count, 2 * len(self.keys))

    @property
    def moment(self) -> np.ndarray:
        """Number (count,) of each cell's moment."""
        return self.keys[: self.count, 1] >> GROUP_BITS

    def of(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Some cells.

        Parameters
        ----------
        rows : (count,) bool array

        Returns
        -------
        middle : (k, 3) array
            Of the cells. Units: m.
        begin : (k,) array
            Of their moments. Units: s.
        group : (k,) int array
        moments : (k, 21) array
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
        return middle, begin, keys[:, 1] & ((1 << GROUP_BITS) - 1), moments

    def remove(self, rows: np.ndarray) -> None:
        """Make room for others.

        Parameters
        ----------
        rows : (count,) bool array
        """
        rest = np.flatnonzero(~rows)
        self.keys[: len(rest)] = self.keys[rest]
        self.moments[: len(rest)] = self.moments[rest]
        self.count = len(rest)
        self._table = hash_rows(self.keys, self.count, 2 * len(self.keys))
