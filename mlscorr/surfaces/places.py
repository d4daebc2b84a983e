"""Random numbers of positions and moments, the same in every cloud, for random selection."""

from typing import Generic, TypeVar

import numpy as np

from mlscorr.surfaces.settings import SETTINGS
from mlscorr.survey import Columns

Part = TypeVar("Part", bound=Columns)


def integer_hash(numbers: np.ndarray) -> np.ndarray:
    """Hash (n,) of integers (n, k): 64 random bits, equal for equal rows.

    Parameters
    ----------
    numbers : (n, k) int array
    """
    mixed = np.zeros(len(numbers), np.uint64)
    for number in numbers.T:
        mixed ^= number.astype(np.uint64)
        mixed *= np.uint64(0x9E3779B97F4A7C15)  # 2^64 over the golden ratio (Fibonacci hashing)
        mixed ^= mixed >> np.uint64(32)
    return mixed


def chance(*numbers: np.ndarray) -> np.ndarray:
    """Random number (n,) from 0 to 1 that depends only on integers (n,)."""
    return (integer_hash(np.column_stack(numbers)) >> np.uint64(11)) / float(1 << 53)


def place_key(xyz: np.ndarray, gps_time: np.ndarray) -> np.ndarray:
    """Key of the cell and moment of points, the same in all clouds.

    Parameters
    ----------
    xyz : (n, 3) array
        Units: m.
    gps_time : (n,) array
        Units: s.

    Returns
    -------
    (n,) uint64 array
    """
    cell = np.floor(_in_cells(xyz)).astype(np.int64)
    moment = np.floor(gps_time / SETTINGS.moment).astype(np.int64)
    return integer_hash(np.column_stack([cell, moment]))


def block_chance(xyz: np.ndarray) -> np.ndarray:
    """Random number (n,) from 0 to 1 for the ground block of points, the same in all clouds.

    Parameters
    ----------
    xyz : (n, 3) array
        Units: m.
    """
    blocks = np.floor(_in_cells(xyz[:, :2]) / SETTINGS.block_cells)
    return chance(*blocks.T.astype(np.int64))


def cell_corner(xyz: np.ndarray) -> np.ndarray:
    """Lowest corner (n, 3) of the cells of points. Units: m.

    Parameters
    ----------
    xyz : (n, 3) array
        Units: m.
    """
    return (np.floor(_in_cells(xyz)) - 1.0 / 3.0) * SETTINGS.cell


def _in_cells(xyz):
    """Positions in cell edges, with faces a third off integers, because models have floors and
    walls there.
    """
    return xyz / SETTINGS.cell + 1.0 / 3.0


class BoundedChoice(Generic[Part]):
    """Random choice of at most a given number of items from a stream, by the items' random numbers.

    Items with the same number are kept or dropped together, and the order of items does not matter.

    Parameters
    ----------
    limit : int
    """

    def __init__(self, limit: int):
        self._limit = limit
        self._parts: list[tuple[Part, np.ndarray]] = []
        self.share = 1.0  # of all numbers: items with larger ones are dropped

    def add(self, part: Part, number: np.ndarray) -> None:
        """Add items.

        Parameters
        ----------
        part : Columns
            Items as n rows.
        number : (n,) array
            From 0 to 1.
        """
        self._parts.append(self._chosen(part, number))
        while sum(len(number) for _, number in self._parts) > self._limit:
            self.share /= 2
            self._parts = [self._chosen(*pair) for pair in self._parts]

    def _chosen(self, part, number):
        """Rows with a number below the share, and their numbers."""
        rows = number < self.share
        return part[rows], number[rows]

    def parts(self) -> list[Part]:
        """Return all selected items, in the order in which they were added."""
        return [part for part, _ in self._parts]
