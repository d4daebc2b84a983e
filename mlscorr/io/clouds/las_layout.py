"""Header of a LAS or LAZ file, kept as bytes, and its point records.

laspy defines point formats and extra bytes, lazrs decodes the points. Header and VLRs are kept as
bytes instead of being rewritten by laspy, which does not preserve unchanged parts. It refuses LAS
1.0, decodes every VLR that it knows (a bad one would stop the file), and changes reserved fields,
bytes after the end of a text and the signature of a VLR. It also trusts counts before they are
checked (2^31-1 VLRs would keep it busy forever). Byte positions are those of the ASPRS LAS 1.4 R15
specification, and of 1.5 R00.
"""

from __future__ import annotations

import struct
from collections.abc import Collection, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, BinaryIO

import lazrs
import numpy as np
from laspy import PackedPointRecord, PointFormat

from mlscorr.io.store import open_file
from mlscorr.io.trajectories import ADJUSTMENT

VLR_HEADER = struct.Struct("<2x16sHH32s")  # owner, record, length of data, description
# of the VLR with the compression
LASZIP = b"laszip encoded"
LASZIP_RECORD = 22204
OLD_CLASS = "raw_classification"
NEW_CLASS = "classification"
NEW_FLAGS = "classification_flags"
# of the VLR and the EVLR of an octree
COPC = (b"copc", 1)
HIERARCHY = (b"copc", 1000)


