"""What a LAS or LAZ file says of itself, kept as the bytes that it is.

laspy says what point formats and extra bytes are made of, lazrs decodes the points. Header and
VLRs are kept as bytes, not read and written anew by laspy, which cannot leave alone what nobody
changes: it refuses LAS 1.0, decodes every VLR that it knows (one bad one would stop the file) and
writes reserved fields, bytes behind the end of a text and the signature of a VLR its own way; and
it believes counts before they are checked (2^31-1 VLRs keep it busy for good).
Byte positions are those of the ASPRS LAS 1.4 R15 specification, and of 1.5 R00.
"""

from __future__ import annotations

import struct
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, BinaryIO

import lazrs
import numpy as np
from laspy import PointFormat

from mlscorr.io.clouds._las_points import ChunkedPoints, PlainPoints
from mlscorr.io.trajectories import ADJUSTMENT

VLR_HEADER = struct.Struct("<2x16sHH32s")  # owner, record, length of data, description
# of the VLR that says how points are compressed
LASZIP = b"laszip encoded"
LASZIP_RECORD = 22204
OLD_CLASS = "raw_classification"
NEW_CLASS = "classification"
NEW_FLAGS = "classification_flags"
# of the VLR and the EVLR that tell an octree
COPC = (b"copc", 1)
HIERARCHY = (b"copc", 1000)


