"""Restarts of the drift of a trajectory, and the stated starts of its growth.

The error of a position can't change abruptly if the recorded path doesn't. So the sigmas of its
parts change abruptly only at steps of the path, and elsewhere no faster than GNSS can show;
sigma(t) is used without the noise of single epochs.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.ndimage import median_filter
from scipy.spatial import cKDTree

from mlscorr.pos.settings import SETTINGS
from mlscorr.pos.steps import Steps, find_steps
from mlscorr.survey import Trajectory


@dataclass(frozen=True)
class DriftHistory:
    """History of the drift, as shown by a recorded trajectory.

    Parameters
    ----------
    trajectory : Trajectory
    steps : Steps
        Steps of the recorded path at re-acquisitions.
    restarts : (k,) array
        Restarts of drift: at steps and starts of passes; at falls of sigma(t) if the path has too
        few epochs to show a step. Units: s.
    returns : (r,) array
        Returns of drift to zero without a step of the path: sigma(t) has decreased gradually from
        the middle of an outage, as for a smoother, or has fallen abruptly. Units: s.
    smoothed : (j,) array
        The former of these. Units: s.
    starts : (k + r + 1,) array
        Start of growth after the start, each restart and each return: as stated by sigma(t), never
        (infinite) if it states no growth, else at once. Units: s.
    sigma : (n, 3) array
        Stated sigmas of E, N, H, synchronized with the path; zero if missing. Units: m.
    fixed_sigma : (3,) array
        The sigma of E, N, H that remains with GNSS; zero if sigma(t) doesn't separate it from the
        growing part. Units: m.
    solution_sigma : (n, 3) array
        The same at each epoch of the trajectory, larger after an abrupt increase of sigma(t), as by
        a solution that is not fixed: the smallest value since the increase, until the next one.
        Units: m.
    """

    trajectory: Trajectory
    steps: Steps
    restarts: np.ndarray
    returns: np.ndarray
    smoothed: np.ndarray
    starts: np.ndarray
    sigma: np.ndarray
    fixed_sigma: np.ndarray
    solution_sigma: np.ndarray

    @property
    def is_stated(self) -> bool:
        """True if sigma(t) shows the growth of drift."""
        return bool(self.fixed_sigma.any())

    @cached_property
    def edges(self) -> np.ndarray:
        """Start, restarts and returns, and end of the drive: (k + r + 2,). Units: s."""
        ends = self.trajectory.gps_time[[0, -1]]
        return np.sort(np.concatenate([ends, self.restarts, self.returns]))

    @cached_property
    def ends(self) -> np.ndarray:
        """End of each growing drift without a restart (k + r + 1,); infinite means never.

        Units: s.
        """
        return np.where(np.isin(self.edges[1:], self.returns), self.edges[1:], np.inf)

    def segment(self, gps_time: np.ndarray) -> np.ndarray:
        """Number of the segment between restarts of each time, from 0.

        Parameters
        ----------
        gps_time : (n,) array
            Units: s.
        """
        return np.searchsorted(self.restarts, gps_time, side="right")

    def growth(self, gps_time: np.ndarray) -> np.ndarray:
        """Number of the drift that may grow at each time, from 0.

        Parameters
        ----------
        gps_time : (n,) array
            Units: s.
        """
        return np.searchsorted(self.edges[1:-1], gps_time, side="right")

    def increase(self, gps_time: np.ndarray) -> np.ndarray:
        """Number of the interval of elevated sigma(t), from 0; -1 outside: (n,).

        Parameters
        ----------
        gps_time : (n,) array
            Units: s.
        """
        if not self.is_stated:
            return np.full(len(gps_time), -1)
        epochs = self.trajectory.gps_time
        size = np.linalg.norm(self.sigma, axis=1)
        is_increased = size > SETTINGS.steady_ratio * np.linalg.norm(self.fixed_sigma)
        number = np.cumsum(np.diff(is_increased, prepend=False) & is_increased) - 1
        number[~is_increased] = -1
        return number[np.clip(np.searchsorted(epochs, gps_time), 0, len(epochs) - 1)]

    @cached_property
    def turns(self) -> np.ndarray:
        """Times (j,) of abrupt changes of solution_sigma: another solution, of other errors. s.

        At a step of the path, or if one of the two solutions is GNSS at its best.
        """
        time = self.trajectory.gps_time
        size = np.linalg.norm(self.solution_sigma, axis=1)
        # end of the change: values in between are no larger than the earlier one
        rows = quick_changes(time, size)[:, 1]
        smaller = np.linalg.norm([self.added[rows - 1], self.added[rows]], axis=2).min(axis=0)
        is_turn = np.isin(rows, self.steps.rows(time)) | (
            smaller < np.linalg.norm(self.fixed_sigma)
        )
        return ((time[rows - 1] + time[rows]) / 2)[is_turn]

    @cached_property
    def least(self) -> np.ndarray:
        """Sigma (n, 3) of the POS with best GNSS, changing only at steps. Units: m.

        Zero if nothing is stated.
        """
        if self.is_stated:
            return np.tile(self.fixed_sigma, (len(self.sigma), 1))
        return self._continuous(np.minimum(self.sigma, SETTINGS.gnss))

    @cached_property
    def added(self) -> np.ndarray:
        """Part (n, 3) of solution_sigma in excess of that with best GNSS. Units: m.

        It changes abruptly only at steps, like drift.
        """
        return self._continuous(
            np.sqrt(np.maximum(self.solution_sigma**2 - self.fixed_sigma**2, 0.0))
        )

    @cached_property
    def drift(self) -> np.ndarray:
        """The part (n, 3) of the stated sigma that grows without GNSS. Units: m."""
        return self._continuous(np.sqrt(np.maximum(self.sigma**2 - self.solution_sigma**2, 0.0)))

    @cached_property
    def folds(self) -> np.ndarray:
        """E-folds (n,) of the total rise and decrease of sigma(t) in outages of a smoother.

        Of the size of all axes, without the noise of single epochs.
        """
        time = self.trajectory.gps_time
        if len(self.smoothed) == 0:  # sigma may be zero then
            return np.zeros(len(time))
        variance = self.drift**2 + self.least**2 + self.added**2
        logarithm = np.log(variance.sum(axis=1)) / 2
        change = np.zeros(len(time))
        for end in self.smoothed:
            start = self.edges[np.searchsorted(self.edges, end) - 1]
            first, last = np.searchsorted(time, [start, end])
            peak = first + int(np.argmax(logarithm[first : last + 1]))
            risen = np.maximum.accumulate(logarithm[first : peak + 1])
            sunk = np.minimum.accumulate(logarithm[peak : last + 1])
            change[first + 1 : last + 1] = np.abs(np.diff(np.append(risen, sunk[1:])))
        return np.cumsum(change)

    def _continuous(self, amplitude):
        time = self.trajectory.gps_time
        steps = self.steps
        starts = np.searchsorted(time, self.restarts)
        least = self.fixed_sigma if self.is_stated else SETTINGS.gnss
        return continuous(time, amplitude, least, np.append(starts, steps.rows(time)))


def drift_history(trajectory: Trajectory) -> DriftHistory:
    """Return the history of a trajectory, computed once.

    Parameters
    ----------
    trajectory : Trajectory
        As recorded, as a whole.
    """
    return trajectory.derived(_history)


def _history(trajectory):
    time = trajectory.gps_time
    steps = find_steps(trajectory)
    stated = steady = np.zeros((len(time), 3))
    if trajectory.position_sigma is not None:
        steady = steady_sigma(trajectory)
        changes = quick_changes(time, np.linalg.norm(steady, axis=1))
        steps = find_steps(trajectory, time[changes].mean(axis=1))
        stated, steady = timely_sigma(trajectory, steps)
    restarts = np.sort(np.concatenate([trajectory.passes[1:, 0], steps.middle]))
    fixed_sigma = _fixed_sigma(steady)
    solution_sigma = np.tile(fixed_sigma, (len(time), 1))
    if not fixed_sigma.any():
        starts = np.append(time[0], restarts)
        none = np.empty(0)
        return DriftHistory(
            trajectory, steps, restarts, none, none, starts, stated, fixed_sigma, solution_sigma
        )
    size = np.linalg.norm(steady, axis=1)
    changes = quick_changes(time, size)
    falls = _falls(time, size, changes, fixed_sigma, restarts)
    is_increased = (
        np.maximum(steady**2 - fixed_sigma**2, 0.0).sum(axis=1) > fixed_sigma @ fixed_sigma
    )
    smoothed = _returns(time, size, runs(is_increased), np.sort(np.append(restarts, falls)))
    returns = smoothed
    if _shows_steps(trajectory):
        returns = np.sort(np.append(smoothed, falls))
    else:
        restarts = np.sort(np.append(restarts, falls))
    edges = np.sort(np.concatenate([time[:1], restarts, returns]))
    grown = [np.inf]
    cuts = np.searchsorted(time, edges)
    following = len(time)
    for first, last in reversed(runs(is_increased, cuts)):
        at_once = changes[(changes[:, 0] <= first) & (first <= changes[:, 1]), 1]
        settled = min(at_once.max(initial=first), last - 1)
        if first in cuts or len(at_once):
            lowest = np.minimum.accumulate(steady[settled:following], axis=0)
            solution_sigma[settled:following] = np.maximum(lowest, fixed_sigma)
            solution_sigma[first:settled] = solution_sigma[settled]
        # a temporary abrupt increase is no drift, but a worse solution of GNSS
        if np.any(
            (steady[settled:last] ** 2 - 2 * solution_sigma[settled:last] ** 2).sum(axis=1) > 0
        ):
            grown.append(time[first])
        following = first
    first = np.array(grown[::-1])[np.searchsorted(grown[::-1], edges)]
    starts = np.where(first < np.append(edges[1:], np.inf), first, np.inf)
    return DriftHistory(
        trajectory, steps, restarts, returns, smoothed, starts, stated, fixed_sigma, solution_sigma
    )


def _shows_steps(trajectory):
    """True if braking moves a path by less in an epoch than the smallest step."""
    epoch = float(np.median(np.diff(trajectory.gps_time)))
    return SETTINGS.largest_jerk / 2 * epoch**3 < SETTINGS.smallest_step


def _returns(time, size, intervals, restarts):
    """Ends of outages with the largest sigma(t) in the middle, as stated by a smoother. s."""
    returns = []
    for first, last in intervals:
        if last == len(time):
            continue
        # sigma of a filter grows until GNSS returns, that of a smoother until the middle
        peak = time[first + np.argmax(size[first:last])]
        is_tied = first > 0 and peak < (time[first] + 3 * time[last]) / 4
        is_cut = (restarts > time[first]) & (restarts < time[last] + SETTINGS.reacquisition_time)
        if is_tied and not is_cut.any():
            returns.append(time[last])
    return np.array(returns)


def _falls(time, size, changes, fixed_sigma, restarts):
    """Times at which sigma(t) falls, except those of known restarts. Units: s."""
    first, last = changes.T
    limit = SETTINGS.steady_ratio * np.linalg.norm(fixed_sigma)
    is_fall = (size[last] < size[first]) & (size[first] > limit)
    falls = (time[last - 1] + time[last])[is_fall] / 2
    # a fall of sigma a little before or after a step of the path is the same return
    away = np.abs(falls[:, None] - restarts).min(axis=1, initial=np.inf)
    return falls[away > SETTINGS.reacquisition_time]


def _fixed_sigma(sigma):
    """Sigma (3,) with GNSS, from (n, 3) stated ones; zero if constant."""
    fixed_sigma = np.percentile(sigma, SETTINGS.fixed_percentile, axis=0)
    is_steady = (sigma.max(axis=0) <= SETTINGS.steady_ratio * fixed_sigma).all()
    if is_steady:
        return np.zeros(3)
    return fixed_sigma


def quick_changes(gps_time: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Rows (k, 2) before and after each abrupt change of a size, or one spread by filters.

    Before and after it the size is constant, or changes by less than half as much in an equal time:
    growth from zero, and decrease to it, is no such change, although it doubles quickly.

    Parameters
    ----------
    gps_time : (n,) array
        Units: s.
    size : (n,) array
        Units: m.
    """
    later = _rows_after(gps_time, np.arange(len(size)), SETTINGS.step_duration)
    least, largest = np.sort([size[later], size], axis=0)
    changed = []
    for first, last in runs(largest > SETTINGS.steady_ratio * least):
        changes = np.abs(np.diff(size[first : later[last - 1] + 1]))
        large = first + np.flatnonzero(changes >= changes.max() / SETTINGS.steady_ratio)
        changed.append((large[0], large[-1] + 1))
    first, last = np.array(changed, int).reshape(-1, 2).T
    as_long = np.maximum(gps_time[last] - gps_time[first], SETTINGS.step_duration)
    sooner = _rows_after(gps_time, first, -as_long)
    later = _rows_after(gps_time, last, as_long)
    change_nearby = np.abs([size[sooner] - size[first], size[later] - size[last]]).max(axis=0)
    is_quick = np.abs(size[last] - size[first]) > SETTINGS.steady_ratio * change_nearby
    return np.column_stack([first, last])[is_quick]


