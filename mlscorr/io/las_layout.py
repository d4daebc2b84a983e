"""What a LAS or LAZ file says of itself, checked against its bytes before its points are read.

Header and VLRs are kept as bytes, not parsed and written anew: so all that nobody changes comes
out as it went in, also LAS 1.0 (which laspy cannot write), unknown VLRs and reserved fields.
Byte positions are those of the ASPRS LAS 1.4 R15 specification; lazrs decodes the points.
"""

import struct
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import lazrs
import numpy as np

HEADER_SIZES = (227, 227, 227, 235, 375)  # of LAS 1.0 to 1.4
RECORD_LENGTHS = {0: 20, 1: 28, 2: 26, 3: 34, 4: 57, 5: 63, 6: 30, 7: 36, 8: 38, 9: 59, 10: 67}
WITHOUT_TIME = (0, 2)
COMPRESSED = 0x80  # bit of the point format
WAVEFORMS_INSIDE = 0x02  # bit of the global encoding
VLR_HEADER, EVLR_HEADER = 54, 60
LASZIP = b"laszip encoded"
LARGEST_CHUNK = 10_000_000  # points; lazrs allocates whole LAZ chunks and aborts if it cannot


@dataclass(frozen=True)
class Layout:
    """Where the parts of a LAS file lie: head (header and VLRs), points, tail (EVLRs, waveforms).

    Parameters
    ----------
    path : Path
    head : bytes
        All that precedes the points.
    size : int
        Of the whole file. Units: bytes.
    """

    path: Path
    head: bytes
    size: int

    def field(self, form, start):
        """Values of the header at a byte position, in struct's notation."""
        return struct.unpack_from("<" + form, self.head, start)

    @property
    def version(self):
        """1.0 to 1.4, as (major, minor)."""
        return self.field("BB", 24)

    @property
    def is_standard(self):
        """Whether gps_time is adjusted standard GPS time, not seconds of week."""
        return bool(self.head[6] & 1)

    @property
    def point_format(self):
        return self.head[104] & 0x3F

    @property
    def is_compressed(self):
        return bool(self.head[104] & COMPRESSED)

    @property
    def record_length(self):
        """Of a point with its extra bytes. Units: bytes."""
        return self.field("H", 105)[0]

    @property
    def points(self):
        return self.field(*(("Q", 247) if self.version >= (1, 4) else ("I", 107)))[0]

    @property
    def scale(self):
        """Of X, Y, Z: (3,). Units: m."""
        return np.array(self.field("3d", 131))

    @property
    def offset(self):
        """Of X, Y, Z: (3,). Units: m."""
        return np.array(self.field("3d", 155))

    @property
    def record(self):
        """Type of a point record: the fields that are used here by name, the others by length."""
        return np.dtype(
            {
                "names": ["X", "Y", "Z", "intensity", "gps_time"],
                "formats": ["<i4", "<i4", "<i4", "<u2", "<f8"],
                "offsets": [0, 4, 8, 12, 20 if self.point_format < 6 else 22],
                "itemsize": self.record_length,
            }
        )

    @cached_property
    def vlrs(self):
        """Start and end in head of each VLR. Raises ValueError when they don't fit."""
        count, bounds = self.field("I", 100)[0], []
        position = self.field("H", 94)[0]
        for _ in range(count):
            end = position + VLR_HEADER
            if end <= len(self.head):
                end += self.field("H", position + 20)[0]
            if end > len(self.head):
                raise ValueError(
                    f"{self.path} is damaged: it announces {count} VLRs in its header, but only "
                    f"{len(bounds)} fit before the points at byte {len(self.head)}."
                )
            bounds.append((position, end))
            position = end
        return bounds

    def user_id(self, start):
        """Who defined the VLR that starts at a byte of head."""
        return self.head[start + 2 : start + 18].split(b"\0")[0]

    @cached_property
    def laszip(self):
        """Data of the LASzip VLR, which says how the points are compressed."""
        found = [self.head[a + VLR_HEADER : b] for a, b in self.vlrs if self.user_id(a) == LASZIP]
        if not found:
            raise ValueError(f"{self.path} is damaged: compressed, but without a LASzip VLR.")
        return found[0]

    @property
    def tail(self):
        """Byte where EVLRs or waveforms start behind the points; the size where none are."""
        starts = [self.size]
        if self.version >= (1, 3) and self.head[6] & WAVEFORMS_INSIDE:
            starts += self.field("Q", 227)
        if self.version >= (1, 4) and self.field("I", 243)[0]:
            starts += self.field("Q", 235)
        return min(starts)

    def decoder(self, file, threads=True):
        """What reads the points of the open file: seek(point) and decompress_many(buffer).

        Without threads seeking is cheap, and only gps_time is sure to be decoded.
        """
        file.seek(len(self.head))
        if not self.is_compressed:
            return _PlainPoints(file, len(self.head), self.record_length)
        if threads:
            return lazrs.ParLasZipDecompressor(file, self.laszip)
        time_only = lazrs.DecompressionSelection(lazrs.SELECTIVE_DECOMPRESS_GPS_TIME)
        return lazrs.LasZipDecompressor(file, self.laszip, time_only)