@dataclass(frozen=True)
class LasLayout:
    """Parts of a LAS file: head (header and VLRs), points, tail (EVLRs, waveforms).

    Parameters
    ----------
    path : Path
    head : bytes
        Everything before the points.
    size : int
        Size of the whole file. Units: bytes.
    source : Path, optional
        Cloud in another format from which the file at path was made.
    """

    path: Path
    head: bytes
    size: int
    source: Path | None = None

    @property
    def cloud(self) -> Path:
        """Path of the cloud as survey.toml names it."""
        return self.source or self.path

    def field(self, form: str, start: int) -> tuple[Any, ...]:
        """Return values of the header.

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
        """True if gps_time is adjusted standard GPS time, not seconds of week."""
        return bool(self.head[6] & 1)

    @property
    def states_wkt(self) -> bool:
        """True if the CRS is stated as WKT, not by GeoKeys."""
        return bool(self.head[6] & 16)

    @property
    def has_time_offset(self) -> bool:
        """True if gps_time is standard GPS time minus an offset stated in the header."""
        return self.version >= (1, 5) and bool(self.head[6] & 64)

    @property
    def time_offset(self) -> float:
        """Offset to adjusted standard GPS time if the header states another. Units: s.

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
        """True if the points are compressed (LAZ)."""
        return bool(self.head[104] & 0x80)

    @property
    def record_length(self) -> int:
        """Length of a point with its extra bytes. Units: bytes."""
        return self.field("H", 105)[0]

    @property
    def extra_bytes(self) -> int:
        """Number of extra bytes of a point. Units: bytes."""
        return self.record_length - PointFormat(self.point_format).size

    @property
    def points(self) -> int:
        """Number of points."""
        if self.version >= (1, 4):
            return self.field("Q", 247)[0]
        return self.field("I", 107)[0]

    @property
    def scale(self) -> np.ndarray:
        """Scale of X, Y, Z, (3,). Units: m."""
        return np.array(self.field("3d", 131))

    @property
    def offset(self) -> np.ndarray:
        """Offset of X, Y, Z, (3,). Units: m."""
        return np.array(self.field("3d", 155))

    @property
    def record(self) -> np.dtype:
        """Data type of a point record: the fields used here by name, the others by length."""
        fields = PointFormat(self.point_format).dtype().fields
        names = ["X", "Y", "Z", "intensity", "gps_time", "point_source_id"]
        if self.point_format >= 6:
            names += [NEW_FLAGS, NEW_CLASS]
        else:
            names.append(OLD_CLASS)
        kinds, starts = zip(*(fields[name][:2] for name in names), strict=True)
        form: Any = {"names": names, "formats": kinds, "offsets": starts}
        return np.dtype(form | {"itemsize": self.record_length})

    def dimension(self, records: np.ndarray, name: str) -> np.ndarray:
        """Return a dimension (n,) of points by its name in laspy, in its own memory.

        Parameters
        ----------
        records : (n,) structured array
            Contiguous, as from read_records.
        name : str
            For example ``classification``, ``return_number`` or ``scan_angle``.

        Raises
        ------
        ValueError
            If points of this format have no such dimension.
        """
        point_format = PointFormat(self.point_format)
        known = list(point_format.dimension_names)
        if name not in known:
            raise ValueError(
                f"{self.path} has no dimension {name!r}: points of format {self.point_format} have "
                f"{', '.join(known)}."
            )
        kinds = point_format.dtype().fields
        form: Any = {
            "names": list(kinds),
            "formats": [kind[0] for kind in kinds.values()],
            "offsets": [kind[1] for kind in kinds.values()],
        }
        whole = np.dtype(form | {"itemsize": self.record_length})
        return np.array(PackedPointRecord(records.view(whole), point_format)[name])

    def is_noise(self, records: np.ndarray, classes: Collection[int]) -> np.ndarray:
        """Flag points that are withheld or in some classes, (n,) bool.

        Source: ASPRS LAS 1.4 R15, classification of point formats 0 to 5 and of 6 to 10.

        Parameters
        ----------
        records : (n,) structured array
        classes : collection of int
        """
        is_left_out = np.zeros(256, bool)  # by the byte with the class
        is_left_out[list(classes)] = True
        if self.point_format >= 6:
            return is_left_out[records[NEW_CLASS]] | ((records[NEW_FLAGS] & 4) > 0)
        byte = np.arange(256)
        is_left_out = is_left_out[byte & 31] | (byte >= 128)  # 5 bits of class, the 8th is withheld
        return is_left_out[records[OLD_CLASS]]

    @cached_property
    def vlrs(self) -> list[tuple[int, int]]:
        """Start and end in head of each VLR. Raises ValueError if they do not fit."""
        count = self.field("I", 100)[0]
        bounds = []
        position = self.field("H", 94)[0]
        for _ in range(count):
            end = position + VLR_HEADER.size
            if end <= len(self.head):
                end += VLR_HEADER.unpack_from(self.head, position)[2]
            if end > len(self.head):
                raise ValueError(
                    f"{self.path} is damaged: its header states {count} VLRs, but only "
                    f"{len(bounds)} fit before the points at byte {len(self.head)}."
                )
            bounds.append((position, end))
            position = end
        return bounds

    def owner(self, start: int) -> tuple[bytes, int]:
        """Return user and record of the VLR that starts at a byte of head.

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
        """Yield data of the VLRs with a user and a record ID.

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
        """Return header and VLRs, with the VLRs of a user and a record replaced by one, or removed.

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
        end = header_size
        if self.vlrs:
            end = self.vlrs[-1][1]
        between = self.head[end:]
        head = bytearray(self.head[:header_size] + b"".join(kept) + between)
        struct.pack_into("<II", head, 96, len(head), len(kept))
        return bytes(head)

    def with_record_length(self, length: int) -> LasLayout:
        """Return the LasLayout with longer point records.

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
        """True if the points are in the chunks of an octree, not in order of time (COPC 1.0)."""
        return bool(self.vlrs) and self.owner(self.vlrs[0][0]) == COPC and self.is_compressed

    @property
    def chunk_size(self) -> int:
        """Number of points that are decoded together; 1 if there are no chunks or sizes differ."""
        if not self.is_compressed:
            return 1
        vlr = lazrs.LazVlr(self.laszip)
        if vlr.uses_variable_size_chunks():
            return 1
        return vlr.chunk_size()

    @cached_property
    def laszip(self) -> bytes:
        """Data of the LASzip VLR, which describes the compression of the points."""
        starts = [(a + VLR_HEADER.size, b) for a, b in self.vlrs if self.owner(a)[0] == LASZIP]
        if not starts:
            raise ValueError(
                f"{self.path} is damaged: its points are compressed, but there is no LASzip VLR. "
                "Copy the file again."
            )
        return self.head[slice(*starts[0])]

    @property
    def tail(self) -> int:
        """Byte after the points at which EVLRs or waveforms start, or the file size without any."""
        starts = [self.size]
        if self.version >= (1, 3) and self.head[6] & 2:  # internal waveforms
            starts += self.field("Q", 227)
        if self.version >= (1, 4) and self.field("I", 243)[0]:
            starts += self.field("Q", 235)
        return min(starts)

    def decoder(self, file: BinaryIO, threads: bool = True, is_brief: bool = False) -> Any:
        """Return a reader of a file's points, with seek(point) and decompress_many(buffer).

        Parameters
        ----------
        file : binary file
            Open for reading.
        threads : bool
            False makes seeking cheap.
        is_brief : bool
            True if only gps_time and point_source_id need to be decoded.

        Returns
        -------
        lazrs decompressor, or an object with its methods
        """
        file.seek(len(self.head))
        if not self.is_compressed:
            return _PlainPoints(file, len(self.head), self.record_length)
        fields = lazrs.SELECTIVE_DECOMPRESS_ALL
        if is_brief:
            fields = lazrs.SELECTIVE_DECOMPRESS_GPS_TIME
            fields |= lazrs.SELECTIVE_DECOMPRESS_POINT_SOURCE_ID
        selection = lazrs.DecompressionSelection(fields)
        if lazrs.LazVlr(self.laszip).uses_variable_size_chunks():
            return _ChunkedPoints(file, self.laszip, selection)
        if threads:
            return lazrs.ParLasZipDecompressor(file, self.laszip, selection)
        return lazrs.LasZipDecompressor(file, self.laszip, selection)


