"""Conversion of other formats to a temporary LAZ, which is then processed like any LAS.

The LAZ is in a folder for temporary files (TMPDIR), and is removed when the program ends. Corrected
clouds are written as LAZ.
"""

import shutil
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from itertools import chain
from pathlib import Path

import numpy as np
from pyproj import CRS
from pyproj.exceptions import CRSError

from mlscorr.io.clouds._cloud_sources import CloudSource
from mlscorr.io.clouds._e57 import open_e57
from mlscorr.io.clouds.las_writer import INTEGER_LIMIT, cloud_writer
from mlscorr.io.clouds.ply import open_ply
from mlscorr.io.settings import SETTINGS
from mlscorr.io.store import (
    file_state,
    is_remote,
    looked_points,
    open_file,
    progress_of,
    temporary_folder,
)
from mlscorr.io.trajectories import ADJUSTMENT, NO_TIMES, lacks_time
from mlscorr.survey import WEEK, CloudFile, PointCloud

OPENERS: dict[str, Callable[[Path], CloudSource]] = {".e57": open_e57, ".ply": open_ply}
RESOLUTION = 1e-4  # m, of coordinates: 1/10 of scanners' resolution, and 214 km in 32 bits
LARGEST = np.iinfo(np.uint16).max  # of an intensity or a color


@dataclass(frozen=True)
class Converted:
    """LAZ that was made from another file.

    Parameters
    ----------
    path : Path
    source : CloudSource
    points : int
        Number of points in the LAZ.
    is_part : bool
        True if they are only the first points.
    note : str
        A sentence.
    """

    path: Path
    source: CloudSource
    points: int
    is_part: bool
    note: str


def is_foreign(path: Path) -> bool:
    """True if a cloud's suffix is that of another format than LAS.

    Parameters
    ----------
    path : Path
    """
    return path.suffix.lower() in OPENERS


def written_name(path: Path) -> str:
    """Name of the file for a corrected cloud: its own, or the LAZ of its stem.

    Parameters
    ----------
    path : Path

    Examples
    --------
    >>> written_name(Path("a/scan.las")), written_name(Path("a/scan.e57"))
    ('scan.las', 'scan.laz')
    """
    if is_foreign(path):
        return path.with_suffix(".laz").name
    return path.name


def converted(path: Path) -> Converted:
    """Return the LAZ of an E57 or PLY, made on first use.

    Parameters
    ----------
    path : Path

    Raises
    ------
    ValueError
        If a file cannot be read, or has no times.
    OSError
        If the disk refuses.
    """
    return _converted(path.absolute(), *file_state(path), looked_points())


def read_in_part(path: Path) -> bool:
    """True if only the first points of a cloud are read, as in a quick look.

    Parameters
    ----------
    path : Path
    """
    return is_foreign(path) and converted(path).is_part


def recorded_points(file: CloudFile) -> int:
    """Number of points of a cloud, even if only the first ones are read.

    Parameters
    ----------
    file : CloudFile
    """
    if read_in_part(file.path):
        return converted(file.path).source.points
    return file.points


@cache
def _converted(path, size, changed, limit):
    source = OPENERS[path.suffix.lower()](_on_disk(path))
    if limit is not None and source.points <= limit:
        return _converted(path, size, changed, None)
    target = Path(tempfile.mkdtemp(dir=temporary_folder())) / written_name(path)
    return _convert(source, target, limit)


def _on_disk(path):
    """Return a file, or a local copy of one in a store, for readers that need a disk."""
    if not is_remote(path):
        return path
    copy = Path(tempfile.mkdtemp(dir=temporary_folder())) / path.name
    with open_file(path) as source, open(copy, "wb") as target:
        shutil.copyfileobj(source, target, SETTINGS.copied_bytes)
    return copy


