"""Writing points as a COPC file: LAZ in chunks, each a node of an octree (COPC 1.0, copc.io).

Each node takes one point of each occupied cell of a grid over its cube, and its children the rest:
each level of all nodes is a sample of the cloud, twice as dense as the one above. So do Untwine and
PDAL's writers.copc, with as many cells. Points are parted on disk into cubes that memory holds;
these are taken one by one in an order in which each cube above closes as soon as it is left, so
that memory holds the points of one such cube and of the nodes above it.
"""

from __future__ import annotations

import io
import struct
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import BinaryIO, NamedTuple

import lazrs
import numpy as np

from mlscorr.compiled_loops import loop
from mlscorr.io.clouds.las_checks import ENTRY, EVLR_HEADER, INFO, evlrs
from mlscorr.io.clouds.las_crs import cloud_box
from mlscorr.io.clouds.las_layout import (
    COPC,
    HIERARCHY,
    LASZIP,
    LASZIP_RECORD,
    VLR_HEADER,
    LasLayout,
)
from mlscorr.io.clouds.las_writer import Blocks
from mlscorr.io.settings import SETTINGS
from mlscorr.io.store import Spool, check_space
from mlscorr.survey import Columns

GRID_BITS = 7  # 128 cells along the edge of a node, as in Untwine and PDAL
DOUBLE_BITS = np.finfo(float).nmant  # of a coordinate
PART_BITS = 6  # 64 cubes along an edge, into which points are parted at a time: counts of 2 MB


class _Key(NamedTuple):
    """A node of an octree: its level, and its place among the cubes of that level."""

    level: int = 0
    x: int = 0
    y: int = 0
    z: int = 0

    def above(self, level: int) -> _Key:
        """The node of a lower level that holds this one.

        Parameters
        ----------
        level : int
        """
        up = self.level - level
        return _Key(level, self.x >> up, self.y >> up, self.z >> up)

    def holds(self, key: _Key) -> bool:
        """Whether a node of a higher level lies within this one.

        Parameters
        ----------
        key : Key
        """
        return key.above(self.level) == self

    def below(self, bits: int, place: tuple[int, int, int]) -> _Key:
        """A node of some levels more within this one.

        Parameters
        ----------
        bits : int
            Number of the levels.
        place : three int
            Among the cubes there.
        """
        x, y, z = ((old << bits) + int(new) for old, new in zip(self[1:], place, strict=True))
        return _Key(self.level + bits, x, y, z)


_ROOT = _Key()


@dataclass(frozen=True)
class _Cube:
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
    def around(cls, box: np.ndarray, scale: np.ndarray) -> _Cube:
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


@dataclass(frozen=True, repr=False)
class _Part(Columns):
    """Some points: their records (n,), and where they lie in the cube (n, 3)."""

    records: np.ndarray
    places: np.ndarray


@dataclass
class _Node:
    """A node that points may still come to."""

    key: _Key
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


@loop
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


class _Octree:
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
        cube = _Cube.around(np.nan_to_num(cloud_box(layout)).clip(-limit, limit), layout.scale)
        while True:  # once more where points have left the cube about the box of the header
            self.cube, box = cube, np.array([np.full(3, np.inf), np.full(3, -np.inf)])
            self._counts = self._count(self._watched(box), _ROOT)
            cube = _Cube.around(box, layout.scale)
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

    def nodes(self) -> Iterator[tuple[_Key, np.ndarray]]:
        """Each node with its records, those above it later.

        Yields
        ------
        key : Key
        records : (n,) array
            At least one.
        """
        needed = int(self._counts.sum()) * self._layout.record_length
        check_space(self._folder, needed, "to sort points into an octree next to the output.")
        path: list[_Node] = []  # from the root to the node above the last part
        for key, records in self._parts(partial(self._blocks, True), _ROOT, self._counts):
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


