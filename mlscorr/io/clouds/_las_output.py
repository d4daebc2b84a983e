"""New LAS and LAZ files whose head and tail are those of another one."""

import io
import os
import shutil
import struct
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, BinaryIO

import lazrs
import numpy as np

from mlscorr.io.clouds.las_layout import COPC, LASZIP, LASZIP_RECORD, LasLayout
from mlscorr.io.settings import SETTINGS

Blocks = Callable[[bool], Iterator[np.ndarray]]  # of whether they are asked for the last time


class LasOutput(io.BufferedWriter):
    """A new file that keeps what interrupts its writing; lazrs hides it behind its own error.

    Parameters
    ----------
    path : path
    """

    def __init__(self, path: Path):
        super().__init__(io.FileIO(path, "wb"), SETTINGS.copied_bytes)
        self.interruption: BaseException | None = None

    def write(self, data: Any) -> int:
        """Append bytes, as any file does.

        Parameters
        ----------
        data : buffer
        """
        try:
            return super().write(data)
        except BaseException as error:
            self.interruption = error
            raise

    def encode(self, function: Callable, *arguments: object) -> None:
        """Let lazrs write here; raises what the system raised.

        Parameters
        ----------
        function : function
        *arguments
            Its own.
        """
        try:
            function(*arguments)
        except lazrs.LazrsError as error:
            raise self.interruption or OSError(f"{self.name}: {error}") from error

    def complete(self, head: bytearray, bounds: np.ndarray) -> None:
        """Write the head again, and see that all is on the disk.

        Parameters
        ----------
        head : bytearray
            Header and VLRs.
        bounds : (2, 3) array
            Largest and smallest coordinates. Units: m.
        """
        struct.pack_into("<6d", head, 179, *bounds.T.ravel())  # max x, min x, max y, ...
        self.seek(0)
        self.write(head)
        self.flush()
        os.fsync(self.fileno())


class PlainWriter:
    """Writes points in the order in which they come, and what follows them.

    Parameters
    ----------
    layout : LasLayout
        Of the other file, with the records and VLRs that the new one has.
    output : LasOutput
        Empty.
    is_laz : bool
        Whether points are compressed.
    """

    def __init__(self, layout: LasLayout, output: LasOutput, is_laz: bool):
        self._layout = layout
        self._output = output
        self._is_laz = is_laz
        self._vlr = lazrs.LazVlr.new_for_compression(layout.point_format, layout.extra_bytes)
        data = bytes(self._vlr.record_data()) if is_laz else None
        if layout.is_copc:  # and the new one is none
            layout = replace(layout, head=layout.head_with(*COPC, None))
        self.head = bytearray(layout.head_with(LASZIP, LASZIP_RECORD, data, b"http://laszip.org"))
        self.head[104] = layout.point_format | (0x80 if is_laz else 0)

    def write(self, blocks: Blocks, file: BinaryIO) -> None:
        """Write the head as it is so far, the points and the tail.

        Parameters
        ----------
        blocks : function
            Gives all records, (n,) at a time, as bytes of each.
        file : binary file
            The other one, open for reading.

        Raises
        ------
        OSError
            Where the disk refuses.
        """
        self._output.write(self.head)
        if self._is_laz:
            encoder = lazrs.ParLasZipCompressor(self._output, self._vlr)
            for records in blocks(True):
                self._output.encode(encoder.compress_many, records.view(np.uint8))
            self._output.encode(encoder.done)
        else:
            for records in blocks(True):
                self._output.write(records.view(np.uint8))
        self._append_tail(file)

    def _append_tail(self, file):
        """Copy what follows the points of the other file, and its positions into the head."""
        layout = self._layout
        self._output.seek(0, io.SEEK_END)
        moved = self._output.tell() - layout.tail
        file.seek(layout.tail)
        shutil.copyfileobj(file, self._output, SETTINGS.copied_bytes)
        # of waveforms, since 1.3, and EVLRs
        for position in (227, 235)[: max(0, layout.version[1] - 2)]:
            value = layout.field("Q", position)[0]
            if value >= layout.tail:
                struct.pack_into("<Q", self.head, position, value + moved)
