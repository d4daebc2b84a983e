"""Clouds in formats other than LAS: the data of their headers, and their points in blocks."""

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mlscorr.io.settings import SETTINGS


@dataclass(frozen=True)
class SourceBlock:
    """Some points of a cloud, as stored.

    Parameters
    ----------
    xyz : (n, 3) array
        In the cloud's global coordinates. Units: m.
    gps_time : (n,) array
        Units: s.
    intensity : (n,) array or None
    colours : (n, 3) array or None
    invalid : int
        Number of points omitted because the file marks them as invalid.
    """

    xyz: np.ndarray
    gps_time: np.ndarray
    intensity: np.ndarray | None
    colours: np.ndarray | None
    invalid: int = 0


@dataclass(frozen=True)
class CloudSource:
    """Cloud described by its header.

    Parameters
    ----------
    path : Path
    points : int
    parts : str
        Half a sentence on the origin of the points.
    dropped : tuple of str
        Names of fields that a correction does not use.
    colour_limit : float
        Largest value of a color.
    crs : str or None
        As WKT.
    intensities : function of a number of points
        Yields the intensities in blocks, or nothing if there are none.
    blocks : function of a number of points
        Yields SourceBlocks of at most that many points.
    """

    path: Path
    points: int
    parts: str
    dropped: tuple[str, ...]
    colour_limit: float
    crs: str | None
    intensities: Callable[[int], Iterator[np.ndarray]]
    blocks: Callable[[int], Iterator[SourceBlock]]


def _check_single(path, what, largest, limit, cause):
    """Refuse single-precision numbers whose resolution is coarser than a limit."""
    step = float(np.spacing(np.float32(largest)))
    if step > limit:
        raise ValueError(
            f"{path} stores its {what} in single precision: at {largest:.0f} they are rounded to "
            f"steps of {step:.2g}. {cause}"
        )


def check_precision(
    path: Path, singles: Collection[str], xyz: np.ndarray, time: np.ndarray
) -> None:
    """Refuse coordinates and times degraded by single precision.

    Parameters
    ----------
    path : Path
    singles : collection of str
        ``coordinates`` or ``times``, or both, if in single precision.
    xyz : (n, 3) array
        Stored coordinates. Units: m.
    time : (n,) array
        Units: s.

    Raises
    ------
    ValueError
        With the remaining resolution.
    """
    if "coordinates" in singles and len(xyz):
        cause = "The lost digits can't be recovered: export it in double precision, or as LAS."
        _check_single(path, "coordinates (m)", np.abs(xyz).max(), SETTINGS.single_step, cause)
    if "times" in singles and len(time):
        cause = "The vehicle moves within such a step: export times in double precision, or as LAS."
        _check_single(path, "times (s)", np.abs(time).max(), SETTINGS.single_time_step, cause)


def lacking_time(path: Path, fields: Collection[str], where: str, names: str) -> ValueError:
    """Error for a cloud without times.

    Parameters
    ----------
    path : Path
    fields : collection of str
        Its fields.
    where : str
        Part of the file, or nothing.
    names : str
        Names of time fields.
    """
    return ValueError(
        f"The points of {path} have no times{where}, so they can't be located on the trajectory. "
        f"The file has {', '.join(fields)}: export it with {names}, or as LAS with gps_time."
    )