class CopcWriter:
    """Writes points and what follows them behind the head of a file, which is completed.

    Parameters
    ----------
    layout : LasLayout
        Of a COPC file, with the VLRs that the new one has.
    output : binary file
        Open for writing, empty.
    folder : path
        As of _Octree.
    """

    def __init__(self, layout: LasLayout, output: BinaryIO, folder: Path):
        for user, record in {layout.owner(start) for start, _ in layout.vlrs} - {COPC}:
            if user == COPC[0]:  # of an octree that is no more
                layout = replace(layout, head=layout.head_with(user, record, None))
        self._layout = layout
        self._output = output
        self._folder = folder
        self._vlr = lazrs.LazVlr.new_for_compression(
            layout.point_format, layout.extra_bytes, use_variable_size_chunks=True
        )
        data = bytes(self._vlr.record_data())
        self.head = bytearray(layout.head_with(LASZIP, LASZIP_RECORD, data, b"http://laszip.org"))
        self._keys: list[_Key] = []
        self._chunks: list[tuple[int, int]] = []
        self._times = np.array([np.inf, -np.inf])

    def write(self, blocks: Blocks, file: BinaryIO) -> None:
        """Write points in the nodes of an octree, and the EVLRs of another file behind them.

        Parameters
        ----------
        blocks : function
            As of _Octree.
        file : binary file
            That of the layout, open for reading.
        """
        octree = _Octree(self._layout, blocks, self._folder)
        start = len(self.head)
        self._output.write(self.head)
        self._output.write(bytes(8))  # for the position of the table of chunks
        for batch in _batches(octree.nodes()):
            self._write_nodes(batch)
        table = io.BytesIO()
        lazrs.write_chunk_table(table, self._chunks, self._vlr)
        table_start = self._output.tell()
        self._output.write(table.getvalue())
        self._set_info(octree, self._write_evlrs(file))
        self._output.seek(start)
        self._output.write(struct.pack("<Q", table_start))

    def _write_nodes(self, batch):
        """Append the chunks of some nodes, the points of each in order of time."""
        chunks = []
        for key, records in batch:
            times = records.view(self._layout.record)["gps_time"]
            finite = times[np.isfinite(times)]
            low, high = self._times
            self._times[:] = min(low, finite.min(initial=low)), max(high, finite.max(initial=high))
            self._keys.append(key)
            chunks.append(records[np.argsort(times, kind="stable")].view(np.uint8))
        part = io.BytesIO()
        compressor = lazrs.ParLasZipCompressor(part, self._vlr)
        compressor.compress_chunks(chunks)
        compressor.done()
        part.seek(0)
        sizes = lazrs.read_chunk_table(part, self._vlr)  # leaves the part at the first chunk
        self._chunks += sizes
        self._output.write(part.read(sum(size for _, size in sizes)))

    def _write_evlrs(self, file):
        """Append the EVLRs of a file with a new hierarchy; returns start and size of its page."""
        start = self._output.tell()
        kept = 0
        for position, size in evlrs(self._layout, file):
            file.seek(position)
            if not file.read(EVLR_HEADER.size).startswith(COPC[0], 2):
                kept += 1
                file.seek(position)
                for first in range(0, size, SETTINGS.copied_bytes):
                    self._output.write(file.read(min(SETTINGS.copied_bytes, size - first)))
        entries = np.zeros(len(self._keys), ENTRY)
        entries["key"] = self._keys
        entries["points"], entries["size"] = np.array(self._chunks, np.int64).T
        sizes = entries["size"].astype(np.int64)
        entries["start"] = len(self.head) + 8 + np.cumsum(sizes) - sizes
        self._output.write(EVLR_HEADER.pack(*HIERARCHY, entries.nbytes, b"EPT hierarchy"))
        page = self._output.tell()
        self._output.write(entries[np.lexsort(entries["key"].T[::-1])])  # level by level
        struct.pack_into("<QI", self.head, 235, start, kept + 1)
        return page, entries.nbytes

    def _set_info(self, octree, page):
        """State the octree in the first VLR of the head."""
        cube = octree.cube
        half = cube.edge / 2
        if np.isfinite(self._times).all():
            times = self._times
        else:
            times = np.zeros(2)
        info = INFO.pack(*(cube.corner + half), half, cube.edge / (1 << GRID_BITS), *page, *times)
        start = self._layout.vlrs[0][0] + VLR_HEADER.size
        self.head[start : start + INFO.size] = info


def _batches(nodes) -> Iterator[list[tuple[_Key, np.ndarray]]]:
    """Some nodes at a time, about as many points as memory holds."""
    batch = []
    points = 0
    for node in nodes:
        batch.append(node)
        points += len(node[1])
        if points >= SETTINGS.chunk_points:
            yield batch
            batch = []
            points = 0
    if batch:
        yield batch
