"""Detection of clouds with the same points, in any format, order or time system.

Headers separate most clouds by number of points and bounds. If these agree, times of points are
read: a few at the same positions of both files, and all of them if these differ, as for a COPC and
a LAZ.
"""

import struct
from collections import defaultdict
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mlscorr.io.clouds.conversion import OPENERS, is_foreign, read_in_part
from mlscorr.io.clouds.las import records_at
from mlscorr.io.clouds.las_checks import HEADER_SIZES, read_layout
from mlscorr.io.clouds.las_crs import cloud_box
from mlscorr.io.clouds.las_layout import LasLayout, read_records
from mlscorr.io.settings import SETTINGS
from mlscorr.io.store import is_remote, open_file
from mlscorr.io.trajectories import ADJUSTMENT, WEEK


def find_copies(paths: Iterable[Path]) -> dict[Path, Path]:
    """Find clouds with the same points as an earlier one, each with that one.

    Files without readable points are not copies; they are refused when they are read.

    Parameters
    ----------
    paths : iterable of Path

    Returns
    -------
    dict
        From a copy to the first file with its points.
    """
    of_count = defaultdict(list)
    for path in dict.fromkeys(paths):
        with suppress(OSError, ValueError):
            of_count[_announced_points(path)].append(path)
    copies = {}
    for count, group in of_count.items():
        if count and len(group) > 1:
            copies |= _copies(group)
    return copies


def _announced_points(path: Path) -> int:
    """Number of points from the header; zero if it is unknown."""
    if is_foreign(path):
        if is_remote(path):
            return 0
        return OPENERS[path.suffix.lower()](path).points
    with open_file(path, is_scattered=True) as file:
        head = file.read(HEADER_SIZES[-1])
    if head[:4] != b"LASF" or len(head) < HEADER_SIZES[0]:
        return 0
    minor = head[25]
    if minor < 4:
        return struct.unpack_from("<I", head, 107)[0]
    if len(head) >= HEADER_SIZES[4]:
        return struct.unpack_from("<Q", head, 247)[0]
    return 0


def _copies(paths: list[Path]) -> dict[Path, Path]:
    """Copies among files with the same number of points."""
    points = []
    for path in paths:
        with suppress(OSError, ValueError):
            if not read_in_part(path):
                points.append(_Points(path, read_layout(path)))
    boxes = np.array([cloud_box(each.layout) for each in points])
    steps = np.array([each.layout.scale for each in points])
    is_first = np.zeros(len(points), bool)
    copies: dict[Path, Path] = {}
    for number, each in enumerate(points):
        limit = (steps + steps[number])[:, None, :]  # both bounds are rounded to their steps
        is_same = np.isclose(boxes, boxes[number], rtol=0.0, atol=limit, equal_nan=True)
        candidates = np.flatnonzero(is_first & is_same.all(axis=(1, 2)))
        first = next((points[i] for i in candidates if each.are_those_of(points[i])), None)
        if first is None:
            is_first[number] = True
        else:
            copies[each.path] = first.path
    return copies


@dataclass
class _Points:
    """Points of a cloud by their times, which are read on demand.

    Parameters
    ----------
    path : Path
    layout : LasLayout
    """

    path: Path
    layout: LasLayout
    _moments: np.ndarray | None = None

    def are_those_of(self, other: "_Points") -> bool:
        """Return True if both clouds have the same times in any order; False if undecodable."""
        if self.layout.points != other.layout.points:  # some of an E57 are invalid
            return False
        with suppress(OSError, ValueError):
            return self._have_times_of(other)
        return False

    def _have_times_of(self, other):
        places = np.linspace(0, self.layout.points - 1, SETTINGS.sampled_points).astype(np.int64)
        own, others = (
            records_at(points.layout, places)["gps_time"] + points.layout.time_offset
            for points in (self, other)
        )
        if _differ_by_system(own - others):
            return True
        own = self.moments()
        others = other.moments()
        is_alike = np.abs(own[1:] - others[1:]).max() <= SETTINGS.single_time_step
        return bool(is_alike) and _differ_by_system(own[:1] - others[:1])

    def moments(self) -> np.ndarray:
        """First time, and last, mean and root mean square (4,) since then, for any order."""
        if self._moments is None:
            self._moments = _time_moments(self.layout)
        return self._moments


def _time_moments(layout: LasLayout) -> np.ndarray:
    """First time, and last, mean and root mean square (4,) since then of all points. Units: s."""
    origin = records_at(layout, [0])["gps_time"][0]
    first = np.inf
    last = -np.inf
    count = 0
    total = np.zeros(2)  # times since the origin, and their squares
    for records in read_records(layout, SETTINGS.chunk_points, is_brief=True):
        since = records["gps_time"] - origin
        since = since[np.isfinite(since)]
        if not len(since):
            continue
        first = min(first, since.min())
        last = max(last, since.max())
        total += since.sum(), np.square(since).sum()
        count += len(since)
    if not count:
        raise ValueError(f"{layout.cloud} has points whose times are not numbers.")
    mean, square = total / count
    about_first = square - 2.0 * first * mean + first**2
    start = origin + first + layout.time_offset
    return np.array([start, last - first, mean - first, np.sqrt(max(about_first, 0.0))])


def _differ_by_system(difference: np.ndarray) -> bool:
    """Return True if times are equal, or all differ as two time systems do. Units: s."""
    limit = SETTINGS.single_time_step
    if not np.isfinite(difference).all() or np.ptp(difference) > limit:
        return False
    constants = np.array([0.0, ADJUSTMENT, -ADJUSTMENT])
    remainder = (difference[0] - constants) % WEEK
    return bool((np.minimum(remainder, WEEK - remainder) <= limit).any())
