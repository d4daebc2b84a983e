"""Steps of the recorded position that no vehicle drives."""

from dataclasses import dataclass

import numpy as np

from mlscorr.pos.settings import SETTINGS
from mlscorr.survey import Columns, Trajectory

NOWHERE = np.empty(0)  # s


@dataclass(frozen=True, eq=False, repr=False)
class Steps(Columns):
    """Steps of the position at re-acquisitions of GNSS.

    Parameters
    ----------
    before, after : (k,) array
        Last epoch before and first one after each step. Units: s.
    size : (k, 3) array
        Motion of the position in excess of the vehicle's, after - before. Units: m.
    sigma : (k,) array
        One sigma of it per axis, from the uncertainty of the vehicle's motion. Units: m.
    """

    before: np.ndarray
    after: np.ndarray
    size: np.ndarray
    sigma: np.ndarray

    @property
    def middle(self) -> np.ndarray:
        """Times (k,) between before and after. Units: s."""
        return (self.before + self.after) / 2

    def rows(self, gps_time: np.ndarray) -> np.ndarray:
        """Return rows of the epochs inside steps and at their ends, each the first after a change.

        Parameters
        ----------
        gps_time : (n,) array
            Units: s.
        """
        number = np.searchsorted(self.before, gps_time, side="left") - 1  # steps don't overlap
        is_after = number >= 0
        is_after[is_after] = gps_time[is_after] <= self.after[number[is_after]]
        return np.flatnonzero(is_after)


def find_steps(trajectory: Trajectory, changes: np.ndarray = NOWHERE) -> Steps:
    """Find steps of the recorded position relative to the speed before and after them.

    Over three equal spans the middle one's distance is half of both others', straight on or turned
    with the vehicle, except for half the jerk times the span cubed. A larger difference, far above
    the largest ones of all other seconds, is a step.

    Parameters
    ----------
    trajectory : Trajectory
    changes : (t,) array, optional
        Times of abrupt changes of sigma(t), at which smaller steps are accepted than elsewhere.
        Units: s.

    Examples
    --------
    >>> from scipy.spatial.transform import Rotation
    >>> time = np.arange(0.0, 60.0, 0.1)
    >>> path = np.outer(time, [10.0, 0.0, 0.0])
    >>> path[300:, 1] += 1.5
    >>> steps = find_steps(Trajectory(413200.0 + time, path, Rotation.identity(600)))
    >>> steps.size.round(6) + 0.0
    array([[0. , 1.5, 0. ]])
    """
    table = [np.empty((0, 6))]
    for first, last in trajectory.passes:
        rows = (trajectory.gps_time >= first) & (trajectory.gps_time <= last)
        inside = changes[(changes >= first) & (changes <= last)]
        table.append(_steps_of_pass(trajectory.select(rows), inside))
    columns = np.vstack(table)
    return Steps(columns[:, 0], columns[:, 1], columns[:, 2:5], columns[:, 5])


def _steps_of_pass(driven, changes):
    """Rows (k, 6) of the steps of one pass: before, after, size, sigma."""
    gps_time = driven.gps_time
    if len(gps_time) < 2:
        return np.empty((0, 6))
    epochs = max(round(SETTINGS.step_duration / float(np.median(np.diff(gps_time)))), 1)
    spans = {1, *(epochs // part for part in (4, 2, 1))} - {0}
    candidates = [row for span in spans for row in _differences(driven, span, changes)]
    steps = []
    while candidates:
        largest = max(candidates, key=_length)
        group = [row for row in candidates if _is_near(row, largest)]
        candidates = [row for row in candidates if not _is_near(row, largest)]
        whole = [row for row in group if _length(row) >= SETTINGS.whole_step * _length(largest)]
        shortest = min(whole, key=lambda row: row[1] - row[0])
        spread = np.std([row[2:5] for row in whole], axis=0).max()
        steps.append([*shortest[:5], np.hypot(shortest[5], spread)])
    return np.array(sorted(steps)).reshape(-1, 6)


def _length(row):
    return float(np.linalg.norm(row[2:5]))


def _is_near(row, other):
    """True if two rows are within a second of each other."""
    return row[0] < other[1] + 1.0 and row[1] > other[0] - 1.0


def _differences(driven, span, changes):
    """Rows (before, after, size, sigma): seconds' largest differences, if far above others'."""
    gps_time = driven.gps_time
    if len(gps_time) <= 3 * span + 1:
        return []
    displacements, times = (
        values[span:] - values[:-span] for values in (driven.position, gps_time)
    )
    speed = displacements / times[:, None]
    frames = driven.attitude[span // 2 : span // 2 + len(displacements)]
    turned = frames.inv().apply(speed)  # a car turns with its path, a drone may not
    about = [(v[: -2 * span] + v[2 * span :]) / 2 for v in (speed, turned)]
    about[1] = frames[span:-span].apply(about[1])
    sizes = displacements[span:-span] - times[span:-span, None] * np.array(about)
    lengths = np.linalg.norm(sizes, axis=2)
    nearer = np.argmin(lengths, axis=0)
    rows = np.arange(lengths.shape[1])
    size = sizes[nearer, rows]
    length = lengths[nearer, rows]
    start = gps_time[span : span + len(size)]
    second = np.floor(start - gps_time[0]).astype(int)
    largest = np.zeros(second[-1] + 1)
    np.maximum.at(largest, second, length)
    usual = np.median(largest[np.unique(second)])
    jerk = SETTINGS.largest_jerk / 2 * times[span : span + len(size)] ** 3
    limit = np.maximum(jerk, max(SETTINGS.smallest_step, SETTINGS.step_ratio * usual))
    is_step = (length > limit) & (length == largest[second])
    for time in changes:  # one place to search, not a whole drive
        rows = np.flatnonzero(
            np.abs(start + times[span : span + len(size)] / 2 - time) < SETTINGS.change_interval
        )
        if len(rows):
            row = rows[np.argmax(length[rows])]
            is_step[row] |= length[row] > max(jerk[row], SETTINGS.steady_ratio * usual)
    is_step[:span] = is_step[-span:] = False  # half of a step in the outer span
    rows = np.flatnonzero(is_step)
    # a step shown by both adjacent spans is none: filters and resampling ring near one
    padded = np.pad(length, 2 * span, constant_values=usual)
    sigma = padded[[rows, rows + 4 * span]].max(axis=0).clip(usual)
    return [
        (start[i], gps_time[i + 2 * span], *size[i], s) for i, s in zip(rows, sigma, strict=True)
    ]
