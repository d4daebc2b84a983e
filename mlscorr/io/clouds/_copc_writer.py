"""COPC writer: LAZ in chunks, each a node of an octree (COPC 1.0, copc.io).

Each node takes one point of each occupied cell of a grid over its cube, and its children the rest:
each level is a sample of the cloud, twice as dense as the level above. Untwine and PDAL's
writers.copc do the same, with the same number of cells. Points are split on disk into cubes that
fit into memory. The cubes are processed depth first, so that memory contains the points of one cube
and of the nodes above it.
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
DOUBLE_BITS = np.finfo(float).nmant  # bits of a coordinate
PART_BITS = 6  # 64 cubes along an edge, into which points are split at a time: counts of 2 MB


class _Key(NamedTuple):
    """Node of an octree: its level, and its position among the cubes of that level."""

    level: int = 0
    x: int = 0
    y: int = 0
    z: int = 0

    def above(self, level: int) -> _Key:
        """Return the node of a lower level that contains this one.

        Parameters
        ----------
        level : int
        """
        up = self.level - level
        return _Key(level, self.x >> up, self.y >> up, self.z >> up)

    def holds(self, key: _Key) -> bool:
        """True if a node of a higher level is within this one.

        Parameters
        ----------
        key : Key
        """
        return key.above(self.level) == self

    def below(self, bits: int, place: tuple[int, int, int]) -> _Key:
        """Return a node some levels deeper within this one.

        Parameters
        ----------
        bits : int
            Number of the levels.
        place : three int
            Position among the cubes of that level.
        """
        x, y, z = ((old << bits) + int(new) for old, new in zip(self[1:], place, strict=True))
        return _Key(self.level + bits, x, y, z)


_ROOT = _Key()


@dataclass(frozen=True)
class _Cube:
    """Cube of an octree, placed so that the bounds of all nodes are exact numbers.

    Parameters
    ----------
    corner : (3,) array
        In whole meters.
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
        """Make the smallest such cube around the corners of a box.

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
        """True if the corners (2, 3) of a box are within the cube (m).

        Parameters
        ----------
        box : (2, 3) array
        """
        return bool(((box >= self.corner) & (box < self.corner + self.edge)).all())

    def places(self, xyz: np.ndarray) -> np.ndarray:
        """Positions of points in the cube, as integers (n, 3) in steps of its halved edge.

        Parameters
        ----------
        xyz : (n, 3) array
            Units: m.
        """
        return np.floor((xyz - self.corner) * (2.0**self.bits / self.edge)).astype(np.int64)


@dataclass(frozen=True, repr=False)
class _Part(Columns):
    """Some points: their records (n,) and their positions in the cube (n, 3)."""

    records: np.ndarray
    places: np.ndarray


@dataclass
class _Node:
    """Node that may still receive points."""

    key: _Key
    records: list[np.ndarray] = field(default_factory=list)
    is_taken: np.ndarray = field(default_factory=lambda: np.zeros(1 << 3 * GRID_BITS, bool))

    def sample(self, part, bits):
        """Keep a point for each cell that was empty; return the remaining part."""
        chosen = _sample(part.places, bits - self.key.level - GRID_BITS, self.is_taken)
        self.records.append(part.records[chosen])
        return part[~chosen]

    def done(self):
        """Key and points of the node, unless it is empty."""
        records = np.concatenate(self.records)
        if len(records):
            yield self.key, records


@loop
def _sample(places, shift, is_taken):
    """Flag (n,) of points that are the first of their cell, which is then taken."""
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
    """Nodes of an octree over some points.

    Parameters
    ----------
    layout : LasLayout
        Describes the records.
    blocks : function
        Yields all records at each call, (n,) at a time, as bytes of each.
    folder : path
        For an unnamed temporary file with all records.
    """

    def __init__(self, layout: LasLayout, blocks: Blocks, folder: Path):
        self._layout = layout
        self._blocks = blocks
        self._folder = folder
        limit = SETTINGS.largest_coordinate
        cube = _Cube.around(np.nan_to_num(cloud_box(layout)).clip(-limit, limit), layout.scale)
        while True:  # again if points have left the header's box
            self.cube, box = cube, np.array([np.full(3, np.inf), np.full(3, -np.inf)])
            self._counts = self._count(self._watched(box), _ROOT)
            cube = _Cube.around(box, layout.scale)
            if self.cube.contains(box) and self.cube.edge == cube.edge:
                break

    def _watched(self, box):
        """Yield all records, and keep their bounds (2, 3) in a box."""
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
        """Yield each node with its records, children before parents.

        Yields
        ------
        key : Key
        records : (n,) array
            At least one record.
        """
        needed = int(self._counts.sum()) * self._layout.record_length
        check_space(self._folder, needed, "to sort points into an octree next to the output.")
        path: list[_Node] = []  # from the root to the parent of the last part
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
        """Nodes of a part that fits into memory; a few points go into the parent."""
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
        """Cubes with the records in each, which fit into memory, in depth-first order."""
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
        """Positions of points among the cubes of a node: three int arrays."""
        places = self.cube.places(self._xyz(records))
        levels = above.level + size.bit_length() - 1
        return tuple((places >> (self.cube.bits - levels) & (size - 1)).T)


def _merge(counts, key, groups, numbers):
    """Merge cubes up to as many points as fit into memory; store the number of each group."""
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
    """Writer of points and trailing records after the head of a file, which it completes.

    Parameters
    ----------
    layout : LasLayout
        Layout of a COPC file, with the VLRs of the new one.
    output : binary file
        Empty and open for writing.
    folder : path
        See ``_Octree``.
    """

    def __init__(self, layout: LasLayout, output: BinaryIO, folder: Path):
        for user, record in {layout.owner(start) for start, _ in layout.vlrs} - {COPC}:
            if user == COPC[0]:  # of an octree that no longer exists
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
        """Write points in the nodes of an octree, followed by the EVLRs of another file.

        Parameters
        ----------
        blocks : function
            See ``_Octree``.
        file : binary file
            File of the layout, open for reading.
        """
        octree = _Octree(self._layout, blocks, self._folder)
        start = len(self.head)
        self._output.write(self.head)
        self._output.write(bytes(8))  # position of the chunk table
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
        """Append the chunks of some nodes, the points of each sorted by time."""
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
        """Append the EVLRs of a file with a new hierarchy; return start and size of its page."""
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
        """Describe the octree in the first VLR of the head."""
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
    """Yield some nodes at a time, with about as many points as fit into memory."""
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
