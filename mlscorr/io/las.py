"""Points of LAS and LAZ files by chunks, and their corrected copies.

lazrs shares decoding and encoding among the cores by itself; threads of our own gain nothing
beside it (they waited on the same cores, and its single-threaded coders hold Python's lock).
"""

import hashlib
import io
import os
import shutil
import struct
from functools import partial
from pathlib import Path

import lazrs
import numpy as np

from mlscorr.io.extra_bytes import add_sigma_fields, with_sigmas
from mlscorr.io.las_layout import COMPRESSED, LASZIP, RECORD_LENGTHS, read_layout
from mlscorr.survey import PointCloud

PLACES = 65  # sampled over a file
CHUNK_SIZE = 1_000_000  # points
BLOCK = 1 << 20  # bytes
INTEGER_LIMIT = 2**31 - 1  # of the coordinates in a file


def sample_gps_times(path):
    """Number of points, time flag and a few times of a LAS or LAZ file, which is checked.

    Returns
    -------
    points : int
    is_standard : bool
        Whether the header says adjusted standard GPS time, not seconds of week.
    times : (65 or fewer,) array
        gps_time of points spread over the file, first and last among them, in file order.
        Units: s.

    Raises ValueError when the file is missing, not LAS, cut off, or without gps_time.
    """
    layout = read_layout(path)
    places = np.unique(np.linspace(0, layout.points - 1, PLACES).astype(np.int64))
    return layout.points, layout.is_standard, _sample(layout, places)


def read_chunks(cloud_file, chunk_size=CHUNK_SIZE):
    """Points of a CloudFile by chunks, in file order, with times in the trajectory's system.

    Withheld points are among them. Yields PointCloud. Raises ValueError for a file that is cut
    off or damaged, and for a gps_time that is not a number.
    """
    layout = read_layout(cloud_file.path)
    scale, offset = layout.scale, layout.offset
    for records in _chunks(layout, chunk_size):
        xyz = np.empty((len(records), 3))
        for axis, name in enumerate("XYZ"):
            np.multiply(records[name], scale[axis], out=xyz[:, axis])
        xyz += offset
        times = records["gps_time"] + cloud_file.time_constant
        yield PointCloud(xyz, times, records["intensity"].copy())


def write_corrected(cloud_file, target, correction, watch=None, sigma=None):
    """Copy a CloudFile with corrected coordinates; all else stays as it was, byte for byte.

    What changes: X, Y, Z of each point, the bounds in the header, and where it must, the
    position of what follows the points. The target's suffix says whether it is compressed. It
    appears whole or not at all: it is written beside its place as ``.part``, and read again
    before it takes its name. A file there is replaced.

    Parameters
    ----------
    cloud_file : CloudFile
    target : path
        ``.las`` or ``.laz``, not the input.
    correction : Correction, or anything else with ``apply(cloud) -> cloud``
    watch : function, optional
        Called with the gps_time (n,) of each chunk that is done, in the trajectory's system.
    sigma : PointSigma, optional
        Adds the fields sigma_easting, sigma_northing and sigma_height to each point.

    Returns the number of points outside the trajectory, which are unchanged. Raises ValueError
    for bad input, a target that is the input, coordinates that overflow, and LAZ files with
    waveforms (formats 9 and 10) of several scanner channels, which lazrs would damage; OSError
    when the target cannot be written.
    """
    layout, target = read_layout(cloud_file.path), Path(target)
    part = target.with_name(target.name + ".part")
    _check_target(layout.path, target, part)
    shift = getattr(correction, "shift_integers", None) or partial(_shift_integers, correction)
    try:
        with _Output(part) as output, open(layout.path, "rb") as file:
            written = layout if sigma is None else add_sigma_fields(layout)
            head, encoder = _start(written, output, target.suffix.lower() == ".laz")
            outside, low, high = 0, np.full(3, np.inf), np.full(3, -np.inf)
            for records in _chunks(layout, CHUNK_SIZE):
                _check_channels(layout, target, records)
                xyz = [records[name] for name in "XYZ"]
                outside += shift(
                    xyz, layout.scale, layout.offset, records["gps_time"], cloud_file.time_constant
                )
                low = np.minimum(low, [v.min() for v in xyz])
                high = np.maximum(high, [v.max() for v in xyz])
                raw = records.view(np.uint8)
                if sigma is not None:
                    scaled = layout.scale, layout.offset, records["gps_time"]
                    sigmas = sigma.of_integers(xyz, *scaled, cloud_file.time_constant)
                    raw = with_sigmas(records, sigmas)
                output.encode(encoder.compress_many, raw)
                if watch is not None:
                    watch(records["gps_time"] + cloud_file.time_constant)
            output.encode(encoder.done)
            _finish(written, head, np.stack([high, low]), file, output)
        _check_copy(layout, part)
        os.replace(part, target)
    except BaseException:
        part.unlink(missing_ok=True)
        raise
    return outside


