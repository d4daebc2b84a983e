"""The cube of an octree, and its nodes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

GRID_BITS = 7  # 128 cells along the edge of a node, as in Untwine and PDAL
DOUBLE_BITS = np.finfo(float).nmant  # of a coordinate


class Key(NamedTuple):
    """A node of an octree: its level, and its place among the cubes of that level."""

    level: int = 0
    x: int = 0
    y: int = 0
    z: int = 0

    def above(self, level: int) -> Key:
        """The node of a lower level that holds this one.

        Parameters
        ----------
        level : int
        """
        up = self.level - level
        return Key(level, self.x >> up, self.y >> up, self.z >> up)

    def holds(self, key: Key) -> bool:
        """Whether a node of a higher level lies within this one.

        Parameters
        ----------
        key : Key
        """
        return key.above(self.level) == self

    def below(self, bits: int, place: tuple[int, int, int]) -> Key:
        """A node of some levels more within this one.

        Parameters
        ----------
        bits : int
            Number of the levels.
        place : three int
            Among the cubes there.
        """
        x, y, z = ((old << bits) + int(new) for old, new in zip(self[1:], place, strict=True))
        return Key(self.level + bits, x, y, z)


ROOT = Key()


@dataclass(frozen=True)
class Cube:
    """The cube of an octree, so placed that the bounds of all nodes are numbers without rounding.

    Parameters
    ----------
    corner : (3,) array
        In whole metres.
    edge : float
        A power of two. Units: m.
    bits : int
        Number of halvings down to the resolution of the coordinates.
    """

    corner: np.ndarray
    edge: float
    bits: int

    @classmethod
    def around(cls, box: np.ndarray, scale: np.ndarray) -> Cube:
        """The smallest such cube about the corners of a box.

        Parameters
        ----------
        box : (2, 3) array
            Units: m.
        scale : (3,) array
            Resolution of coordinates. Units: m.
        """
        edge = 1.0
        while True:
            corner = np.floor(box.mean(axis=0) - edge / 2)
            bits = np.log2(edge / scale.min()).clip(GRID_BITS, DOUBLE_BITS)
            cube = cls(corner, edge, int(np.ceil(bits)))
            if cube.contains(box):
                return cube
            edge *= 2

    def contains(self, box: np.ndarray) -> bool:
        """Whether the corners (2, 3) of a box lie within (m).

        Parameters
        ----------
        box : (2, 3) array
        """
        return bool(((box >= self.corner) & (box < self.corner + self.edge)).all())

    def places(self, xyz: np.ndarray) -> np.ndarray:
        """Where points lie in the cube, in steps of its edge halved so often: (n, 3) int array.

        Parameters
        ----------
        xyz : (n, 3) array
            Units: m.
        """
        return np.floor((xyz - self.corner) * (2.0**self.bits / self.edge)).astype(np.int64)