class _PlainPoints:
    """Uncompressed points, read as lazrs reads the compressed ones."""

    def __init__(self, file, start, record_length):
        self.file, self.start, self.record_length = file, start, record_length

    def seek(self, point):
        self.file.seek(self.start + point * self.record_length)

    def decompress_many(self, buffer):
        if self.file.readinto(buffer) != len(buffer):
            raise lazrs.LazrsError("the file ends")


def read_layout(path):
    """Layout of a LAS 1.0-1.4 or LAZ file with gps_time, checked.

    Raises ValueError when the file is missing, is none of these, has no points or no gps_time,
    or holds less than its header says. Nothing is allocated by a number that was not checked.
    """
    path = Path(path)
    if not path.is_file():
        raise ValueError(f"There is no file {path}. Check cloud.files in survey.toml.")
    size = path.stat().st_size
    with open(path, "rb") as file:
        head = file.read(HEADER_SIZES[0])
        if head[:4] != b"LASF" or len(head) < HEADER_SIZES[0]:
            raise ValueError(
                f"{path} is not a LAS or LAZ file: of its {size} bytes the first are "
                f"{head[:4]!r}, not b'LASF' and a header of at least {HEADER_SIZES[0]} bytes."
            )
        start = struct.unpack_from("<I", head, 96)[0]
        if start > size:
            raise ValueError(_cut_off(path, f"its points start at byte {start} of {size}"))
        layout = Layout(path, head + file.read(max(0, start - len(head))), size)
        _check_header(layout)
        points_end = _check_chunks(layout, file) if layout.is_compressed else _check_size(layout)
        _check_tail(layout, file, points_end)
    return layout


def _cut_off(path, evidence):
    return f"{path} is cut off: {evidence}. Its writing or copying was interrupted; copy it anew."