@dataclass(frozen=True)
class LasLayout:
    """Where the parts of a LAS file lie: head (header and VLRs), points, tail (EVLRs, waveforms).

    Parameters
    ----------
    path : Path
    head : bytes
        All that precedes the points.
    size : int
        Of the whole file. Units: bytes.
    source : Path, optional
        The cloud of another format that the file at path was made of.
    """

    path: Path
    head: bytes
    size: int
    source: Path | None = None

    @property
    def cloud(self) -> Path:
        """The cloud as survey.toml names it."""
        return self.source or self.path

    def field(self, form: str, start: int) -> tuple[Any, ...]:
        """Values of the header.

        Parameters
        ----------
        form : str
            In struct's notation.
        start : int
            Position in bytes.

        Returns
        -------
        tuple
        """
        return struct.unpack_from("<" + form, self.head, start)

    @property
    def version(self) -> tuple[int, int]:
        """1.0 to 1.5, as (major, minor)."""
        major, minor = self.field("BB", 24)
        return major, minor

    @property
    def is_standard(self) -> bool:
        """Whether gps_time is adjusted standard GPS time, not seconds of week."""
        return bool(self.head[6] & 1)

    @property
    def states_wkt(self) -> bool:
        """Whether the CRS is stated as WKT, not by GeoKeys."""
        return bool(self.head[6] & 16)

    @property
    def has_time_offset(self) -> bool:
        """Whether gps_time is standard GPS time less an offset that the header states."""
        return self.version >= (1, 5) and bool(self.head[6] & 64)

    @property
    def time_offset(self) -> float:
        """What makes gps_time adjusted standard GPS time where another offset is stated. Units: s.

        Source: ASPRS LAS 1.5 R00, Time Offset, in units of 1e6 s.
        """
        if self.has_time_offset:
            return 1e6 * self.field("H", 391)[0] - ADJUSTMENT
        return 0.0

    @property
    def point_format(self) -> int:
        """Number of the point format."""
        return self.head[104] & 0x3F

    @property
    def is_compressed(self) -> bool:
        """Whether the points are LAZ."""
        return bool(self.head[104] & 0x80)

    @property
    def record_length(self) -> int:
        """Of a point with its extra bytes. Units: bytes."""
        return self.field("H", 105)[0]

    @property
    def extra_bytes(self) -> int:
        """Of a point, behind what its format has. Units: bytes."""
        return self.record_length - PointFormat(self.point_format).size

    @property
    def points(self) -> int:
        """Number of points."""
        return self.field(*(("Q", 247) if self.version >= (1, 4) else ("I", 107)))[0]

    @property
    def scale(self) -> np.ndarray:
        """Of X, Y, Z: (3,). Units: m."""
        return np.array(self.field("3d", 131))

    @property
    def offset(self) -> np.ndarray:
        """Of X, Y, Z: (3,). Units: m."""
        return np.array(self.field("3d", 155))

    @property
    def record(self) -> np.dtype:
        """Type of a point record: the fields that are used here by name, the others by length."""
        fields = PointFormat(self.point_format).dtype().fields
        names = ["X", "Y", "Z", "intensity", "gps_time", "point_source_id"]
        names += [NEW_FLAGS, NEW_CLASS] if self.point_format >= 6 else [OLD_CLASS]
        kinds, starts = zip(*(fields[name][:2] for name in names), strict=True)
        form: Any = {"names": names, "formats": kinds, "offsets": starts}
        return np.dtype(form | {"itemsize": self.record_length})

    def is_noise(self, records: np.ndarray, classes: Collection[int]) -> np.ndarray:
        """Which points are withheld or of some classes: (n,) bool.

        Source: ASPRS LAS 1.4 R15, classification of point formats 0 to 5 and of 6 to 10.

        Parameters
        ----------
        records : (n,) structured array
        classes : collection of int
        """
        is_left_out = np.zeros(256, bool)  # by the byte that holds the class
        is_left_out[list(classes)] = True
        if self.point_format >= 6:
            return is_left_out[records[NEW_CLASS]] | ((records[NEW_FLAGS] & 4) > 0)
        byte = np.arange(256)
        is_left_out = is_left_out[byte & 31] | (byte >= 128)  # 5 bits of class, the 8th is withheld
        return is_left_out[records[OLD_CLASS]]

    @cached_property
    def vlrs(self) -> list[tuple[int, int]]:
        """Start and end in head of each VLR. Raises ValueError when they don't fit."""
        count = self.field("I", 100)[0]
        bounds = []
        position = self.field("H", 94)[0]
        for _ in range(count):
            end = position + VLR_HEADER.size
            if end <= len(self.head):
                end += VLR_HEADER.unpack_from(self.head, position)[2]
            if end > len(self.head):
                raise ValueError(
                    f"{self.path} is damaged: it announces {count} VLRs in its header, but only "
                    f"{len(bounds)} fit before the points at byte {len(self.head)}."
                )
            bounds.append((position, end))
            position = end
        return bounds

    def owner(self, start: int) -> tuple[bytes, int]:
        """User and record of the VLR that starts at a byte of head.

        Parameters
        ----------
        start : int

        Returns
        -------
        user : bytes
        record : int
        """
        user, record, *_ = VLR_HEADER.unpack_from(self.head, start)
        return user.split(b"\0")[0], record

    def vlr_data(self, user: bytes, record: int) -> Iterator[bytes]:
        """Data of the VLRs of a user and a record.

        Parameters
        ----------
        user : bytes
        record : int

        Yields
        ------
        bytes
        """
        for start, end in self.vlrs:
            if self.owner(start) == (user, record):
                yield self.head[start + VLR_HEADER.size : end]

    def head_with(
        self, user: bytes, record: int, data: bytes | None, description: bytes = b""
    ) -> bytes:
        """Header and VLRs with the VLRs of a user and a record replaced by one, or by none.

        Parameters
        ----------
        user : bytes
        record : int
        data : bytes, optional
        description : bytes

        Returns
        -------
        bytes
        """
        header_size = self.field("H", 94)[0]
        kept = [self.head[a:b] for a, b in self.vlrs if self.owner(a) != (user, record)]
        if data is not None:
            kept.append(VLR_HEADER.pack(user, record, len(data), description) + data)
        between = self.head[self.vlrs[-1][1] if self.vlrs else header_size :]
        head = bytearray(self.head[:header_size] + b"".join(kept) + between)
        struct.pack_into("<II", head, 96, len(head), len(kept))
        return bytes(head)

    def with_record_length(self, length: int) -> LasLayout:
        """The LasLayout with longer point records.

        Parameters
        ----------
        length : int
            Units: bytes.

        Returns
        -------
        LasLayout
        """
        head = bytearray(self.head)
        struct.pack_into("<H", head, 105, length)
        return replace(self, head=bytes(head))

    @property
    def is_copc(self) -> bool:
        """Whether the points lie in the chunks of an octree, in no order of time (COPC 1.0)."""
        return bool(self.vlrs) and self.owner(self.vlrs[0][0]) == COPC and self.is_compressed

    @property
    def chunk_size(self) -> int:
        """Number of points that are decoded together; 1 where it is none or differs by chunk."""
        vlr = lazrs.LazVlr(self.laszip) if self.is_compressed else None
        if vlr is None or vlr.uses_variable_size_chunks():
            return 1
        return vlr.chunk_size()

    @cached_property
    def laszip(self) -> bytes:
        """Data of the LASzip VLR, which says how the points are compressed."""
        starts = [(a + VLR_HEADER.size, b) for a, b in self.vlrs if self.owner(a)[0] == LASZIP]
        if not starts:
            raise ValueError(
                f"{self.path} is damaged: its points are compressed, and no LASzip VLR says how. "
                "Copy the file anew."
            )
        return self.head[slice(*starts[0])]

    @property
    def tail(self) -> int:
        """Byte where EVLRs or waveforms start behind the points; the size where none are."""
        starts = [self.size]
        if self.version >= (1, 3) and self.head[6] & 2:  # waveforms inside
            starts += self.field("Q", 227)
        if self.version >= (1, 4) and self.field("I", 243)[0]:
            starts += self.field("Q", 235)
        return min(starts)

    def decoder(self, file: BinaryIO, threads: bool = True, is_brief: bool = False) -> Any:
        """What reads the points of a file: seek(point) and decompress_many(buffer).

        Parameters
        ----------
        file : binary file
            Open for reading.
        threads : bool
            Without them seeking is cheap.
        is_brief : bool
            Whether only gps_time and point_source_id are sure to be decoded.

        Returns
        -------
        lazrs decompressor, or what has its methods
        """
        file.seek(len(self.head))
        if not self.is_compressed:
            return PlainPoints(file, len(self.head), self.record_length)
        brief = lazrs.SELECTIVE_DECOMPRESS_GPS_TIME | lazrs.SELECTIVE_DECOMPRESS_POINT_SOURCE_ID
        fields = brief if is_brief else lazrs.SELECTIVE_DECOMPRESS_ALL
        selection = lazrs.DecompressionSelection(fields)
        if lazrs.LazVlr(self.laszip).uses_variable_size_chunks():
            return ChunkedPoints(file, self.laszip, selection)
        if threads:
            kind = lazrs.ParLasZipDecompressor
        else:
            kind = lazrs.LasZipDecompressor
        return kind(file, self.laszip, selection)
