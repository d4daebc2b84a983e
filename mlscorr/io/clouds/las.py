"""Points of LAS and LAZ files by chunks.

lazrs shares decoding and encoding among the cores by itself; threads of our own gain nothing
beside it (they waited on the same cores, and its single-threaded coders hold Python's lock).
"""

import hashlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from mlscorr.io.clouds._las_records import decoding_points, read_records
from mlscorr.io.clouds._time_order import in_time_order
from mlscorr.io.clouds.las_checks import read_layout
from mlscorr.io.clouds.las_layout import LasLayout
from mlscorr.io.clouds.noise import count_noise
from mlscorr.io.settings import SETTINGS
from mlscorr.io.store import open_file
from mlscorr.io.trajectories import lacks_time
from mlscorr.survey import CloudFile, PointCloud


def sample_gps_times(path: str | Path) -> tuple[int, bool, np.ndarray]:
    """Number of points, time flag and a few times of a LAS or LAZ file, which is checked.

    Parameters
    ----------
    path : path

    Returns
    -------
    points : int
    is_standard : bool
        Whether the header says adjusted standard GPS time, not seconds of week.
    times : (65 or fewer,) array
        gps_time of points spread over the file, in file order, that have one. Units: s.

    Raises
    ------
    ValueError
        When the file is missing, not LAS, cut off, or without gps_time.
    """
    layout = read_layout(path)
    return layout.points, layout.is_standard, timed_records(layout)["gps_time"]


def timed_records(layout: LasLayout) -> np.ndarray:
    """Records of points spread over a file that have a time; (0,) where none has.

    Parameters
    ----------
    layout : LasLayout
    """
    records = spread_records(layout)[1]
    return records[~lacks_time(records["gps_time"])]


def spread_records(layout: LasLayout) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of points spread over a file, first and last among them, and their records.

    In the order of the file; records as of records_at.

    Parameters
    ----------
    layout : LasLayout

    Returns
    -------
    places : (65 or fewer,) int array
    records : structured array of the same length
    """
    places = np.unique(np.linspace(0, layout.points - 1, SETTINGS.sampled_points).astype(np.int64))
    chunks = places[:-1] // layout.chunk_size
    is_first = np.append(True, np.diff(chunks) > 0)[: len(chunks)]
    places[:-1][is_first] = chunks[is_first] * layout.chunk_size  # nothing to decode before it
    return places, records_at(layout, places)


def read_chunks(
    cloud_file: CloudFile,
    chunk_size: int = SETTINGS.chunk_points,
    first: int = 0,
    end: int | None = None,
) -> Iterator[PointCloud]:
    """Points of a cloud file by chunks, in file order, for all that measures.

    Those of a COPC come in order of time. Points are left out that are flagged as noise: withheld,
    or of one of the file's noise_classes; and those whose gps_time is not a number: nothing places
    them on the trajectory.

    Parameters
    ----------
    cloud_file : CloudFile
    chunk_size : int
        Points at a time.
    first, end : int
        Numbers of the points in the file at which to start, and to end before.

    Yields
    ------
    PointCloud
        With times in the trajectory's system.

    Raises
    ------
    ValueError
        For a file that is cut off or damaged.
    """
    layout = in_time_order(read_layout(cloud_file.path), cloud_file.new_week)
    scale = layout.scale
    offset = layout.offset
    flagged = read = 0
    for whole in read_records(layout, chunk_size, first, end):
        records = whole[cloud_file.rows(whole["point_source_id"])]
        read += len(records)
        is_noise = layout.is_noise(records, cloud_file.noise_classes)
        if is_noise.any():
            flagged += int(np.count_nonzero(is_noise))
            records = records[~is_noise]
        xyz = np.empty((len(records), 3))
        for axis, name in enumerate("XYZ"):
            np.multiply(records[name], scale[axis], out=xyz[:, axis])
        xyz += offset
        times = cloud_file.trajectory_time(records["gps_time"])
        cloud = PointCloud(xyz, times, records["intensity"].copy())
        is_timed = np.isfinite(times)
        if is_timed.any():
            yield cloud if is_timed.all() else cloud[is_timed]
    is_whole = first == 0 and end in (None, layout.points)
    count_noise(cloud_file, None if is_whole else (first, end or layout.points), flagged, read)


def sha256(path: str | Path) -> str:
    """SHA-256 of a file.

    Parameters
    ----------
    path : path

    Returns
    -------
    str
        Hexadecimal digits.
    """
    with open_file(path) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def records_at(layout: LasLayout, places: ArrayLike) -> np.ndarray:
    """Records of a few points, of which only gps_time and point_source_id are sure to be decoded.

    Parameters
    ----------
    layout : LasLayout
    places : (n,) array of int
        Numbers of the points.

    Returns
    -------
    (n,) structured array
    """
    places = np.asarray(places)
    records = np.empty(len(places), layout.record)
    length = layout.record_length
    size = layout.chunk_size
    reached = -1
    with open_file(layout.path, is_scattered=True) as file:
        decoder = layout.decoder(file, threads=False, is_brief=True)
        for k, place in enumerate(places.tolist()):
            is_ahead = place >= reached and place // size == reached // size
            raw = bytearray((place - reached if is_ahead else 0) * length + length)
            with decoding_points(layout, place, place + 1):
                if not is_ahead:
                    decoder.seek(place)  # decodes the chunk from its start
                decoder.decompress_many(raw)
            records[k] = np.frombuffer(raw[-length:], layout.record)[0]
            reached = place + 1
    return records


def count_sources(layout: LasLayout) -> np.ndarray:
    """Number of points (65536,) with each point_source_id.

    Where LAZ keeps the ids apart (point formats 6 to 10) that takes half the time of reading.

    Parameters
    ----------
    layout : LasLayout
    """
    counts = np.zeros(1 << 16, int)
    for records in read_records(layout, SETTINGS.chunk_points, is_brief=True):
        counts += np.bincount(records["point_source_id"], minlength=len(counts))
    return counts
