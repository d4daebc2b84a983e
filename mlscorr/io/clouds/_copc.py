"""The octree of a COPC file, as its hierarchy states it (COPC 1.0, copc.io)."""

import struct
from collections.abc import Iterator, Sequence
from typing import BinaryIO

import numpy as np

from mlscorr.io.clouds.las_layout import COPC, LasLayout

INFO = struct.Struct("<5d2Q2d88x")  # centre, half edge, spacing; root page; first and last time
ENTRY = np.dtype([("key", "(4,)<i4"), ("start", "<u8"), ("size", "<i4"), ("points", "<i4")])


def check_hierarchy(layout: LasLayout, file: BinaryIO, chunks: Sequence[tuple[int, int]]) -> None:
    """That each LAZ chunk of a COPC file is a node of its hierarchy, and each node a chunk.

    Parameters
    ----------
    layout : LasLayout
    file : binary file
        Open for reading.
    chunks : sequence of (points, bytes)
        As they follow each other.

    Raises
    ------
    ValueError
    """
    info = b"".join(layout.vlr_data(*COPC))
    if len(info) != INFO.size:
        raise ValueError(
            f"{layout.path} is damaged: its COPC info VLR has {len(info)} bytes, not {INFO.size}. "
            "Copy the file anew."
        )
    start, size = INFO.unpack(info)[5:7]
    entries = np.concatenate([np.empty(0, ENTRY), *_pages(layout, file, start, size, len(chunks))])
    nodes = np.sort(entries[entries["points"] > 0], order="start")
    points, sizes = np.array(chunks, np.int64).T
    starts = len(layout.head) + 8 + np.cumsum(sizes) - sizes  # behind the position of their table
    same = len(nodes) == len(chunks) and (
        np.array_equal(nodes["start"], starts)
        and np.array_equal(nodes["size"], sizes)
        and np.array_equal(nodes["points"], points)
    )
    if not same:
        raise ValueError(
            f"{layout.path} is damaged: its COPC hierarchy has {len(nodes)} nodes of "
            f"{nodes['points'].sum(dtype=np.int64)} points, its LAZ chunks are {len(chunks)} of "
            f"{points.sum()}, and they are not the same ones. A program that knows no COPC may "
            "have rewritten it. Write it anew: pdal translate IN.copc.laz OUT.laz."
        )


def _pages(layout, file, start, size, chunks) -> Iterator[np.ndarray]:
    """Entries of each page of a hierarchy."""
    pages = [(start, size)]
    known = {start}
    while pages:
        start, size = pages.pop()
        if start + size > layout.size:
            raise ValueError(
                f"{layout.path} is cut off: its COPC hierarchy should reach to byte "
                f"{start + size} of {layout.size}. Its writing or copying was interrupted; copy it "
                "anew."
            )
        if size <= 0 or size % ENTRY.itemsize:
            raise ValueError(
                f"{layout.path} is damaged: {size} bytes are no page of a COPC hierarchy. Copy it "
                "anew."
            )
        file.seek(start)
        entries = np.frombuffer(file.read(size), ENTRY)
        yield entries
        for entry in entries[entries["points"] == -1]:  # nodes that are on a page of their own
            page = int(entry["start"]), int(entry["size"])
            if page[0] in known or len(known) > chunks:  # a page in circles
                raise ValueError(
                    f"{layout.path} is damaged: its COPC hierarchy has page {page[0]} twice, or "
                    f"more pages than chunks ({chunks}). Copy it anew."
                )
            known.add(page[0])
            pages.append(page)
