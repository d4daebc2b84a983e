"""Random numbers of places and moments, the same in every cloud, by which some are chosen."""

from typing import Generic, TypeVar

import numpy as np

from mlscorr.surfaces.settings import SETTINGS
from mlscorr.survey import Columns

Part = TypeVar("Part", bound=Columns)


def integer_hash(numbers: np.ndarray) -> np.ndarray:
    """A 64-bit number (n,) of integers (n, k): random, but the same for the same ones.

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
    """A number from 0 to 1 (n,) that depends on integers (n,) alone."""
    return (integer_hash(np.column_stack(numbers)) >> np.uint64(11)) / float(1 << 53)


def place_key(xyz: np.ndarray, gps_time: np.ndarray) -> np.ndarray:
    """A number for the cell and moment of points, the same in all clouds.

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
    """A number from 0 to 1 (n,) for the block of the ground of points, the same in all clouds.

    Parameters
    ----------
    xyz : (n, 3) array
        Units: m.
    """
    blocks = np.floor(_in_cells(xyz[:, :2]) / SETTINGS.block_cells)
    return chance(*blocks.T.astype(np.int64))


def cell_corner(xyz: np.ndarray) -> np.ndarray:
    """The least corner (n, 3) of the cells of points. Units: m.

    Parameters
    ----------
    xyz : (n, 3) array
        Units: m.
    """
    return (np.floor(_in_cells(xyz)) - 1.0 / 3.0) * SETTINGS.cell


def _in_cells(xyz):
    """Places in edges of a cell, whose faces stand a third off the whole numbers: models have
    floors and walls there.
    """
    return xyz / SETTINGS.cell + 1.0 / 3.0


class BoundedChoice(Generic[Part]):
    """At most a number of things of a stream, chosen by random numbers that each brings along.

    Things of one number are kept or left together, and the order in which they come does not
    matter.

    Parameters
    ----------
    limit : int
    """

    def __init__(self, limit: int):
        self._limit = limit
        self._parts: list[tuple[Part, np.ndarray]] = []
        self.share = 1.0  # of all numbers: things with larger ones are left out

    def add(self, part: Part, number: np.ndarray) -> None:
        """Take things.

        Parameters
        ----------
        part : Columns
            Of n rows.
        number : (n,) array
            From 0 to 1.
        """
        self._parts.append(self._chosen(part, number))
        while sum(len(number) for _, number in self._parts) > self._limit:
            self.share /= 2
            self._parts = [self._chosen(*pair) for pair in self._parts]

    def _chosen(self, part, number):
        """The rows with a number below the share, and their numbers."""
        rows = number < self.share
        return part[rows], number[rows]

    def parts(self) -> list[Part]:
        """All that is kept, in the order in which it came."""
        return [part for part, _ in self._parts]
