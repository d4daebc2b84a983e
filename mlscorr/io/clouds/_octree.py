"""Points parted into the nodes of an octree, however many there are.

Each node takes one point of each occupied cell of a grid over its cube, and its children the rest:
each level of all nodes is a sample of the cloud, twice as dense as the one above. So do Untwine and
PDAL's writers.copc, with as many cells. Points are parted on disk into cubes that memory holds;
these are taken one by one in an order in which each cube above closes as soon as it is left, so
that memory holds the points of one such cube and of the nodes above it.
"""

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np
from numba import njit

from mlscorr.io.clouds._las_output import Blocks
from mlscorr.io.clouds._octree_cube import GRID_BITS, ROOT, Cube, Key
from mlscorr.io.clouds.las_crs import cloud_box
from mlscorr.io.clouds.las_layout import LasLayout
from mlscorr.io.settings import SETTINGS
from mlscorr.io.store import Spool, check_space
from mlscorr.survey import Columns

PART_BITS = 6  # 64 cubes along an edge, into which points are parted at a time: counts of 2 MB


@dataclass(frozen=True, repr=False)
class _Part(Columns):
    """Some points: their records (n,), and where they lie in the cube (n, 3)."""

    records: np.ndarray
    places: np.ndarray


@dataclass
class _Node:
    """A node that points may still come to."""

    key: Key
    records: list[np.ndarray] = field(default_factory=list)
    is_taken: np.ndarray = field(default_factory=lambda: np.zeros(1 << 3 * GRID_BITS, bool))

    def sample(self, part, bits):
        """Keep a point of each cell that was empty; returns the part that is left."""
        chosen = _sample(part.places, bits - self.key.level - GRID_BITS, self.is_taken)
        self.records.append(part.records[chosen])
        return part[~chosen]

    def done(self):
        """Its key and its points, unless it has none."""
        records = np.concatenate(self.records)
        if len(records):
            yield self.key, records


@njit(cache=True)
def _sample(places, shift, is_taken):
    """Which points (n,) are the first of their cell, which is then taken."""
    chosen = np.zeros(len(places), np.bool_)
    mask = (1 << GRID_BITS) - 1
    for i in range(len(places)):
        cell = (places[i, 0] >> shift) & mask
        for axis in (1, 2):
            cell = (cell << GRID_BITS) + ((places[i, axis] >> shift) & mask)
        if not is_taken[cell]:
            is_taken[cell] = chosen[i] = True
    return chosen


class Octree:
    """The nodes of an octree over some points.

    Parameters
    ----------
    layout : LasLayout
        Says what the records hold.
    blocks : function
        Gives all records anew each time, (n,) at a time, as bytes of each.
    folder : path
        For the file that holds all records meanwhile, which has no name there.
    """

    def __init__(self, layout: LasLayout, blocks: Blocks, folder: Path):
        self._layout = layout
        self._blocks = blocks
        self._folder = folder
        limit = SETTINGS.largest_coordinate
        cube = Cube.around(np.nan_to_num(cloud_box(layout)).clip(-limit, limit), layout.scale)
        while True:  # once more where points have left the cube about the box of the header
            self.cube, box = cube, np.array([np.full(3, np.inf), np.full(3, -np.inf)])
            self._counts = self._count(self._watched(box), ROOT)
            cube = Cube.around(box, layout.scale)
            if self.cube.contains(box) and self.cube.edge == cube.edge:
                break

    def _watched(self, box):
        """All records, whose bounds (2, 3) are kept in a box."""
        for records in self._blocks(False):
            xyz = self._xyz(records)
            box[:] = np.minimum(box[0], xyz.min(axis=0)), np.maximum(box[1], xyz.max(axis=0))
            yield records

    def _xyz(self, records):
        fields = records.view(self._layout.record)
        return np.column_stack([fields[name] for name in "XYZ"]) * self._layout.scale + (
            self._layout.offset
        )

    @property
    def _deepest(self):
        """Level of the smallest nodes, whose cells are as fine as the coordinates."""
        return self.cube.bits - GRID_BITS

    def nodes(self) -> Iterator[tuple[Key, np.ndarray]]:
        """Each node with its records, those above it later.

        Yields
        ------
        key : Key
        records : (n,) array
            At least one.
        """
        needed = int(self._counts.sum()) * self._layout.record_length
        check_space(self._folder, needed, "to sort points into an octree beside the output.")
        path: list[_Node] = []  # from the root to the node above the last part
        for key, records in self._parts(partial(self._blocks, True), ROOT, self._counts):
            while path and (path[-1].key.level >= key.level or not path[-1].key.holds(key)):
                yield from path.pop().done()
            path += [_Node(key.above(level)) for level in range(len(path), key.level)]
            part = _Part(records, self.cube.places(self._xyz(records)))
            for node in path:
                part = node.sample(part, self.cube.bits)
            yield from self._split(key, part, path[-1] if path else None)
        while path:
            yield from path.pop().done()

    def _split(self, key, part, above):
        """The nodes of a part of the points that memory holds; a few go into the node above."""
        if above is not None and len(part) < 1 << GRID_BITS:
            above.records.append(part.records)
            return
        node = _Node(key)
        if len(part) <= SETTINGS.close_places or key.level == self._deepest:
            node.records.append(part.records)
        else:
            part = node.sample(part, self.cube.bits)
            octant = part.places >> (self.cube.bits - key.level - 1) & 1
            number = octant @ [4, 2, 1]
            for child in np.unique(number):
                rows = number == child
                yield from self._split(key.below(1, octant[np.argmax(rows)]), part[rows], node)
        yield from node.done()

    def _parts(self, blocks, above, counts):
        """Cubes with the records in each, which memory holds, one beside the other."""
        groups = []
        numbers = np.zeros(counts.shape, int)
        _merge(counts, above, groups, numbers)
        with tempfile.TemporaryFile(dir=self._folder) as file:
            spool = Spool(file, [count for _, count in groups], self._layout.record_length)
            for records in blocks():
                spool.put(records, numbers[self._cells(records, above, len(counts))])
            for number, (key, count) in enumerate(groups):
                if count > SETTINGS.chunk_points and key.level < self._deepest:
                    group = partial(spool.blocks, number)
                    yield from self._parts(group, key, self._count(group(), key))
                else:
                    yield key, spool.get(number)

    def _count(self, blocks, above):
        """Number of points (s, s, s) in each of the cubes of a node some levels below."""
        size = 1 << min(PART_BITS, self._deepest - above.level)
        counts = np.zeros((size, size, size), np.int64)
        for records in blocks:
            cells = np.ravel_multi_index(self._cells(records, above, size), counts.shape, "wrap")
            counts += np.bincount(cells, minlength=counts.size).reshape(counts.shape)
        return counts

    def _cells(self, records, above, size):
        """Where points lie among the cubes of a node: three int arrays."""
        places = self.cube.places(self._xyz(records))
        levels = above.level + size.bit_length() - 1
        return tuple((places >> (self.cube.bits - levels) & (size - 1)).T)


def _merge(counts, key, groups, numbers):
    """Join cubes up to as many points as memory holds; writes the number of each group."""
    total = int(counts.sum())
    if total and (total <= SETTINGS.chunk_points or len(counts) == 1):
        numbers[...] = len(groups)
        groups.append((key, total))
    elif total:
        half = len(counts) // 2
        for place in np.ndindex(2, 2, 2):
            inside = tuple(slice(axis * half, (axis + 1) * half) for axis in place)
            _merge(counts[inside], key.below(1, place), groups, numbers[inside])
