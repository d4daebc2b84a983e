"""Checks of LAS and LAZ files against their bytes before their points are read."""

import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import BinaryIO

import lazrs
import numpy as np
from laspy import PointFormat, supported_point_formats

from mlscorr.io.clouds.conversion import converted, is_foreign
from mlscorr.io.clouds.las_layout import COPC, LasLayout, decoding
from mlscorr.io.settings import SETTINGS
from mlscorr.io.store import as_path, file_state, is_there, open_file

INFO = struct.Struct("<5d2Q2d88x")  # center, half edge, spacing; root page; first and last time
ENTRY = np.dtype([("key", "(4,)<i4"), ("start", "<u8"), ("size", "<i4"), ("points", "<i4")])
HEADER_SIZES = (227, 227, 227, 235, 375, 393)  # bytes, of LAS 1.0 to 1.5
COPC_FORMATS = (6, 7, 8)  # COPC 1.0
EVLR_HEADER = struct.Struct("<2x16sHQ32s")  # owner, record, length of data, description


def read_layout(path: str | Path) -> LasLayout:
    """Read and check the LasLayout of a LAS 1.0-1.5 or LAZ file with gps_time, or of an E57 or PLY.

    No memory is allocated by an unchecked number.

    Parameters
    ----------
    path : path

    Returns
    -------
    LasLayout

    Raises
    ------
    ValueError
        If the file is missing, has another format, has no points or no gps_time, or is shorter than
        its header states.
    """
    path = as_path(path)
    if not is_there(path):
        raise ValueError(f"{path} does not exist. Check cloud.files in survey.toml.")
    source = None
    if is_foreign(path):
        source = path
        path = converted(path).path
    size = file_state(path)[0]
    if not size:
        raise ValueError(f"{path} is empty (0 bytes): copying was interrupted. Copy it again.")
    with open_file(path, is_scattered=True) as file:
        head = file.read(HEADER_SIZES[0])
        if head[:4] != b"LASF" or len(head) < HEADER_SIZES[0]:
            raise ValueError(
                f"{path} is not a LAS or LAZ file (or .e57, .ply), or it is truncated: it has "
                f"{size} bytes and starts with {head[:4]!r}, while a LAS header has "
                f"{HEADER_SIZES[0]} bytes and starts with b'LASF'."
            )
        start = struct.unpack_from("<I", head, 96)[0]
        if start > size:
            raise ValueError(_cut_off(path, f"its points start at byte {start} of {size}"))
        layout = LasLayout(path, head + file.read(max(0, start - len(head))), size, source)
        _check_header(layout)
        if layout.is_compressed:
            points_end = _check_chunks(layout, file)
        else:
            points_end = _check_size(layout)
        _check_tail(layout, file, points_end)
    return layout


def _cut_off(path, evidence):
    return f"{path} is truncated: {evidence}. Writing or copying was interrupted; copy it again."


def _check_header(layout):
    path, (major, minor) = layout.path, layout.version
    if major != 1 or minor >= len(HEADER_SIZES):
        raise ValueError(f"{path} is LAS {major}.{minor}; only LAS 1.0 to 1.5 can be read.")
    if not HEADER_SIZES[minor] <= layout.field("H", 94)[0] <= len(layout.head):
        raise ValueError(
            f"{path} is damaged: its header has {layout.field('H', 94)[0]} bytes and its points "
            f"start at byte {len(layout.head)}; LAS 1.{minor} needs {HEADER_SIZES[minor]}."
        )
    number = layout.point_format
    known = number in supported_point_formats()
    if known and "gps_time" not in PointFormat(number).dimension_names:
        raise ValueError(
            f"{path} has point format {number}, which has no gps_time, so its points can't be "
            "located on the trajectory. Export it in format 1, 3 or 6 to 10."
        )
    if not known or layout.extra_bytes < 0:
        raise ValueError(
            f"{path} is damaged: point format {number} with records of {layout.record_length} "
            "bytes does not exist."
        )
    numbers = np.abs([layout.scale, layout.offset])
    if not ((numbers <= SETTINGS.largest_coordinate).all() and (layout.scale > 0).all()):
        raise ValueError(
            f"{path} is damaged: scale {layout.scale} m and offset {layout.offset} m of its "
            f"coordinates must be numbers up to {SETTINGS.largest_coordinate:g} m, the scale "
            "above zero. Copy the file again."
        )
    old_points = layout.field("I", 107)[0]  # LAS up to 1.3 has it, zero if unused
    if old_points not in (0, layout.points):
        raise ValueError(
            f"{path} is damaged: its header states {layout.points} points, and {old_points} in "
            "the field of older versions. Copy the file again."
        )
    if layout.points == 0:
        raise ValueError(f"{path} has 0 points; writing was probably interrupted.")
    _check_kind(layout)


