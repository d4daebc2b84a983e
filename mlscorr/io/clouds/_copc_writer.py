"""Writing points as a COPC file: LAZ in chunks, each a node of an octree (COPC 1.0, copc.io)."""

import io
import struct
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO

import lazrs
import numpy as np

from mlscorr.io.clouds._copc import ENTRY, INFO
from mlscorr.io.clouds._las_output import Blocks
from mlscorr.io.clouds._octree import Octree
from mlscorr.io.clouds._octree_cube import GRID_BITS, Key
from mlscorr.io.clouds.las_checks import EVLR_HEADER, evlrs
from mlscorr.io.clouds.las_layout import (
    COPC,
    HIERARCHY,
    LASZIP,
    LASZIP_RECORD,
    VLR_HEADER,
    LasLayout,
)
from mlscorr.io.settings import SETTINGS


class CopcWriter:
    """Writes points and what follows them behind the head of a file, which is completed.

    Parameters
    ----------
    layout : LasLayout
        Of a COPC file, with the VLRs that the new one has.
    output : binary file
        Open for writing, empty.
    folder : path
        As of Octree.
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
        self._keys: list[Key] = []
        self._chunks: list[tuple[int, int]] = []
        self._times = np.array([np.inf, -np.inf])

    def write(self, blocks: Blocks, file: BinaryIO) -> None:
        """Write points in the nodes of an octree, and the EVLRs of another file behind them.

        Parameters
        ----------
        blocks : function
            As of Octree.
        file : binary file
            That of the layout, open for reading.
        """
        octree = Octree(self._layout, blocks, self._folder)
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


def _batches(nodes) -> Iterator[list[tuple[Key, np.ndarray]]]:
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
