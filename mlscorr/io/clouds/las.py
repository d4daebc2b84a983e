"""Points of LAS and LAZ files in chunks, all or within intervals of time, without noise points.

lazrs uses all cores for decoding and encoding, so further threads gain nothing (they compete for
the same cores, and its single-threaded coders keep Python's lock).
"""

import hashlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import ArrayLike

from mlscorr.io.clouds._time_order import in_time_order
from mlscorr.io.clouds.las_checks import read_layout
from mlscorr.io.clouds.las_layout import LasLayout, decoding_points, read_records
from mlscorr.io.settings import SETTINGS
from mlscorr.io.store import as_path, file_state, open_file
from mlscorr.io.trajectories import lacks_time
from mlscorr.survey import CloudFile, CloudInMemory, PointCloud


def read_chunks(
    cloud_file: CloudFile,
    chunk_size: int = SETTINGS.chunk_points,
    first: int = 0,
    end: int | None = None,
) -> Iterator[PointCloud]:
    """Read the points of a cloud file in chunks, in file order, for measurements.

    Points of a COPC are sorted by time. Points flagged as noise (withheld, or in one of the file's
    noise_classes) are omitted, and so are points whose gps_time is not a number, which have no
    position on the trajectory.

    Parameters
    ----------
    cloud_file : CloudFile
    chunk_size : int
        Points in a chunk.
    first, end : int
        Index of the first point, and of the point after the last.

    Yields
    ------
    PointCloud
        With times in the trajectory's system.

    Raises
    ------
    ValueError
        If the file is truncated or damaged.
    """
    if isinstance(cloud_file, CloudInMemory):
        yield from cloud_file.chunks(chunk_size, first, end)
        return
    layout = in_time_order(read_layout(cloud_file.path), cloud_file.new_week)
    flagged = read = 0
    for whole in read_records(layout, chunk_size, first, end):
        records = whole[cloud_file.rows(whole["point_source_id"])]
        read += len(records)
        is_noise = layout.is_noise(records, cloud_file.noise_classes)
        if is_noise.any():
            flagged += int(np.count_nonzero(is_noise))
            records = records[~is_noise]
        cloud = timed_points(cloud_file, layout, records)
        if len(cloud):
            yield cloud
    count = _count.get()
    if count is not None:
        part = None
        if first > 0 or end not in (None, layout.points):
            part = (first, end or layout.points)
        count.add(cloud_file, part, flagged, read)


def timed_points(file: CloudFile, layout: LasLayout, records: np.ndarray) -> PointCloud:
    """Points of records with a valid gps_time, with times in the trajectory's system.

    Parameters
    ----------
    file : CloudFile
    layout : LasLayout
    records : (n,) structured array
    """
    xyz = np.empty((len(records), 3))
    for axis, name in enumerate("XYZ"):
        np.multiply(records[name], layout.scale[axis], out=xyz[:, axis])
    xyz += layout.offset
    times = file.trajectory_time(records["gps_time"])
    cloud = PointCloud(xyz, times, records["intensity"].copy())
    is_timed = np.isfinite(times)
    if is_timed.all():
        return cloud
    return cloud[is_timed]


def read_cloud(
    file: CloudFile | str | Path,
    attributes: Sequence[str] = (),
    chunk_points: int = SETTINGS.chunk_points,
) -> Iterator[PointCloud]:
    """Read all points of a cloud in chunks, in the order of the file.

    Parameters
    ----------
    file : CloudFile or path
        One of ``survey.clouds``, with times in the trajectory's system, or the path of a LAS or LAZ
        file, with times as in the file.
    attributes : sequence of str
        Names of further dimensions in laspy, such as ``classification``.
    chunk_points : int
        Points in a chunk.

    Yields
    ------
    PointCloud

    Raises
    ------
    ValueError
        If the file is truncated, damaged or without times or a dimension.
    OSError
        If reading fails.

    >>> import mlscorr, numpy as np, tempfile
    >>> from mlscorr.simulate import Scenario, simulate
    >>> folder = tempfile.mkdtemp()
    >>> short = Scenario(
    ...     drive={"duration": 8.0},
    ...     targets={"control": 4, "check": 1},
    ...     scanner=[{"lines_per_second": 75, "points_per_line": 400}],
    ... )
    >>> simulate(short, np.random.default_rng(1)).write(folder)
    >>> survey = mlscorr.read_survey(folder)
    >>> clouds = mlscorr.read_cloud(survey.clouds[0], attributes=["return_number"])
    >>> sum(len(cloud) for cloud in clouds) == survey.points
    True
    """
    if isinstance(file, CloudInMemory):
        yield from file.chunks(chunk_points)
        return
    if not isinstance(file, CloudFile):
        layout = read_layout(as_path(file))
        file = CloudFile(layout.path, layout.points, layout.time_offset, "of the file")
    else:
        layout = read_layout(file.path)
    for records in read_records(layout, chunk_points):
        rows = file.rows(records["point_source_id"])
        own = records[rows]
        xyz = np.empty((len(own), 3))
        for axis, name in enumerate("XYZ"):
            np.multiply(own[name], layout.scale[axis], out=xyz[:, axis])
        xyz += layout.offset
        yield PointCloud(
            xyz,
            file.trajectory_time(own["gps_time"]) + 0.0,  # own memory, because records are reused
            own["intensity"].copy(),
            {name: layout.dimension(records, name)[rows] for name in attributes},
        )