def _convert(source, target, limit):
    """Write a source's points, or the first of them, as LAZ."""
    size = SETTINGS.chunk_points
    end = limit or source.points
    base, gain, scaled = _scale(source, size, end)
    blocks = _first(source.blocks(size), end)
    first = next((block for block in blocks if len(block.xyz)), None)
    if first is None:
        raise ValueError(f"{source.path} has no valid points.")
    is_standard, taken = _time_system(source.path, first.gps_time)
    crs, crs_note = _known_crs(source.crs)
    done = progress_of(f"Reading {source.path.name}", end)
    count = 0
    has_colours = first.colours is not None
    with cloud_writer(target, first.xyz[0], crs, RESOLUTION, None, is_standard, has_colours) as laz:
        for block in chain([first], blocks):
            number = len(block.xyz)
            _check_extent(source.path, block.xyz - first.xyz[0])
            intensity = np.zeros(number)
            if block.intensity is not None:
                intensity = np.nan_to_num(block.intensity)
            intensity = _in_16_bits((intensity - base) * gain)
            is_timed = ~np.isin(block.gps_time, NO_TIMES)
            cloud = PointCloud(block.xyz, block.gps_time - taken * is_timed, intensity)
            colours = None
            if has_colours:
                colours = np.zeros((number, 3))
                if block.colours is not None:
                    colours = _in_16_bits(block.colours * (LARGEST / source.colour_limit))
            laz.write(cloud, colours=colours)
            count += number
            done(number + block.invalid)
    note = _note(source, count, limit, scaled + crs_note)
    return Converted(target, source, count, limit is not None, note)


def _check_extent(path, offset):
    """Refuse points (n, 3; m) too far from the first one for the integers of a LAS."""
    limit = RESOLUTION * (INTEGER_LIMIT - 1 / RESOLUTION)  # the header's offset is in whole meters
    if count := int((np.abs(offset) > limit).any(axis=1).sum()):
        raise ValueError(
            f"{path} has {count} points more than {limit / 1e3:.0f} km from its first one, up to "
            f"{np.abs(offset).max() / 1e3:.0f} km; one may be a pulse without echo, as at 0, 0, 0. "
            "Export it in meters without such points."
        )


def _in_16_bits(values):
    return np.rint(values).clip(0, LARGEST).astype(np.uint16)


def _first(blocks, end):
    """Yield blocks up to a number of points."""
    count = 0
    for block in blocks:
        yield block
        count += len(block.xyz) + block.invalid
        if count >= end:
            return


def _scale(source, size, end):
    """Mapping of intensities to 16 bits: base, gain, and a phrase on it."""
    low = np.inf
    high = -np.inf
    count = 0
    for values in source.intensities(size):
        low = np.fmin(low, np.fmin.reduce(values))
        high = np.fmax(high, np.fmax.reduce(values))
        if (count := count + len(values)) >= end:
            break
    if not np.isfinite([low, high]).all():
        return 0.0, 1.0, "; it has no intensity, which the target search needs"
    if low >= 0 and 1 < high <= LARGEST:
        return 0.0, 1.0, ""
    base = min(low, 0.0)
    top = high
    if low >= 0 and high <= 1:
        top = 1.0
    gain = LARGEST / max(top - base, np.finfo(float).tiny)
    return base, gain, f"; intensities of {low:g} to {high:g} as {gain:.5g} (value - {base:g})"


def _time_system(path, times):
    """Return whether times are written as adjusted standard GPS time, and the subtracted offset
    (s).
    """
    times = times[np.isfinite(times)]
    if not len(times):
        raise ValueError(f"{path} has points whose times are not numbers.")
    if np.abs(times).max() > SETTINGS.microseconds:
        raise ValueError(
            f"{path} has times of {np.abs(times).max():.6g}, which seem to be milli-, micro- or "
            "nanoseconds. Export them in seconds."
        )
    if not lacks_time(times).all():
        times = times[~lacks_time(times)]
    is_week = times.min() >= 0 and times.max() <= 2 * WEEK
    taken = ADJUSTMENT * (times.min() >= ADJUSTMENT)
    return not is_week, taken


def _known_crs(wkt):
    """Return a CRS that can be written, or a phrase if it cannot."""
    if wkt is None:
        return None, ""
    try:
        CRS.from_user_input(wkt).to_wkt("WKT1_GDAL")
    except CRSError:
        return None, "; its coordinateMetadata is not a known CRS"
    return wkt, ""


def _note(source, count, limit, phrases):
    """Sentence on a conversion."""
    if limit:
        taken = f"the first {count} points of {source.points}"
    else:
        taken = f"{count} points"
    if not limit and count < source.points:
        phrases += f"; {source.points - count} invalid points were omitted"
    if source.dropped:
        phrases += f"; without its {', '.join(source.dropped)}"
    return (
        f"{source.path.name} was read through LAZ at {RESOLUTION * 1e3:g} mm, {taken} "
        f"{source.parts}{phrases}. The corrected cloud is written as {written_name(source.path)}."
    )