def _rows_after(gps_time, rows, duration):
    """Rows a duration after rows, or before if it is negative; at least one row away."""
    away = np.searchsorted(gps_time, gps_time[rows] + duration, side="right") - 1
    away = np.where(duration > 0, np.maximum(away, rows + 1), np.minimum(away, rows - 1))
    return away.clip(0, len(gps_time) - 1)


def runs(flags: np.ndarray, cuts: np.ndarray | tuple = ()) -> list[tuple[int, int]]:
    """First row of each run of flags, and the row after its last one; split at cuts.

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
        half_width = round(SETTINGS.step_duration / float(step))
        for axis, stated in enumerate(sigma.T):
            steady[own, axis] = median_filter(stated[own], 2 * half_width + 1, mode="nearest")
    return steady


def timely_sigma(trajectory: Trajectory, steps: Steps) -> tuple[np.ndarray, np.ndarray]:
    """Sigma (n, 3) of the position as stated, and by a running median, timed by the path.

    Sigmas often have another rate, or come from another filter, than the path: a step of the path
    near a change is the same event, with a better time, because the error can't change abruptly if
    the path doesn't. Both change at the step. Units: m.

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
    """Rows of a change from the largest values (n, 3) on: a filter's variance falls slowly."""
    size = np.linalg.norm(values, axis=1)
    sooner, later = _rows_after(
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
    """Largest amplitude (n, 3) below a given one that changes abruptly only at breaks.

    Elsewhere it changes by no more than a factor of e in SETTINGS.change_interval, except for the
    part below ``least``: so drift that grows by a power of time is unchanged.

    Parameters
    ----------
    gps_time : (n,) array
        Units: s.
    amplitude : (n, 3) array
        Units: m.
    least : (3,) array
        Sigma of the POS with GNSS. Units: m.
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
    """Index pairs (k, 2) of matching times, twice as close as to any third one."""
    back, _ = cKDTree(times[:, None]).query(others[:, None], 2)
    away, number = cKDTree(others[:, None]).query(times[:, None], 2)
    limit = np.minimum(away[:, 1], np.append(back[:, 1], 0.0)[number[:, 0]]) / 2  # 0: no others
    rows = np.flatnonzero(away[:, 0] < np.minimum(limit, SETTINGS.change_interval))
    return np.column_stack([rows, number[rows, 0]])
