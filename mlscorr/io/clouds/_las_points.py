"""Decoders of LAS points beside those of lazrs, and points read chunk by chunk."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, BinaryIO

import lazrs
import numpy as np


@contextmanager
def decoding(message: str) -> Iterator[None]:
    """Where lazrs works: its errors, and what it aborts with, become a sentence.

    Parameters
    ----------
    message : str
        What can't be read. It ends where lazrs' own words follow in brackets.

    Raises
    ------
    ValueError
    """
    try:
        yield
    except BaseException as error:
        # a Rust panic derives from BaseException, and has no name that could be imported
        if not isinstance(error, lazrs.LazrsError) and type(error).__name__ != "PanicException":
            raise
        raise ValueError(
            f"{message} ({error}). The file is cut off or damaged; copy it anew."
        ) from error


class PlainPoints:
    """Uncompressed points, read as lazrs reads the compressed ones.

    Parameters
    ----------
    file : binary file
        Open for reading.
    start : int
        Byte where the points start.
    record_length : int
        Units: bytes.
    """

    def __init__(self, file: BinaryIO, start: int, record_length: int):
        self._file: Any = file
        self._start = start
        self._length = record_length

    def seek(self, point: int) -> None:
        """Go on with a point.

        Parameters
        ----------
        point : int
            Its number.
        """
        self._file.seek(self._start + point * self._length)

    def decompress_many(self, buffer: bytearray | np.ndarray) -> None:
        """Fill a buffer with the points that follow.

        Parameters
        ----------
        buffer : writable buffer of whole points

        Raises
        ------
        lazrs.LazrsError
            Where points are missing.
        """
        if self._file.readinto(buffer) != len(buffer):
            raise lazrs.LazrsError("the file ends")


class ChunkedPoints:
    """Reads points as lazrs' decompressors do, whose seek goes astray where chunks differ in size.

    Parameters
    ----------
    file : binary file
        Open for reading where the points start.
    laszip : bytes
        Data of the LASzip VLR.
    selection : lazrs.DecompressionSelection
        Which fields are decoded.
    """

    def __init__(self, file: BinaryIO, laszip: bytes, selection: lazrs.DecompressionSelection):
        self._file = file
        self._laszip = laszip
        self._selection = selection
        vlr = lazrs.LazVlr(laszip)
        self._length = vlr.item_size()
        self._chunks = lazrs.read_chunk_table(file, vlr)  # leaves the file at the first chunk
        points, sizes = np.array(self._chunks, np.int64).T
        self._firsts = np.cumsum(points) - points  # numbers of the chunks' first points
        self._starts = file.tell() + np.cumsum(sizes) - sizes
        self._next, self._held = 0, np.empty(0, np.uint8)

    def seek(self, point: int) -> None:
        """Go on with a point.

        Parameters
        ----------
        point : int
            Its number.
        """
        self._next = int(np.searchsorted(self._firsts, point, side="right")) - 1
        before = point - int(self._firsts[self._next])
        self._held = self._decoded(1)[before * self._length :]

    def decompress_many(self, buffer: bytearray | np.ndarray) -> None:
        """Fill a buffer with the points that follow.

        Parameters
        ----------
        buffer : writable buffer of whole points

        Raises
        ------
        lazrs.LazrsError
            Where points are missing or can't be decoded.
        """
        rest = np.frombuffer(buffer, np.uint8)
        while len(rest):
            if not len(self._held):
                self._held = self._decoded(len(rest) // self._length)
            taken = min(len(rest), len(self._held))
            rest[:taken] = self._held[:taken]
            rest = rest[taken:]
            self._held = self._held[taken:]

    def _decoded(self, points):
        """Bytes of the next chunks, which hold so many points at least, if there are as many."""
        if self._next == len(self._chunks):
            raise lazrs.LazrsError("the file ends")
        end = self._next + 1
        end = max(end, int(np.searchsorted(self._firsts, self._firsts[self._next] + points)))
        run = self._chunks[self._next : end]
        self._file.seek(int(self._starts[self._next]))
        data = self._file.read(sum(size for _, size in run))
        decoded = np.empty(sum(count for count, _ in run) * self._length, np.uint8)
        lazrs.decompress_points_with_chunk_table(data, self._laszip, decoded, run, self._selection)
        self._next = end
        return decoded