def _check_kind(layout):
    """Check that a LAS 1.5 or COPC file conforms to its specification."""
    path = layout.path
    number = layout.point_format
    if layout.version >= (1, 5) and number < 6:
        raise ValueError(
            f"{path} is damaged: LAS 1.5 has point formats 6 to 10, not {number}. Export it again."
        )
    if layout.has_time_offset and not layout.is_standard:
        raise ValueError(
            f"{path} states a time offset together with times in seconds of the week, which have "
            "none (bits 6 and 0 of its global encoding). Export it again."
        )
    if layout.is_copc and number not in COPC_FORMATS:
        raise ValueError(
            f"{path} is damaged: a COPC file has points of formats 6 to 8, not {number}. Write "
            "it again: pdal translate IN.copc.laz OUT.laz."
        )


def _check_size(layout):
    """Byte at which uncompressed points end, checked."""
    start = len(layout.head)
    end = min(layout.tail, layout.size)
    whole = (end - start) // layout.record_length
    if whole < layout.points and end == layout.size:
        evidence = f"{whole} of the {layout.points} points stated in its header fit into"
        raise ValueError(_cut_off(layout.path, f"{evidence} its {layout.size} bytes"))
    if whole != layout.points:
        raise ValueError(_other_count(layout, whole))
    return start + layout.points * layout.record_length


def _other_count(layout, points):
    return (
        f"{layout.path} is damaged: its header states {layout.points} points, and the file has "
        f"{points}. Writing may have been interrupted; export it again."
    )


def _check_chunks(layout, file):
    """Byte at which compressed points end and the chunk table starts, checked."""
    path = layout.path
    start = len(layout.head)
    _check_laszip(layout)
    file.seek(start)
    table = int.from_bytes(file.read(8), "little", signed=True)
    if not start + 8 <= table <= layout.size - 8:
        raise ValueError(
            _cut_off(path, f"its LAZ chunk table should be at byte {table} of {layout.size}")
        )
    file.seek(table + 4)
    count = int.from_bytes(file.read(4), "little")
    if not 0 < count * layout.record_length <= table - start:  # a chunk starts with a plain point
        raise ValueError(
            f"{path} is damaged: {count} LAZ chunks do not fit into {table} bytes. Copy it again."
        )
    with decoding(f"{path} is damaged: its LAZ chunks can't be read"):
        file.seek(start)
        chunks = lazrs.read_chunk_table(file, lazrs.LazVlr(layout.laszip))
        layout.decoder(file, threads=False)
    while len(chunks) > 1 and chunks[-1] == (0, 0):  # added by lazrs if chunks differ in size
        chunks.pop()
    if (used := sum(length for _, length in chunks)) > table - start:
        raise ValueError(
            f"{path} is damaged: LAZ chunks of {used} bytes do not fit into {table - start} "
            "bytes. Copy it again."
        )
    _check_chunk_points(layout, [points for points, _ in chunks])
    if layout.point_format >= 6:  # layered chunks state their number after the first point
        file.seek(start + 8 + used - chunks[-1][1] + layout.record_length)
        whole = sum(points for points, _ in chunks[:-1])
        whole += int.from_bytes(file.read(4), "little")
        if whole != layout.points:
            raise ValueError(_other_count(layout, whole))
    if layout.is_copc:
        _check_hierarchy(layout, file, chunks)
    return table


def _check_chunk_points(layout, points):
    """Check that chunks with these points (the last may be smaller) match the file and fit
    memory.
    """
    path = layout.path
    whole = sum(points)
    longest = max(points)
    if whole < layout.points:
        evidence = f"its LAZ chunks have at most {whole} of the {layout.points} points"
        raise ValueError(_cut_off(path, f"{evidence} that its header states"))
    if longest > SETTINGS.largest_chunk:
        raise ValueError(
            f"{path} is compressed in chunks of {longest} points (limit "
            f"{SETTINGS.largest_chunk}), which do not fit into memory. Compress it again: pdal "
            "translate IN.laz OUT.laz."
        )
    if whole - points[-1] >= layout.points:
        raise ValueError(_other_count(layout, f"more than {whole - points[-1]}"))


def _check_laszip(layout):
    """Check that the LASzip VLR describes the points of the header in a way that lazrs supports."""
    path = layout.path
    data = layout.laszip
    expected = lazrs.LazVlr.new_for_compression(layout.point_format, layout.extra_bytes)
    if int.from_bytes(data[:2], "little") == 1:
        raise ValueError(
            f"{path} is compressed point by point (LASzip's compressor 1, before 2011), without "
            "the chunks that lazrs reads. Compress it again: laszip -i IN.laz -o OUT.laz, or "
            "pdal translate IN.laz OUT.laz."
        )
    items, known = (_items(vlr) for vlr in (data, bytes(expected.record_data())))
    if items != known:
        raise ValueError(
            f"{path} is damaged: its LASzip VLR does not describe points of format "
            f"{layout.point_format} with {layout.record_length} bytes. Copy it again."
        )


