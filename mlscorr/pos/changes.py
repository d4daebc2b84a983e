"""What sigma(t) states, free of the noise of epochs, and in time with the recorded path.

The error of a position can't change at once where the recorded path doesn't. So the sigmas of its
parts change at once at steps of the path alone, and elsewhere no quicker than GNSS can tell.
"""

from itertools import pairwise

import numpy as np
from scipy.ndimage import median_filter
from scipy.spatial import cKDTree

from mlscorr.pos.settings import SETTINGS
from mlscorr.pos.steps import Steps
from mlscorr.survey import Trajectory


def quick_changes(gps_time: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Rows (k, 2) before and after each change of a size, at once or as filters spread it.

    Before and after it the size stays, or changes by less than half as much in as long a time:
    what grows from nothing, and sinks to it, is no such change, though it doubles in no time.

    Parameters
    ----------
    gps_time : (n,) array
        Units: s.
    size : (n,) array
        Units: m.
    """
    later = _beside(gps_time, np.arange(len(size)), SETTINGS.step_duration)
    least, largest = np.sort([size[later], size], axis=0)
    changed = []
    for first, last in runs(largest > SETTINGS.steady_ratio * least):
        changes = np.abs(np.diff(size[first : later[last - 1] + 1]))
        large = first + np.flatnonzero(changes >= changes.max() / SETTINGS.steady_ratio)
        changed.append((large[0], large[-1] + 1))
    first, last = np.array(changed, int).reshape(-1, 2).T
    as_long = np.maximum(gps_time[last] - gps_time[first], SETTINGS.step_duration)
    sooner = _beside(gps_time, first, -as_long)
    later = _beside(gps_time, last, as_long)
    beside = np.abs([size[sooner] - size[first], size[later] - size[last]]).max(axis=0)
    is_quick = np.abs(size[last] - size[first]) > SETTINGS.steady_ratio * beside
    return np.column_stack([first, last])[is_quick]


def _beside(gps_time, rows, duration):
    """Rows a duration after rows, or before where it is negative; one row at least."""
    away = np.searchsorted(gps_time, gps_time[rows] + duration, side="right") - 1
    away = np.where(duration > 0, np.maximum(away, rows + 1), np.minimum(away, rows - 1))
    return away.clip(0, len(gps_time) - 1)


def runs(flags: np.ndarray, cuts: np.ndarray | tuple = ()) -> list[tuple[int, int]]:
    """First row of each run of flags, and the row after its last one; parted at cuts.

    Parameters
    ----------
    flags : (n,) bool array
    cuts : (k,) int array
    """
    change = np.diff(flags.astype(int), prepend=0, append=0)
    cuts = [row for row in cuts if 0 < row < len(flags) and flags[row - 1] and flags[row]]
    rows = [np.sort(np.append(np.flatnonzero(change == side), cuts)) for side in (1, -1)]
    return list(zip(*(row.astype(int) for row in rows), strict=True))


def steady_sigma(trajectory: Trajectory) -> np.ndarray:
    """Stated sigma (n, 3) of the position by the median about each epoch. Units: m.

    Parameters
    ----------
    trajectory : Trajectory
        With sigmas.
    """
    time = trajectory.gps_time
    sigma = trajectory.position_sigma
    steady = np.empty_like(sigma)
    for first, last in np.searchsorted(time, trajectory.passes):
        own = slice(first, last + 1)
        step = np.median(np.diff(time[max(first - 1, 0) : last + 2]))  # sessions differ in rate
        beside = round(SETTINGS.step_duration / float(step))
        for axis, stated in enumerate(sigma.T):
            steady[own, axis] = median_filter(stated[own], 2 * beside + 1, mode="nearest")
    return steady


def timely_sigma(trajectory: Trajectory, steps: Steps) -> tuple[np.ndarray, np.ndarray]:
    """Sigma (n, 3) of the position as stated, and by the median about each epoch, with the path.

    What a trajectory states is often of another rate, or of another filter, than its path: a step
    of the path near a change is the same event, seen better, since the error can't change at once
    where the path doesn't. There both change. Units: m.

    Parameters
    ----------
    trajectory : Trajectory
        With sigmas.
    steps : Steps
    """
    time = trajectory.gps_time
    sigma = trajectory.position_sigma.copy()
    steady = steady_sigma(trajectory)
    changes = quick_changes(time, np.linalg.norm(steady, axis=1))
    for change, step in _pairs(time[changes].mean(axis=1), steps.middle):
        first, last = changes[change]
        row = np.searchsorted(time, steps.middle[step])
        for values in (sigma, steady):
            first_low, last_low = _whole_change(time, values, first, last)
            values[first_low:row] = values[first_low]
            values[row:last_low] = values[last_low]
    return sigma, steady


def _whole_change(gps_time, values, first, last):
    """Rows of a change from where values (n, 3) are largest: a filter's variance falls slowly."""
    size = np.linalg.norm(values, axis=1)
    sooner, later = _beside(
        gps_time, np.array([first, last]), np.array([-1, 1]) * SETTINGS.step_duration
    )
    if size[last] < size[first]:
        first = sooner + int(np.argmax(size[sooner : first + 1]))
    else:
        last += int(np.argmax(size[last : later + 1]))
    return first, last


def continuous(
    gps_time: np.ndarray, amplitude: np.ndarray, least: np.ndarray, breaks: np.ndarray
) -> np.ndarray:
    """The largest amplitude (n, 3) below a given one that changes at once at breaks alone.

    Elsewhere it changes by no more than a factor of e in SETTINGS.change_interval, but for the
    part below ``least``: so drift that grows by a power of time is left as it is.

    Parameters
    ----------
    gps_time : (n,) array
        Units: s.
    amplitude : (n, 3) array
        Units: m.
    least : (3,) array
        What GNSS holds the POS to. Units: m.
    breaks : (k,) int array
        First rows after breaks.
    """
    clock = ((gps_time - gps_time[0]) / SETTINGS.change_interval)[:, None]
    logarithm = np.log(amplitude + least)
    for first, last in pairwise([0, *np.unique(breaks).tolist(), len(gps_time)]):
        rows = slice(first, last)
        onward = np.minimum.accumulate(logarithm[rows] - clock[rows], axis=0) + clock[rows]
        back = np.minimum.accumulate((onward + clock[rows])[::-1], axis=0)[::-1] - clock[rows]
        logarithm[rows] = back
    return np.clip(np.exp(logarithm) - least, 0.0, amplitude)


def _pairs(times, others):
    """Numbers (k, 2) of times and others that can be the same, twice as near as to any third."""
    back, _ = cKDTree(times[:, None]).query(others[:, None], 2)
    away, number = cKDTree(others[:, None]).query(times[:, None], 2)
    limit = np.minimum(away[:, 1], np.append(back[:, 1], 0.0)[number[:, 0]]) / 2  # 0: no others
    rows = np.flatnonzero(away[:, 0] < np.minimum(limit, SETTINGS.change_interval))
    return np.column_stack([rows, number[rows, 0]])
