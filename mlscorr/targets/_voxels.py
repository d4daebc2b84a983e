"""Occupied cubes of a chunk of cloud in a hash table, so that millions of points cost little."""

from collections.abc import Iterator

import numpy as np
from numba import njit
from scipy.sparse import coo_array

EMPTY = -1


@njit(cache=True)
def key_of(x: float, y: float, z: float, edge: float) -> np.int64:
    """Key of the cube that holds a place.

    Parameters
    ----------
    x, y, z, edge : float
        Units: m.
    """
    return (np.int64(x / edge) << 42) | (np.int64(y / edge) << 21) | np.int64(z / edge)


@njit(cache=True)
def _slot(keys, key):
    """Where a key stands, or would stand, in an open hash table of a power of two."""
    mask = len(keys) - 1
    slot = ((key ^ (key >> 23)) * np.int64(-7046029254386353131)) >> 20 & mask
    while keys[slot] != EMPTY and keys[slot] != key:
        slot = (slot + 1) & mask
    return slot


@njit(cache=True)
def number_voxels(xyz: np.ndarray, low: np.ndarray, edge: float) -> tuple[np.ndarray, ...]:
    """Number the occupied cubes.

    Parameters
    ----------
    xyz : (n, 3) array
        Units: m.
    low : (3,) array
        Not above any of them. Units: m.
    edge : float
        Units: m.

    Returns
    -------
    of_point : (n,) int array
        Number of each point's cube.
    keys_of : (c,) int array
        Key of each cube.
    keys, number : (t,) int arrays
        The hash table, for ``neighbours``.
    """
    size = 1024
    keys = np.full(size, EMPTY)
    number = np.empty(size, np.int64)
    of_point = np.empty(len(xyz), np.int32)
    known = np.empty(len(xyz), np.int64)
    count = 0
    last_key = np.int64(EMPTY)
    last = 0
    for i in range(len(xyz)):
        key = key_of(xyz[i, 0] - low[0], xyz[i, 1] - low[1], xyz[i, 2] - low[2], edge)
        if key != last_key:
            slot = _slot(keys, key)
            if keys[slot] == EMPTY:
                keys[slot] = key
                number[slot] = count
                known[count] = key
                count += 1
                if 2 * count > size:
                    size *= 4
                    keys = np.full(size, EMPTY)
                    number = np.empty(size, np.int64)
                    for k in range(count):
                        slot = _slot(keys, known[k])
                        keys[slot] = known[k]
                        number[slot] = k
                    slot = _slot(keys, key)
            last_key = key
            last = number[slot]
        of_point[i] = last
    return of_point, known[:count].copy(), keys, number


def sort_by_voxel(cell: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows (n,) sorted by cell, and where each cell starts among them (count + 1,).

    Parameters
    ----------
    cell : (n,) int array
        Number of each point's cell.
    count : int
        Of cells.
    """
    rows = np.arange(len(cell))  # a matrix sorts its entries by counting
    matrix = coo_array((rows, (cell, rows)), shape=(count, len(cell))).tocsr()
    return matrix.indices, matrix.indptr


@njit  # numba can't call a generator that it read from its cache
def neighbours(key: int, keys: np.ndarray, number: np.ndarray) -> Iterator[int]:
    """Numbers of the occupied cubes among the 27 about a key.

    Parameters
    ----------
    key : int
    keys, number : (t,) int arrays
        The hash table of ``number_voxels``.
    """
    for dx in range(-1, 2):
        for dy in range(-1, 2):
            for dz in range(-1, 2):
                beside = key + (dx << 42) + (dy << 21) + dz
                if beside >= 0:
                    slot = _slot(keys, beside)
                    if keys[slot] == beside:
                        yield number[slot]