def _shift_integers(correction, xyz, scale, offset, gps_time, time_constant):
    """Correction.shift_integers for what has only ``apply``; no point lies outside of that."""
    old = np.column_stack(xyz)
    places = old * scale + offset
    cloud = PointCloud(places, gps_time + time_constant, np.zeros(len(gps_time)))
    new = old + np.rint((correction.apply(cloud).xyz - places) / scale)
    overflow = int((np.abs(new) > INTEGER_LIMIT).any(axis=1).sum())
    if overflow:
        raise ValueError(
            f"{overflow} corrected points do not fit the file's scale {scale} m and offset "
            f"{offset} m: the correction or the file's header is wrong by kilometres."
        )
    for values, corrected in zip(xyz, new.T, strict=True):
        values[:] = corrected
    return 0


def sha256(path):
    """SHA-256 of a file, in hexadecimal digits."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _undecodable(layout, first, end, error):
    return (
        f"Points {first} to {end - 1} of {layout.points} in {layout.path} cannot be decoded "
        f"({error}). The file is cut off or damaged; copy it anew."
    )


def _sample(layout, places):
    """gps_time of the points at some places (n,)."""
    times = np.empty(len(places))
    buffer = bytearray(layout.record_length)
    with open(layout.path, "rb") as file:
        decoder = layout.decoder(file, threads=False)
        for k, place in enumerate(places):
            try:
                decoder.seek(int(place))
                decoder.decompress_many(buffer)
            except lazrs.LazrsError as error:
                raise ValueError(_undecodable(layout, place, place + 1, error)) from error
            times[k] = np.frombuffer(buffer, layout.record)["gps_time"][0]
    _check_times(layout, times, "sampled points")
    return times


def _check_times(layout, times, what):
    bad = len(times) - np.count_nonzero(np.isfinite(times))
    if bad:
        raise ValueError(
            f"{bad} of {len(times)} {what} of {layout.path} have a gps_time that is not a number, "
            "so they cannot be placed on the trajectory. Remove them or export the file anew."
        )


def _check_channels(layout, target, records):
    """That lazrs keeps the waveforms: it mixes them up where scanner channels alternate."""
    is_laz = layout.is_compressed or target.suffix.lower() == ".laz"
    if not is_laz or layout.point_format not in (9, 10):
        return
    channel = records.view(np.uint8).reshape(len(records), -1)[:, 15] >> 4 & 3
    if np.ptp(channel):
        raise ValueError(
            f"{layout.path} has waveforms (point format {layout.point_format}) of "
            f"{len(np.unique(channel))} scanner channels, which lazrs does not compress without "
            "loss. Use LAS for input and output, or one file for each channel."
        )


def _chunks(layout, chunk_size):
    """Records (structured arrays) chunk by chunk, each in the memory of the one before."""
    length = layout.record_length
    buffer = np.empty(min(chunk_size, layout.points) * length, np.uint8)
    with open(layout.path, "rb") as file:
        decoder = layout.decoder(file)
        for first in range(0, layout.points, chunk_size):
            end = min(first + chunk_size, layout.points)
            raw = buffer[: (end - first) * length]
            try:
                decoder.decompress_many(raw)
            except lazrs.LazrsError as error:
                raise ValueError(_undecodable(layout, first, end, error)) from error
            records = raw.view(layout.record)
            _check_times(layout, records["gps_time"], f"points from number {first} on")
            yield records


class _Output(io.BufferedWriter):
    """A new file that keeps what interrupts its writing; lazrs hides it behind its own error."""

    def __init__(self, path):
        super().__init__(io.FileIO(path, "wb"), BLOCK)
        self.interruption = None

    def write(self, data):
        try:
            return super().write(data)
        except BaseException as error:
            self.interruption = error
            raise

    def encode(self, function, *arguments):
        """Let lazrs write here; raises what the system raised."""
        try:
            function(*arguments)
        except lazrs.LazrsError as error:
            raise self.interruption or OSError(f"{self.name}: {error}") from error


class _PlainEncoder:
    """Writes points uncompressed, with the interface of lazrs."""

    def __init__(self, output):
        self.compress_many = output.write

    def done(self):
        pass


def _check_target(source, target, part):
    if target.suffix.lower() not in (".las", ".laz"):
        raise ValueError(f"The corrected file {target} must end in .las or .laz.")
    for path in (target, part):
        if path.exists() and path.samefile(source):
            raise ValueError(
                f"The corrected file {path} is the input itself, which would be lost. Choose "
                "another output folder."
            )


def _start(layout, output, compress):
    """Write header and VLRs; returns them, to be completed, and what encodes the points."""
    extra_bytes = layout.record_length - RECORD_LENGTHS[layout.point_format]
    laszip = lazrs.LazVlr.new_for_compression(layout.point_format, extra_bytes)
    head = _head(layout, bytes(laszip.record_data()) if compress else None)
    output.write(head)
    encoder = lazrs.ParLasZipCompressor(output, laszip) if compress else _PlainEncoder(output)
    return head, encoder


def _head(layout, laszip):
    """Header and VLRs of the input, with the LASzip VLR that the output needs, or none."""
    header_size = layout.field("H", 94)[0]
    kept = [layout.head[a:b] for a, b in layout.vlrs if layout.user_id(a) != LASZIP]
    if laszip is not None:
        form = "<2x16sHH32s"
        kept.append(struct.pack(form, LASZIP, 22204, len(laszip), b"http://laszip.org") + laszip)
    between = layout.head[layout.vlrs[-1][1] if layout.vlrs else header_size :]
    head = bytearray(layout.head[:header_size] + b"".join(kept) + between)
    point_format = layout.point_format | (COMPRESSED if laszip is not None else 0)
    struct.pack_into("<IIB", head, 96, len(head), len(kept), point_format)
    return head


def _finish(layout, head, bounds, file, output):
    """Copy what follows the points; write the header again with bounds (2, 3) and positions."""
    output.seek(0, io.SEEK_END)
    moved = output.tell() - layout.tail
    file.seek(layout.tail)
    shutil.copyfileobj(file, output, BLOCK)
    positions = {(1, 3): (227,), (1, 4): (227, 235)}.get(layout.version, ())  # waveforms, EVLRs
    for position in positions:
        value = layout.field("Q", position)[0]
        if value >= layout.tail:
            struct.pack_into("<Q", head, position, value + moved)
    corners = bounds * layout.scale + layout.offset
    struct.pack_into("<6d", head, 179, *corners.T.ravel())  # max x, min x, max y, ...
    output.seek(0)
    output.write(head)
    output.flush()
    os.fsync(output.fileno())


def _check_copy(layout, part):
    """That the file just written can be opened and holds the points, up to the last."""
    copy = read_layout(part)
    _sample(copy, [copy.points - 1])
    if copy.points != layout.points:
        raise OSError(f"{part} was written with {copy.points} of {layout.points} points.")