def _items(laszip):
    """Number of items in a LASzip VLR, and kind and length of each, without versions."""
    count = laszip[32:34]
    rows = laszip[34:]
    return count, [row[:2] for row in struct.iter_unpack("<HHH", rows[: len(rows) // 6 * 6])]


def _check_tail(layout, file, points_end):
    """Check that EVLRs and waveforms are between the points and the end of the file."""
    path = layout.path
    size = layout.size
    if not points_end <= layout.tail <= size:
        raise ValueError(
            _cut_off(path, f"data after the points should be at byte {layout.tail} of {size}")
        )
    for number, (position, length) in enumerate(evlrs(layout, file)):
        if position + length > size:
            announced = f"{number} of its {layout.field('I', 243)[0]} EVLRs"
            raise ValueError(_cut_off(path, f"{announced} fit into its {size} bytes"))


def evlrs(layout: LasLayout, file: BinaryIO) -> Iterator[tuple[int, int]]:
    """Yield position and size of each EVLR. Units: bytes.

    Parameters
    ----------
    layout : LasLayout
    file : binary file
    """
    if layout.version < (1, 4):
        return
    position, count = layout.field("QI", 235)
    for _ in range(count):
        file.seek(min(position, layout.size))  # in a damaged file it may be anywhere
        header = file.read(EVLR_HEADER.size)
        size = EVLR_HEADER.size + int.from_bytes(header[20:28], "little")
        yield position, size
        position += size


def variable_records(layout: LasLayout, user: bytes, record: int) -> list[bytes]:
    """Data of the VLRs and EVLRs with a user and a record ID.

    Parameters
    ----------
    layout : LasLayout
    user : bytes
    record : int
    """
    data = list(layout.vlr_data(user, record))
    with open_file(layout.path, is_scattered=True) as file:
        for position, size in evlrs(layout, file):
            file.seek(position)
            owner = EVLR_HEADER.unpack(file.read(EVLR_HEADER.size))
            if (owner[0].split(b"\0")[0], owner[1]) == (user, record):
                data.append(file.read(size - EVLR_HEADER.size))
    return data


def _check_hierarchy(layout: LasLayout, file: BinaryIO, chunks: Sequence[tuple[int, int]]) -> None:
    """Check that LAZ chunks of a COPC file and nodes of its hierarchy correspond."""
    info = b"".join(layout.vlr_data(*COPC))
    if len(info) != INFO.size:
        raise ValueError(
            f"{layout.path} is damaged: its COPC info VLR has {len(info)} bytes, not "
            f"{INFO.size}. Copy the file again."
        )
    start, size = INFO.unpack(info)[5:7]
    entries = np.concatenate([np.empty(0, ENTRY), *_pages(layout, file, start, size, len(chunks))])
    nodes = np.sort(entries[entries["points"] > 0], order="start")
    points, sizes = np.array(chunks, np.int64).T
    starts = len(layout.head) + 8 + np.cumsum(sizes) - sizes  # after the position of their table
    same = len(nodes) == len(chunks) and (
        np.array_equal(nodes["start"], starts)
        and np.array_equal(nodes["size"], sizes)
        and np.array_equal(nodes["points"], points)
    )
    if not same:
        raise ValueError(
            f"{layout.path} is damaged: its COPC hierarchy ({len(nodes)} nodes, "
            f"{nodes['points'].sum(dtype=np.int64)} points) does not match its LAZ chunks "
            f"({len(chunks)}, {points.sum()} points). A program without COPC support may have "
            "rewritten it. Write it again: pdal translate IN.copc.laz OUT.laz."
        )


def _pages(layout, file, start, size, chunks) -> Iterator[np.ndarray]:
    """Yield the entries of each page of a hierarchy."""
    pages = [(start, size)]
    known = {start}
    while pages:
        start, size = pages.pop()
        if start + size > layout.size:
            raise ValueError(
                f"{layout.path} is truncated: its COPC hierarchy should extend to byte "
                f"{start + size} of {layout.size}. Writing or copying was interrupted; copy it "
                "again."
            )
        if size <= 0 or size % ENTRY.itemsize:
            raise ValueError(
                f"{layout.path} is damaged: {size} bytes are not a page of a COPC hierarchy. "
                "Copy it again."
            )
        file.seek(start)
        entries = np.frombuffer(file.read(size), ENTRY)
        yield entries
        for entry in entries[entries["points"] == -1]:  # nodes that have their own page
            page = int(entry["start"]), int(entry["size"])
            if page[0] in known or len(known) > chunks:  # a cycle of pages
                raise ValueError(
                    f"{layout.path} is damaged: its COPC hierarchy has page {page[0]} twice, or "
                    f"more pages than chunks ({chunks}). Copy it again."
                )
            known.add(page[0])
            pages.append(page)