def read_intervals(
    file: CloudFile, spans: np.ndarray, limit: int = SETTINGS.chunk_points
) -> Iterator[PointCloud]:
    """Read points of a file measured within some intervals of time; all of a short file.

    In an interval with many points, those around its middle are read.

    Parameters
    ----------
    file : CloudFile
        With points in order of time.
    spans : (k, 2) array
        Starts and ends in the trajectory's time. Units: s.
    limit : int
        Number of points up to which a file is short, or an interval is read completely.

    Yields
    ------
    PointCloud

    Raises
    ------
    ValueError
        If points of a long file are not in order of time, or cannot be decoded.
    """
    if isinstance(file, CloudInMemory):
        for chunk in file.chunks(limit):
            near = (chunk.gps_time[:, None] >= spans[:, 0]) & (
                chunk.gps_time[:, None] <= spans[:, 1]
            )
            yield chunk[near.any(axis=1)]
        return
    layout = in_time_order(read_layout(file.path), file.new_week)
    if layout.points <= limit:
        yield from read_chunks(file)
        return
    places, records = spread_records(layout)
    times = file.counted(records["gps_time"])
    if not (np.diff(times) >= 0).all():  # perhaps because of points without a time
        is_timed = ~lacks_time(records["gps_time"])
        places = places[is_timed]
        times = times[is_timed]
    if len(times) < 2 or not (np.diff(times) >= 0).all():
        raise ValueError(
            f"The points of {file.path.name} are not in time order, so the position of a time in "
            "the file is known only after all are read."
        )
    done = 0
    for span in np.asarray(spans) - file.time_constant:
        if span[1] < times[0] or span[0] > times[-1]:
            continue
        first = max(done, _place(layout, file, places, times, span[0], 0))
        end = _place(layout, file, places, times, span[1], 1)
        surplus = max(0, end - first - limit)
        first = first + surplus // 2
        done = end - surplus // 2
        if first < done:
            yield from read_chunks(file, first=first, end=done)


def _place(layout: LasLayout, file: CloudFile, places, times, time, side):
    """Index of the first point not before (side 0) or after (1) a time, by bisection."""
    k = int(np.clip(np.searchsorted(times, time), 1, len(times) - 1))
    bounds = [int(places[k - 1]), int(places[k]) + 1]
    while bounds[1] - bounds[0] > SETTINGS.close_places:
        middle = sum(bounds) // 2
        time_there = file.counted(records_at(layout, [middle])["gps_time"])[0]
        bounds[int(time_there >= time)] = middle
    return bounds[side]


def sample_gps_times(path: str | Path) -> tuple[int, bool, np.ndarray]:
    """Return number of points, time flag and a few times of a LAS or LAZ file, which is checked.

    Parameters
    ----------
    path : path

    Returns
    -------
    points : int
    is_standard : bool
        True if the header states adjusted standard GPS time, not seconds of week.
    times : (65 or fewer,) array
        Valid gps_time of points spread over the file, in file order. Units: s.

    Raises
    ------
    ValueError
        If the file is missing, not LAS, truncated, or without gps_time.
    """
    layout = read_layout(path)
    return layout.points, layout.is_standard, timed_records(layout)["gps_time"]


def timed_records(layout: LasLayout) -> np.ndarray:
    """Records with a valid time of points spread over a file; (0,) if there is none.

    Parameters
    ----------
    layout : LasLayout
    """
    records = spread_records(layout)[1]
    return records[~lacks_time(records["gps_time"])]


