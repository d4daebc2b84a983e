"""When the drift of a trajectory starts anew, and when it is said to grow."""

from dataclasses import dataclass
from functools import cached_property
from weakref import WeakValueDictionary

import numpy as np

from mlscorr.pos.changes import continuous, quick_changes, runs, steady_sigma, timely_sigma
from mlscorr.pos.settings import SETTINGS
from mlscorr.pos.steps import Steps, find_steps
from mlscorr.survey import Trajectory


@dataclass(frozen=True)
class DriftHistory:
    """What a recorded trajectory tells of its drift.

    Parameters
    ----------
    trajectory : Trajectory
    steps : Steps
        Fall-backs that stand in the recorded path.
    restarts : (k,) array
        When drift starts anew: at steps and starts of passes; at falls of sigma(t) where the path
        has too few epochs to show a step. Units: s.
    returns : (r,) array
        When drift is back without a step of the path: sigma(t) has sunk gently from the middle of
        an outage, as of a smoother, or has fallen at once. Units: s.
    starts : (k + r + 1,) array
        When it begins to grow after the start, each restart and each return: where sigma(t) says
        so, never (infinite) where it says that it doesn't, else at once. Units: s.
    sigma : (n, 3) array
        What is stated of E, N, H, in time with the path; zero where nothing is. Units: m.
    held : (3,) array
        The sigma of E, N, H that stays while GNSS holds the POS; zero where sigma(t) doesn't tell
        it from the part that grows. Units: m.
    level : (n, 3) array
        The same at each epoch of the trajectory, larger where sigma(t) is raised at once, as by a
        solution that is not fixed: the smallest since it was raised, until it is raised again.
        Units: m.
    """

    trajectory: Trajectory
    steps: Steps
    restarts: np.ndarray
    returns: np.ndarray
    starts: np.ndarray
    sigma: np.ndarray
    held: np.ndarray
    level: np.ndarray

    @property
    def is_stated(self) -> bool:
        """Whether sigma(t) tells when drift grows."""
        return bool(self.held.any())

    @cached_property
    def edges(self) -> np.ndarray:
        """Start, restarts and returns, and end of the drive: (k + r + 2,). Units: s."""
        ends = self.trajectory.gps_time[[0, -1]]
        return np.sort(np.concatenate([ends, self.restarts, self.returns]))

    @cached_property
    def ends(self) -> np.ndarray:
        """Until when each drift that grows is back without a restart (k + r + 1,); infinite: never.

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

    def raised(self, gps_time: np.ndarray) -> np.ndarray:
        """Number of the stretch in which sigma(t) is raised, from 0; -1 where it isn't: (n,).

        Parameters
        ----------
        gps_time : (n,) array
            Units: s.
        """
        if not self.is_stated:
            return np.full(len(gps_time), -1)
        epochs = self.trajectory.gps_time
        size = np.linalg.norm(self.sigma, axis=1)
        is_raised = size > SETTINGS.steady_ratio * np.linalg.norm(self.held)
        number = np.cumsum(np.diff(is_raised, prepend=False) & is_raised) - 1
        number[~is_raised] = -1
        return number[np.clip(np.searchsorted(epochs, gps_time), 0, len(epochs) - 1)]

    @cached_property
    def turns(self) -> np.ndarray:
        """Times (j,) at which the level changes at once: another solution, of other errors. s.

        At a step of the path, or where one of the two solutions is GNSS at its best.
        """
        time = self.trajectory.gps_time
        size = np.linalg.norm(self.level, axis=1)
        # where the change is over: what is on the way is no larger than what was before
        rows = quick_changes(time, size)[:, 1]
        beside = np.linalg.norm([self.added[rows - 1], self.added[rows]], axis=2).min(axis=0)
        is_turn = np.isin(rows, self.steps.rows(time)) | (beside < np.linalg.norm(self.held))
        return ((time[rows - 1] + time[rows]) / 2)[is_turn]

    @cached_property
    def least(self) -> np.ndarray:
        """Sigma (n, 3) to which GNSS holds the POS at its best: changes at steps alone. Units: m.

        Zero where nothing is stated.
        """
        if self.is_stated:
            return np.tile(self.held, (len(self.sigma), 1))
        return self._continuous(np.minimum(self.sigma, SETTINGS.gnss))

    @cached_property
    def added(self) -> np.ndarray:
        """The level's part (n, 3) beyond what GNSS holds the POS to at its best. Units: m.

        It changes at once at steps alone, as drift does.
        """
        return self._continuous(np.sqrt(np.maximum(self.level**2 - self.held**2, 0.0)))

    @cached_property
    def drift(self) -> np.ndarray:
        """The part (n, 3) of the stated sigma that grows where GNSS is missing. Units: m."""
        return self._continuous(np.sqrt(np.maximum(self.sigma**2 - self.level**2, 0.0)))

    def _continuous(self, amplitude):
        time = self.trajectory.gps_time
        steps = self.steps
        starts = np.searchsorted(time, self.restarts)
        least = self.held if self.is_stated else SETTINGS.gnss
        return continuous(time, amplitude, least, np.append(starts, steps.rows(time)))


_KNOWN: WeakValueDictionary[int, DriftHistory] = WeakValueDictionary()


def drift_history(trajectory: Trajectory) -> DriftHistory:
    """The history of a trajectory, worked out once as long as somebody holds it.

    Parameters
    ----------
    trajectory : Trajectory
        As recorded, as a whole.
    """
    history = _KNOWN.get(id(trajectory))
    if history is None or history.trajectory is not trajectory:
        history = _KNOWN[id(trajectory)] = _history(trajectory)
    return history


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
    held = _held(steady)
    level = np.tile(held, (len(time), 1))
    if not held.any():
        starts = np.append(time[0], restarts)
        return DriftHistory(trajectory, steps, restarts, np.empty(0), starts, stated, held, level)
    size = np.linalg.norm(steady, axis=1)
    changes = quick_changes(time, size)
    falls = _falls(time, size, changes, held, restarts)
    is_raised = np.maximum(steady**2 - held**2, 0.0).sum(axis=1) > held @ held
    returns = _returns(time, size, runs(is_raised), np.sort(np.append(restarts, falls)))
    if _shows_steps(trajectory):
        returns = np.sort(np.append(returns, falls))
    else:
        restarts = np.sort(np.append(restarts, falls))
    edges = np.sort(np.concatenate([time[:1], restarts, returns]))
    grown = [np.inf]
    cuts = np.searchsorted(time, edges)
    following = len(time)
    for first, last in reversed(runs(is_raised, cuts)):
        at_once = changes[(changes[:, 0] <= first) & (first <= changes[:, 1]), 1]
        settled = min(at_once.max(initial=first), last - 1)
        if first in cuts or len(at_once):
            lowest = np.minimum.accumulate(steady[settled:following], axis=0)
            level[settled:following] = np.maximum(lowest, held)
            level[first:settled] = level[settled]
        # what is raised at once and goes back is no drift, but what GNSS holds the POS to
        if np.any((steady[settled:last] ** 2 - 2 * level[settled:last] ** 2).sum(axis=1) > 0):
            grown.append(time[first])
        following = first
    first = np.array(grown[::-1])[np.searchsorted(grown[::-1], edges)]
    starts = np.where(first < np.append(edges[1:], np.inf), first, np.inf)
    return DriftHistory(trajectory, steps, restarts, returns, starts, stated, held, level)


def _shows_steps(trajectory):
    """Whether braking moves a path by less in an epoch than a step that counts."""
    epoch = float(np.median(np.diff(trajectory.gps_time)))
    return SETTINGS.largest_jerk / 2 * epoch**3 < SETTINGS.smallest_step


def _returns(time, size, raised, restarts):
    """Ends of outages in the middle of which sigma(t) is largest, as a smoother states it. s."""
    returns = []
    for first, last in raised:
        if last == len(time):
            continue
        # sigma of a filter grows until GNSS is back, that of a smoother until the middle
        peak = time[first + np.argmax(size[first:last])]
        is_tied = first > 0 and peak < (time[first] + 3 * time[last]) / 4
        is_cut = (restarts > time[first]) & (restarts < time[last] + SETTINGS.reacquisition_time)
        if is_tied and not is_cut.any():
            returns.append(time[last])
    return np.array(returns)


def _falls(time, size, changes, held, restarts):
    """Times at which sigma(t) falls back, without those of known restarts. Units: s."""
    first, last = changes.T
    limit = SETTINGS.steady_ratio * np.linalg.norm(held)
    is_fall = (size[last] < size[first]) & (size[first] > limit)
    falls = (time[last - 1] + time[last])[is_fall] / 2
    # a sigma that falls while the path steps a little later or sooner tells of the same return
    away = np.abs(falls[:, None] - restarts).min(axis=1, initial=np.inf)
    return falls[away > SETTINGS.reacquisition_time]


def _held(sigma):
    """Sigma (3,) to which GNSS holds the POS, of (n, 3); zero where it is constant."""
    held = np.percentile(sigma, SETTINGS.held_percentile, axis=0)
    is_steady = (sigma.max(axis=0) <= SETTINGS.steady_ratio * held).all()
    if is_steady:
        return np.zeros(3)
    return held
