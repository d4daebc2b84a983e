"""Stated sigmas of the POS, defaults for missing ones, and possible growth of its drift."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.frames import map_root
from mlscorr.pos.history import DriftHistory, drift_history
from mlscorr.pos.settings import SETTINGS
from mlscorr.survey import Pos, Trajectory

LEAP = 1e7  # s: on a clock, more than any correlation time
LOG_LEAP = 2e3  # the same on a logarithmic clock
ONWARD = 1e-6  # 1/s: a clock that does not advance would leave no room between two states
SOONEST = 0.05  # s after its start drift is still negligible


@dataclass(frozen=True)
class StatedSigma:
    """Assumptions about the POS at n epochs.

    Parameters
    ----------
    gps_time : (n,) array
        Units: s.
    position : (n, 3) array
        One sigma of E, N, H. Units: m.
    angles : (n, 3) array
        One sigma of roll, pitch, heading. Units: rad.
    rotation : Rotation
        The n recorded attitudes R_P^G.
    largest : (3,) array
        The position's largest sigma on the whole trajectory. Units: m.
    least, added, drift : (n, 3) array
        Parts of the position's sigma: with GNSS at its best, the excess of another solution, and
        the part that grows without GNSS. Units: m.
    history : DriftHistory
        Of the whole trajectory.
    starts : (k,) array
        Start of growth of each drift of the history. Units: s.
    """

    gps_time: np.ndarray
    position: np.ndarray
    angles: np.ndarray
    rotation: Rotation
    largest: np.ndarray
    least: np.ndarray
    added: np.ndarray
    drift: np.ndarray
    history: DriftHistory
    starts: np.ndarray

    @cached_property
    def attitude(self) -> np.ndarray:
        """Square root (n, 3, 3) of the attitude's covariance about the map axes. Units: rad."""
        return map_root(self.rotation, self.angles)

    @property
    def known_gnss(self) -> np.ndarray:
        """Part (n, 3) of the position's sigma that remains with GNSS; zero if unknown. Units: m."""
        if self.history.is_stated:
            return self.gnss
        return np.zeros_like(self.gnss)

    @property
    def gnss(self) -> np.ndarray:
        """Sigma (n, 3) of a POS with GNSS: the stated one, else that of RTK. Units: m."""
        return np.hypot(self.least, self.added)

    @cached_property
    def since(self) -> np.ndarray:
        """Time (n,) since drift began to grow, zero before. Units: s."""
        return np.maximum(self.gps_time - self.starts[self.history.growth(self.gps_time)], 0.0)

    @cached_property
    def ahead(self) -> np.ndarray:
        """Remaining fraction (n,) of a drift's time, if a smoother constrains its end; else 1.

        A (integrated) random walk w(t) that is back at zero at T, with its velocity, is a free
        one of another time, (1 - t / T)^p w(t / (1 - t / T)), with p = 1 (3).
        """
        number = self.history.growth(self.gps_time)
        start = self.starts[number]
        end = self.history.ends[number]
        is_tied = (self.since > 0) & np.isfinite(end)
        whole = np.subtract(end, start, out=np.ones(len(number)), where=is_tied)
        return np.where(is_tied, np.maximum(end - self.gps_time, SOONEST) / whole, 1.0)

    def grown(self, power: float) -> np.ndarray:
        """Sigma (n, 3) of drift that grows by a power of time to a POS's largest in an outage. m.

        Parameters
        ----------
        power : float
            3/2 for an integrated random walk, 1/2 for a random walk.
        """
        time = np.maximum(self.since * self.ahead, SOONEST) / SETTINGS.outage
        return self.largest * np.where(self.since > 0, time**power, 0.0)[:, None]

    @cached_property
    def clock(self) -> np.ndarray:
        """Time (n,) that leaps at restarts of drift. Units: s."""
        first = self.history.trajectory.gps_time[0]
        return self.gps_time - first + LEAP * self.history.segment(self.gps_time)

    @cached_property
    def folds_clock(self) -> np.ndarray:
        """Correlation times (n,) elapsed with the rise and decrease of a smoother's sigma(t).

        It rises within seconds of an outage's ends and stays constant long in its middle, like
        drift.
        """
        history = self.history
        passed = history.folds / SETTINGS.correlated_folds
        return np.interp(self.gps_time, history.trajectory.gps_time, passed)

    @cached_property
    def gnss_clock(self) -> np.ndarray | None:
        """Time (n,) that leaps at changes of the GNSS solution; None without any. s."""
        turns = self.history.turns
        if len(turns) == 0:
            return None
        first = self.history.trajectory.gps_time[0]
        return self.gps_time - first + LEAP * np.searchsorted(turns, self.gps_time)

    @cached_property
    def growth_clock(self) -> np.ndarray:
        """Logarithm (n,) of the time since drift began to grow, with leaps at these starts."""
        number = 2 * self.history.growth(self.gps_time) + (self.since > 0)
        onward = ONWARD * (self.gps_time - self.history.trajectory.gps_time[0])
        time = np.maximum(self.since, SOONEST) / (SOONEST * self.ahead)
        return np.log(time) + onward + LOG_LEAP * number

    def at(self, rows: slice | np.ndarray) -> StatedSigma:
        """Return the stated sigmas of some epochs.

        Parameters
        ----------
        rows : slice, (k,) int or (n,) bool array
        """
        return replace(
            self,
            gps_time=self.gps_time[rows],
            position=self.position[rows],
            angles=self.angles[rows],
            rotation=self.rotation[rows],
            least=self.least[rows],
            added=self.added[rows],
            drift=self.drift[rows],
        )


def stated_sigma(
    trajectory: Trajectory,
    pos: Pos,
    gps_time: np.ndarray | None = None,
    starts: np.ndarray | None = None,
) -> StatedSigma:
    """Return the sigmas stated by the POS, or assumed ones if the trajectory has none.

    Parameters
    ----------
    trajectory : Trajectory
        As recorded, as a whole: it gives the smallest sigma.
    pos : Pos
        Replaces sigmas that the trajectory doesn't have.
    gps_time : (n,) array, optional
        The trajectory's own epochs by default. Units: s.
    starts : (k,) array, optional
        Start of growth of each drift; as stated by sigma(t) by default. Units: s.

    Raises
    ------
    ValueError
        If a time is outside the trajectory or in one of its gaps.
    """
    if gps_time is None:
        pose = trajectory
    else:
        pose = trajectory.at(gps_time)
    history = drift_history(trajectory)
    if starts is None:
        starts = history.starts
    shape = (len(pose.gps_time), 3)
    position = np.full(shape, pos.position_sigma)
    angles = pose.attitude_sigma
    least = np.minimum(position, SETTINGS.gnss)
    added = np.zeros(shape)
    drift = position
    if trajectory.position_sigma is not None:
        parts = (history.sigma, history.least, history.added, history.drift)
        position, least, added, drift = (
            _at(pose.gps_time, trajectory.gps_time, part) for part in parts
        )
    if angles is None:
        angles = np.broadcast_to(pos.attitude_sigma, shape)
    largest = np.full(3, float(pos.position_sigma))
    if trajectory.position_sigma is not None:
        largest = history.sigma.max(axis=0)
    return StatedSigma(
        gps_time=pose.gps_time,
        position=position,
        angles=angles,
        rotation=pose.attitude,
        largest=largest,
        least=least,
        added=added,
        drift=drift,
        history=history,
        starts=starts,
    )


def _at(times, gps_time, values):
    """Interpolate values (n, 3) of epochs linearly in time."""
    return np.column_stack([np.interp(times, gps_time, column) for column in values.T])