def spread_records(layout: LasLayout) -> tuple[np.ndarray, np.ndarray]:
    """Indices of points spread over a file, including the first and last, and their records.

    Both are in the order of the file; for records see records_at.

    Parameters
    ----------
    layout : LasLayout

    Returns
    -------
    places : (65 or fewer,) int array
    records : structured array of the same length
    """
    state = file_state(layout.path)
    if layout not in _SPREAD or _SPREAD[layout][0] != state:
        _SPREAD[layout] = (state, *_spread_records(layout))
    _, places, records = _SPREAD[layout]
    return places.copy(), records.copy()


# Several stages look at the same points. The layout of a sorted copy must not outlive its use: the
# copy is deleted with it
_SPREAD: WeakKeyDictionary = WeakKeyDictionary()


def _spread_records(layout):
    places = np.unique(np.linspace(0, layout.points - 1, SETTINGS.sampled_points).astype(np.int64))
    chunks = places[:-1] // layout.chunk_size
    is_first = np.append(True, np.diff(chunks) > 0)[: len(chunks)]
    places[:-1][is_first] = chunks[is_first] * layout.chunk_size  # nothing to decode before it
    return places, records_at(layout, places)


def records_at(layout: LasLayout, places: ArrayLike) -> np.ndarray:
    """Read records of a few points; only gps_time and point_source_id are certain to be decoded.

    Parameters
    ----------
    layout : LasLayout
    places : (n,) array of int
        Indices of the points.

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
            with decoding_points(layout, place, place + 1):
                if not is_ahead:
                    decoder.seek(place)  # decodes the chunk from its start
                    reached = place
                raw = bytearray((place - reached + 1) * length)
                decoder.decompress_many(raw)
            records[k] = np.frombuffer(raw[-length:], layout.record)[0]
            reached = place + 1
    return records


def count_sources(layout: LasLayout) -> np.ndarray:
    """Count the points (65536,) with each point_source_id.

    If LAZ stores the IDs separately (point formats 6 to 10), this takes half the time of reading.

    Parameters
    ----------
    layout : LasLayout
    """
    counts = np.zeros(1 << 16, int)
    for records in read_records(layout, SETTINGS.chunk_points, is_brief=True):
        counts += np.bincount(records["point_source_id"], minlength=len(counts))
    return counts


def sha256(path: str | Path) -> str:
    """Compute the SHA-256 of a file.

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


@dataclass
class NoiseCount:
    """Count of points omitted as noise.

    Parameters
    ----------
    parts : dict
        Numbers of flagged and read points, by file and part of it (None for all).
    """

    parts: dict[CloudFile, dict[tuple[int, int] | None, tuple[int, int]]] = field(
        default_factory=dict
    )

    def add(self, file: CloudFile, part: tuple[int, int] | None, flagged: int, read: int) -> None:
        """Count a part once, however often it is read again.

        Parameters
        ----------
        file : CloudFile
        part : (int, int) or None
            Index of the first point, and of the one after the last; None for the whole file.
        flagged, read : int
            Number of points.
        """
        self.parts.setdefault(file, {})[part] = flagged, read

    @property
    def totals(self) -> tuple[int, int]:
        """Number of points flagged as noise, and of all points read."""
        flagged = read = 0
        for own in self.parts.values():
            for counts in [own[None]] if None in own else own.values():
                flagged += counts[0]
                read += counts[1]
        return flagged, read

    @property
    def sentence(self) -> str:
        """Sentence on these points; empty without any."""
        flagged, read = self.totals
        if not flagged:
            return ""
        classes = sorted({number for file in self.parts for number in file.noise_classes})
        return _noise_sentence(flagged, read, classes)


_count: ContextVar[NoiseCount | None] = ContextVar("count", default=None)


def _noise_sentence(flagged: int, points: int, classes: list[int]) -> str:
    """Sentence on points that are flagged as noise."""
    kinds = "withheld"
    if classes:
        kinds += f" or of class {' or '.join(map(str, classes))}"
    return (
        f"{flagged} of {points} points read are flagged as noise ({kinds}). They are not used "
        "for measurements but corrected like all others; cloud.noise_classes in survey.toml "
        "selects other classes."
    )


@contextmanager
def counted_noise() -> Iterator[NoiseCount]:
    """Count the points omitted as noise until the block ends.

    Yields
    ------
    NoiseCount
    """
    count = NoiseCount()
    token = _count.set(count)
    try:
        yield count
    finally:
        _count.reset(token)
