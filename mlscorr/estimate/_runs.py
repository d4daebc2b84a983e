"""Control points that deviate together: the POS drifts there, and doesn't say so.

A misread control point stands alone. Where neighbours in time are all rejected and deviate the same
way, the error is the POS's: its sigma is raised there as it grows between two places where
GNSS holds it, and everything is estimated anew. Where another pass sees them deviate likewise, it
is the points', as by one setup of the instrument: no POS drifts twice alike.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from mlscorr.estimate._screening import Screening
from mlscorr.estimate.equations import Equations
from mlscorr.estimate.settings import SETTINGS
from mlscorr.estimate.target_tests import TargetTest
from mlscorr.pos import SETTINGS as POS_SETTINGS
from mlscorr.pos import runs
from mlscorr.survey import Trajectory


@dataclass(frozen=True)
class DriftWindow:
    """A stretch of drift that the POS doesn't state.

    Parameters
    ----------
    first, last : float
        Between the control points that hold it; the pass's end where there is none. Units: s.
    size : float
        One sigma per axis in its middle. Units: m.
    is_open : bool
        Whether nothing holds its end.
    names : tuple of str
        The control points in it.
    """

    first: float
    last: float
    size: float
    is_open: bool
    names: tuple[str, ...]

    def sigma(self, gps_time: np.ndarray) -> np.ndarray:
        """One sigma (n,) of an integrated random walk that is held at its ends. Units: m.

        Parameters
        ----------
        gps_time : (n,) array
            Units: s.
        """
        share = np.clip((gps_time - self.first) / (self.last - self.first), 0.0, 1.0)
        held = share if self.is_open else 4.0 * share * (1.0 - share)
        inside = (gps_time >= self.first) & (gps_time <= self.last)
        return np.where(inside, self.size * held**1.5, 0.0)

    def __str__(self):
        return (
            f"{', '.join(self.names)} deviate together by {self.size:.2f} m and more per axis from "
            f"{self.first:.1f} to {self.last:.1f} s: the POS drifts there by more than it states, "
            "so that its sigma was raised."
        )


def find_windows(equations: Equations, screening: Screening) -> tuple[DriftWindow, ...]:
    """Stretches in which neighbours in time were rejected and deviate the same way.

    Parameters
    ----------
    equations : Equations
        Of all targets.
    screening : Screening
        Of these equations.
    """
    rejected = {test.name: test for test in screening.outliers}
    order = np.argsort(equations.observed, kind="stable")
    names = equations.names[order]
    times = equations.observed[order]
    is_out = np.isin(names, list(rejected))
    passes = np.flatnonzero(np.diff(equations.trajectory.segment(times))) + 1
    windows = []
    for start, end in runs(is_out, passes):
        rows = order[start:end]
        run = dict.fromkeys(names[start:end].tolist())
        deviations = [_Deviation.of(equations, rejected[name], rows) for name in run]
        if _is_drift(deviations):
            windows.append(_window(equations.trajectory, times, start, end, deviations))
    return tuple(w for w in windows if w.first < w.last)  # others passed there at the same time


class _Deviation(NamedTuple):
    """What a rejected target is off in a run (i, 3), with its sigma, and beyond the run (o, 3)."""

    name: str
    inside: np.ndarray
    sigma: np.ndarray
    beyond: np.ndarray

    @classmethod
    def of(cls, equations, test: TargetTest, rows):
        inside = np.isin(np.flatnonzero(equations.names == test.name), rows)
        return cls(test.name, test.left_out[inside], test.sigma[inside], test.left_out[~inside])


def _is_drift(run):
    """Whether a run is drift: two that differ, or three and more, of about one direction, which are
    not as far off the same way where they were seen beyond it.
    """
    ways = np.array([deviation.inside.mean(axis=0) for deviation in run])
    if len(ways) < 2:
        return False
    if len(ways) == 2:
        sigma = np.linalg.norm(np.vstack([deviation.sigma for deviation in run]))
        if np.linalg.norm(ways[1] - ways[0]) < SETTINGS.setup_sigmas * sigma:
            return False
    beyond = np.vstack([deviation.beyond for deviation in run])
    apart = beyond - np.repeat(ways, [len(deviation.beyond) for deviation in run], axis=0)
    if np.sum(apart**2) < np.sum(beyond**2):
        return False
    return np.linalg.norm(ways.mean(axis=0)) > 0.5 * np.linalg.norm(ways, axis=1).mean()


def _window(trajectory, times, start, end, run):
    begin, finish = trajectory.passes[trajectory.segment(times[start])]
    last_before = times[start - 1] if start > 0 else -np.inf
    first_after = times[end] if end < len(times) else np.inf
    ways = np.vstack([deviation.inside for deviation in run])
    size = float(np.sqrt(np.mean(np.sum(ways**2, axis=1)) / 3))
    first = max(begin, last_before)
    last = min(finish, first_after)
    names = tuple(deviation.name for deviation in run)
    return DriftWindow(float(first), float(last), size, bool(first_after > finish), names)


def with_windows(trajectory: Trajectory, windows: tuple[DriftWindow, ...]) -> Trajectory:
    """The trajectory with its position's sigma raised in windows of drift.

    Parameters
    ----------
    trajectory : Trajectory
        Without sigmas it is given those of a POS that GNSS holds.
    windows : tuple of DriftWindow
    """
    sigma = trajectory.position_sigma
    if sigma is None:
        sigma = np.tile(POS_SETTINGS.gnss, (len(trajectory), 1))
    variance = sigma**2
    for window in windows:
        variance = variance + window.sigma(trajectory.gps_time)[:, None] ** 2
    return replace(trajectory, position_sigma=np.sqrt(variance))
