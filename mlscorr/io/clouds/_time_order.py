"""Points of a COPC file in the order of measurement.

Searches for targets and ties need points in the order of measurement. An octree scatters each
second over all of its nodes, so the points are first sorted into an uncompressed LAS among the
temporary files (TMPDIR). It is kept until another file is sorted and this one is no longer read.
Memory contains a chunk, or the points of one second if these are more.
"""

import tempfile
import weakref
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from mlscorr.io.clouds.las_layout import LasLayout, read_records
from mlscorr.io.settings import SETTINGS
from mlscorr.io.store import (
    Spool,
    check_space,
    file_state,
    looked_points,
    progress_of,
    temporary_folder,
)
from mlscorr.survey import counted_on


def in_time_order(layout: LasLayout, new_week: float = -np.inf) -> LasLayout:
    """Return the layout itself, or that of a copy sorted by time if the file is a COPC.

    For equal times, such as the echoes of a pulse, the first return comes first. Times that are not
    numbers come last. In a quick look, a long file is not sorted.

    Parameters
    ----------
    layout : LasLayout
    new_week : float
        See ``CloudFile``. Units: s.

    Raises
    ------
    ValueError
        If points cannot be decoded.
    OSError
        If the disk has no space for the points.
    """
    limit = looked_points()
    if not layout.is_copc or (limit is not None and layout.points > limit):  # too many seconds
        return layout
    return _in_order(layout, new_week, file_state(layout.path))


@lru_cache(maxsize=1)
def _in_order(layout, new_week, _state):
    """LasLayout of a file's points sorted by time."""
    path = layout.path
    what = f"to sort the points of {path} by time. Set TMPDIR to a folder on another disk."
    folder = Path(tempfile.mkdtemp(dir=temporary_folder()))
    check_space(folder, layout.points * layout.record_length, what)
    head = bytearray(layout.head)
    head[104] = layout.point_format  # no longer compressed
    target = folder / path.with_suffix(".las").name
    done = progress_of(f"Sorting {path.name} by time", 2 * layout.points)
    seconds, counts = _count_seconds(layout, new_week, done)
    group = (np.cumsum(counts) - counts) // SETTINGS.chunk_points
    group = np.unique(group, return_inverse=True)[1]
    with open(target, "w+b") as file:
        file.write(head)
        spool = Spool(file, np.bincount(group, weights=counts), layout.record_length)
        for records in read_records(layout, SETTINGS.chunk_points):
            rows = np.searchsorted(seconds, _second(records, new_week))
            spool.put(records.view(f"V{layout.record_length}"), group[rows])
            done(len(records))
        for number in range(len(spool.counts)):
            records = spool.get(number).view(layout.record)
            returns = records.view(np.uint8).reshape(len(records), -1)[:, 14] & 15  # R15, table 13
            order = np.lexsort((returns, counted_on(records["gps_time"], new_week)))
            spool.replace(number, records.view(f"V{layout.record_length}")[order])
    size = len(head) + layout.points * layout.record_length
    ordered = replace(layout, path=target, head=bytes(head), size=size, source=layout.cloud)
    weakref.finalize(ordered, target.unlink, missing_ok=True)
    return ordered


def _count_seconds(layout, new_week, done):
    """Count the points in each whole second, sorted by time.

    Units: s.
    """
    seconds = np.empty(0)
    counts = np.empty(0, np.int64)
    for records in read_records(layout, SETTINGS.chunk_points, is_brief=True):
        some, number = np.unique(_second(records, new_week), return_counts=True)
        seconds, which = np.unique(np.concatenate([seconds, some]), return_inverse=True)
        counts = np.bincount(which, weights=np.concatenate([counts, number])).astype(np.int64)
        done(len(records))
    return seconds, counts


def _second(records, new_week):
    """Second of each time; infinite for what is not a number."""
    time = counted_on(records["gps_time"], new_week)
    return np.floor(np.nan_to_num(time, nan=np.inf, posinf=np.inf, neginf=-np.inf))