def _check_header(layout):
    path, (major, minor) = layout.path, layout.version
    if major != 1 or minor >= len(HEADER_SIZES):
        raise ValueError(f"{path} is LAS {major}.{minor}; LAS 1.0 to 1.4 can be read.")
    if not HEADER_SIZES[minor] <= layout.field("H", 94)[0] <= len(layout.head):
        raise ValueError(
            f"{path} is damaged: its header has {layout.field('H', 94)[0]} bytes and its points "
            f"start at byte {len(layout.head)}; LAS 1.{minor} needs {HEADER_SIZES[minor]}."
        )
    number, length = layout.point_format, layout.record_length
    if number in WITHOUT_TIME:
        raise ValueError(
            f"{path} has point format {number}, which holds no gps_time, so its points cannot be "
            "placed on the trajectory. Export it in format 1, 3 or 6 to 10."
        )
    if number not in RECORD_LENGTHS or length < RECORD_LENGTHS[number]:
        raise ValueError(
            f"{path} is damaged: point format {number} with records of {length} bytes does not "
            "exist."
        )
    if not (np.isfinite([layout.scale, layout.offset]).all() and (layout.scale > 0).all()):
        raise ValueError(
            f"{path} is damaged: scale {layout.scale} m and offset {layout.offset} m of its "
            "coordinates must be numbers, the scale above zero."
        )
    if layout.points == 0:
        raise ValueError(f"{path} holds 0 points; perhaps its writing was interrupted.")
    if layout.vlrs and layout.user_id(layout.vlrs[0][0]) == b"copc":
        raise ValueError(
            f"{path} is a COPC file, whose index would be wrong once points have moved. Use the "
            "original file, or convert it: pdal translate IN.copc.laz OUT.laz."
        )


def _check_size(layout):
    """Byte where uncompressed points end."""
    end = len(layout.head) + layout.points * layout.record_length
    if end > layout.size:
        whole = (layout.size - len(layout.head)) // layout.record_length
        evidence = f"{whole} of the {layout.points} points that its header announces fit into"
        raise ValueError(_cut_off(layout.path, f"{evidence} its {layout.size} bytes"))
    return end


def _check_chunks(layout, file):
    """Byte where compressed points end and the chunk table starts."""
    path, start = layout.path, len(layout.head)
    file.seek(start)
    table = int.from_bytes(file.read(8), "little", signed=True)
    if not start + 8 <= table <= layout.size - 8:
        raise ValueError(
            _cut_off(path, f"its LAZ chunk table should be at byte {table} of {layout.size}")
        )
    file.seek(table + 4)
    count = int.from_bytes(file.read(4), "little")
    if count * layout.record_length > table - start:  # a chunk starts with a plain point
        raise ValueError(f"{path} is damaged: {count} LAZ chunks cannot fit into {table} bytes.")
    try:
        vlr = lazrs.LazVlr(layout.laszip)
        file.seek(start)
        chunks = lazrs.read_chunk_table(file, vlr)
        points, used = (sum(column) for column in zip(*chunks, strict=True))
        largest = max(chunk[0] for chunk in chunks)
        length = vlr.item_size()
    except (lazrs.LazrsError, ValueError, TypeError) as error:
        raise ValueError(f"{path} is damaged: its LAZ chunks cannot be read ({error}).") from error
    if length != layout.record_length or used > table - start:
        raise ValueError(
            f"{path} is damaged: LAZ chunks of {used} bytes with {length} bytes a point are not "
            f"what lies in {table - start} bytes with {layout.record_length} bytes a point."
        )
    if points < layout.points:
        evidence = f"its LAZ chunks hold at most {points} of the {layout.points} points"
        raise ValueError(_cut_off(path, f"{evidence} that its header announces"))
    if largest > LARGEST_CHUNK:
        raise ValueError(
            f"{path} is compressed in chunks of {largest} points (limit {LARGEST_CHUNK}), which "
            "do not fit into memory. Compress it anew: pdal translate IN.laz OUT.laz."
        )
    return table


def _check_tail(layout, file, points_end):
    """That EVLRs and waveforms lie between the points and the end of the file."""
    path, size = layout.path, layout.size
    if not points_end <= layout.tail <= size:
        raise ValueError(
            _cut_off(path, f"data behind the points should be at byte {layout.tail} of {size}")
        )
    if layout.version < (1, 4):
        return
    position, count = layout.field("QI", 235)
    for number in range(count):
        header = b""
        if position + EVLR_HEADER <= size:
            file.seek(position)
            header = file.read(EVLR_HEADER)
        position += EVLR_HEADER + int.from_bytes(header[20:28], "little")
        if position > size:
            raise ValueError(
                _cut_off(path, f"{number} of its {count} EVLRs fit into its {size} bytes")
            )
