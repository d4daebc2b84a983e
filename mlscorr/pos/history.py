"""When the drift of a trajectory starts anew, and when it is said to grow."""

from dataclasses import dataclass
from weakref import WeakValueDictionary

import numpy as np

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
        When drift starts anew: at steps, starts of passes, falls of sigma(t). Units: s.
    starts : (k + 1,) array
        When it begins to grow in each segment between restarts: where sigma(t) says so, never
        (infinite) where it says that it doesn't, else at once. Units: s.
    held : (3,) array
        The sigma of E, N, H that stays while GNSS holds the POS; zero where sigma(t) doesn't tell
        it from the part that grows. Units: m.
    """

    trajectory: Trajectory
    steps: Steps
    restarts: np.ndarray
    starts: np.ndarray
    held: np.ndarray

    @property
    def is_stated(self) -> bool:
        """Whether sigma(t) tells when drift grows."""
        return bool(self.held.any())

    @property
    def edges(self) -> np.ndarray:
        """Ends (k + 2,) of the segments. Units: s."""
        ends = self.trajectory.gps_time[[0, -1]]
        return np.concatenate([ends[:1], self.restarts, ends[1:]])

    def segment(self, gps_time: np.ndarray) -> np.ndarray:
        """Number of the segment of each time, from 0.

        Parameters
        ----------
        gps_time : (n,) array
            Units: s.
        """
        return np.searchsorted(self.restarts, gps_time, side="right")

    def raised(self, gps_time: np.ndarray) -> np.ndarray:
        """Number of the stretch in which sigma(t) is raised, from 0; -1 where it isn't: (n,).

        Parameters
        ----------
        gps_time : (n,) array
            Units: s.
        """
        epochs, sigma = self.trajectory.gps_time, self.trajectory.position_sigma
        if sigma is None or not self.is_stated:
            return np.full(len(gps_time), -1)
        size = np.linalg.norm(sigma, axis=1)
        is_raised = size > SETTINGS.steady_ratio * np.linalg.norm(self.held)
        number = np.cumsum(np.diff(is_raised, prepend=False) & is_raised) - 1
        number[~is_raised] = -1
        return number[np.clip(np.searchsorted(epochs, gps_time), 0, len(epochs) - 1)]


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
    held, steps = held_sigma(trajectory), find_steps(trajectory)
    restarts = np.sort(np.concatenate([trajectory.passes[1:, 0], steps.middle]))
    if not held.any():
        starts = np.append(trajectory.gps_time[0], restarts)
        return DriftHistory(trajectory, steps, restarts, starts, held)
    restarts = np.sort(np.append(restarts, _falls(trajectory, held, restarts)))
    excess = np.maximum(trajectory.position_sigma**2 - held**2, 0.0).sum(axis=1)
    is_grown = excess > held @ held
    begins = trajectory.gps_time[np.flatnonzero(np.diff(is_grown, prepend=False) & is_grown)]
    after = np.searchsorted(begins, np.append(trajectory.gps_time[0], restarts))
    first = np.append(begins, np.inf)[after]
    starts = np.where(first < np.append(restarts, np.inf), first, np.inf)
    return DriftHistory(trajectory, steps, restarts, starts, held)


def _falls(trajectory, held, restarts):
    """Times at which sigma(t) falls back, without those of known restarts. Units: s."""
    size, time = np.linalg.norm(trajectory.position_sigma, axis=1), trajectory.gps_time
    is_large = size[:-1] > SETTINGS.steady_ratio * np.linalg.norm(held)
    rows = np.flatnonzero((size[1:] < SETTINGS.fall_ratio * size[:-1]) & is_large)
    falls = (time[rows] + time[rows + 1]) / 2
    # a sigma that falls while the path steps a little later or sooner tells of the same return
    away = np.abs(falls[:, None] - restarts).min(axis=1, initial=np.inf)
    return falls[away > SETTINGS.fix_time]


def held_sigma(trajectory: Trajectory) -> np.ndarray:
    """Sigma (3,) of E, N, H to which GNSS holds the POS; zero where sigma(t) is constant. m.

    Parameters
    ----------
    trajectory : Trajectory
        As recorded, as a whole.
    """
    sigma = trajectory.position_sigma
    if sigma is None:
        return np.zeros(3)
    held = np.percentile(sigma, SETTINGS.held_percentile, axis=0)
    return np.where(sigma.max(axis=0) <= SETTINGS.steady_ratio * held, 0.0, held)
