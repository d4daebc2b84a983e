"""Points of a cloud file that were measured within a few spans of time, without the others."""

from collections.abc import Iterator

import numpy as np

from mlscorr.io.clouds._time_order import in_time_order
from mlscorr.io.clouds.las import read_chunks, records_at, spread_records
from mlscorr.io.clouds.las_checks import read_layout
from mlscorr.io.clouds.las_layout import LasLayout
from mlscorr.io.settings import SETTINGS
from mlscorr.io.trajectories import lacks_time
from mlscorr.survey import CloudFile, PointCloud


def read_windows(
    file: CloudFile, spans: np.ndarray, limit: int = SETTINGS.chunk_points
) -> Iterator[PointCloud]:
    """Points of a file that were measured about some spans of time; all of a short file.

    Of a span with many points those about its middle are read.

    Parameters
    ----------
    file : CloudFile
        Its points in order of time.
    spans : (k, 2) array
        Starts and ends in the trajectory's time. Units: s.
    limit : int
        Number of points up to which a file is short, and a span has not many.

    Yields
    ------
    PointCloud

    Raises
    ------
    ValueError
        Where points of a long file are not in order of time, or can't be decoded.
    """
    layout = in_time_order(read_layout(file.path), file.new_week)
    if layout.points <= limit:
        yield from read_chunks(file)
        return
    places, records = spread_records(layout)
    times = file.counted(records["gps_time"])
    if not (np.diff(times) >= 0).all():  # because of points without a time, perhaps
        is_timed = ~lacks_time(records["gps_time"])
        places = places[is_timed]
        times = times[is_timed]
    if len(times) < 2 or not (np.diff(times) >= 0).all():
        raise ValueError(
            f"The points of {file.path.name} are not in order of time: where a time stands in it "
            "is known only once all are read."
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
    """Number of a point before (side 0) or behind (1) those of a time, by bisection."""
    k = int(np.clip(np.searchsorted(times, time), 1, len(times) - 1))
    bounds = [int(places[k - 1]), int(places[k]) + 1]
    while bounds[1] - bounds[0] > SETTINGS.close_places:
        middle = sum(bounds) // 2
        time_there = file.counted(records_at(layout, [middle])["gps_time"])[0]
        bounds[int(time_there >= time)] = middle
    return bounds[side]