def read_records(
    layout: LasLayout,
    chunk_size: int,
    first: int = 0,
    end: int | None = None,
    is_brief: bool = False,
) -> Iterator[np.ndarray]:
    """Yield records in chunks, each in the memory of the previous one.

    Parameters
    ----------
    layout : LasLayout
    chunk_size : int
        Points in a chunk.
    first, end : int
        See ``read_chunks``.
    is_brief : bool
        True if gps_time and point_source_id suffice.

    Yields
    ------
    (n,) structured array

    Raises
    ------
    ValueError
        For points that cannot be decoded.
    """
    length = layout.record_length
    last = layout.points if end is None else end
    buffer = np.empty(min(chunk_size, last - first) * length, np.uint8)
    with open_file(layout.path) as file:
        decoder = layout.decoder(file, is_brief=is_brief)
        if first:
            decoder.seek(first)
        for start in range(first, last, chunk_size):
            stop = min(start + chunk_size, last)
            raw = buffer[: (stop - start) * length]
            with decoding_points(layout, start, stop):
                decoder.decompress_many(raw)
            yield raw.view(layout.record)


def decoding_points(layout: LasLayout, first: int, end: int) -> AbstractContextManager:
    """Context in which lazrs reads some points of a file."""
    if end - first > 1:
        points = f"Points {first} to {end - 1}"
    else:
        points = f"Point {first}"
    return decoding(f"{points} of {layout.points} in {layout.path} can't be decoded")


@contextmanager
def decoding(message: str) -> Iterator[None]:
    """Context in which errors and aborts of lazrs become a message.

    Parameters
    ----------
    message : str
        Subject of the error; lazrs' own words follow in brackets.

    Raises
    ------
    ValueError
    """
    try:
        yield
    except BaseException as error:
        # a Rust panic derives from BaseException, and its class cannot be imported
        if not isinstance(error, lazrs.LazrsError) and type(error).__name__ != "PanicException":
            raise
        raise ValueError(
            f"{message} ({error}). The file is truncated or damaged; copy it again."
        ) from error


class _PlainPoints:
    """Reader of uncompressed points, with the interface of lazrs.

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
        """Continue with a point.

        Parameters
        ----------
        point : int
            Its index.
        """
        self._file.seek(self._start + point * self._length)

    def decompress_many(self, buffer: bytearray | np.ndarray) -> None:
        """Fill a buffer with the next points.

        Parameters
        ----------
        buffer : writable buffer of whole points

        Raises
        ------
        lazrs.LazrsError
            If points are missing.
        """
        if self._file.readinto(buffer) != len(buffer):
            raise lazrs.LazrsError("the file ends")


class _ChunkedPoints:
    """Reader of points like lazrs' decompressors, whose seek fails if chunks differ in size.

    Parameters
    ----------
    file : binary file
        Open for reading where the points start.
    laszip : bytes
        Data of the LASzip VLR.
    selection : lazrs.DecompressionSelection
        Fields to decode.
    """

    def __init__(self, file: BinaryIO, laszip: bytes, selection: lazrs.DecompressionSelection):
        self._file = file
        self._laszip = laszip
        self._selection = selection
        vlr = lazrs.LazVlr(laszip)
        self._length = vlr.item_size()
        self._chunks = lazrs.read_chunk_table(file, vlr)  # leaves the file at the first chunk
        points, sizes = np.array(self._chunks, np.int64).T
        self._firsts = np.cumsum(points) - points  # indices of the chunks' first points
        self._starts = file.tell() + np.cumsum(sizes) - sizes
        self._next = 0
        self._buffer = np.empty(0, np.uint8)

    def seek(self, point: int) -> None:
        """Continue with a point.

        Parameters
        ----------
        point : int
            Its index.
        """
        self._next = int(np.searchsorted(self._firsts, point, side="right")) - 1
        before = point - int(self._firsts[self._next])
        self._buffer = self._decoded(1)[before * self._length :]

    def decompress_many(self, buffer: bytearray | np.ndarray) -> None:
        """Fill a buffer with the next points.

        Parameters
        ----------
        buffer : writable buffer of whole points

        Raises
        ------
        lazrs.LazrsError
            If points are missing or cannot be decoded.
        """
        rest = np.frombuffer(buffer, np.uint8)
        while len(rest):
            if not len(self._buffer):
                self._buffer = self._decoded(len(rest) // self._length)
            taken = min(len(rest), len(self._buffer))
            rest[:taken] = self._buffer[:taken]
            rest = rest[taken:]
            self._buffer = self._buffer[taken:]

    def _decoded(self, points):
        """Bytes of the next chunks with at least a given number of points, if there are as many."""
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
