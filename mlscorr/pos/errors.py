"""Errors of a POS along a drive: stated sigma(t), unknown scales, and the start of drift."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mlscorr.collocation import Signal
from mlscorr.pos.history import DriftHistory, drift_history
from mlscorr.pos.prior import Predictive, predictive
from mlscorr.pos.signals import SignalParameters, pose_signals
from mlscorr.pos.stated import StatedSigma, stated_sigma
from mlscorr.survey import Pos, Summary, Trajectory


@dataclass(frozen=True, repr=False)
class PosErrors(Summary):
    """The errors of a POS along a recorded drive.

    Stated sigmas are a hypothesis. Parameters (SignalParameters) scale them and define how fast
    errors change; estimates with observations give their posterior.

    Parameters
    ----------
    trajectory : Trajectory
        As recorded, as a whole.
    pos : Pos
        Assumptions, used if the trajectory has no sigmas.
    starts : (k,) array
        Start of growth of each drift of the history. Units: s.
    """

    trajectory: Trajectory
    pos: Pos
    starts: np.ndarray

    @classmethod
    def stated(cls, trajectory: Trajectory, pos: Pos | None = None) -> PosErrors:
        """Return the errors as stated by the POS.

        Parameters
        ----------
        trajectory : Trajectory
        pos : Pos, optional
        """
        return cls(trajectory, pos or Pos(), drift_history(trajectory).starts)

    @property
    def history(self) -> DriftHistory:
        """History of the drift: its restarts, and the stated starts of its growth."""
        return drift_history(self.trajectory)

    def with_starts(self, starts: np.ndarray) -> PosErrors:
        """Return the same errors with other starts of drift.

        Parameters
        ----------
        starts : (k,) array
            Units: s.
        """
        return replace(self, starts=starts)

    def at(self, gps_time: np.ndarray) -> StatedSigma:
        """Return stated sigmas and their parts at some times.

        Parameters
        ----------
        gps_time : (n,) array
            Units: s.

        Raises
        ------
        ValueError
            If a time is outside the trajectory or in one of its gaps.
        """
        return stated_sigma(self.trajectory, self.pos, gps_time, self.starts)

    def predictive(self, gps_time: np.ndarray) -> Predictive:
        """Return hypotheses on the position error at some times, before any observation.

        Parameters
        ----------
        gps_time : (n,) array
            Units: s.
        """
        return predictive(self.at(gps_time).position, self.pos.correlation_time)

    def point_sigma(self, gps_time: np.ndarray, distance: np.ndarray) -> np.ndarray:
        """Return the largest stated sigma (n,) over all axes of points at a distance. Units: m.

        Parameters
        ----------
        gps_time, distance : (n,) array
            Units: s, m.
        """
        stated = self.at(gps_time)
        return np.hypot(stated.position.max(axis=1), distance * stated.angles.max(axis=1))

    def motion_covariance(self, gps_time: np.ndarray, duration: np.ndarray) -> np.ndarray:
        """Covariance (n, 3, 3) of the change of the position error about some times. Units: m^2.

        The rate of a smooth (Matern 3/2) process is sigma sqrt(3) over its correlation time. The
        attitude's share is neglected: an error of 0.1 mrad moves a target at 10 m by 1 mm in all.

        Parameters
        ----------
        gps_time, duration : (n,) array
            Times, and the standard deviation of the times of points scanned then. Units: s.
        """
        rate = self.at(gps_time).position * np.sqrt(3) / self.pos.correlation_time
        moved = rate * np.asarray(duration)[:, None]
        return moved[:, :, None] ** 2 * np.eye(3)

    @cached_property
    def epochs(self) -> StatedSigma:
        """Stated sigmas and their parts at all epochs of the trajectory."""
        return stated_sigma(self.trajectory, self.pos, starts=self.starts)

    def pose_signals(
        self, parameters: SignalParameters, rows: slice | np.ndarray = slice(None)
    ) -> tuple[Signal, ...]:
        """Return signals of position and rotation (six rows) at some epochs of the trajectory.

        Parameters
        ----------
        parameters : SignalParameters
        rows : slice or (k,) int array
            Of the trajectory's epochs; all by default.
        """
        stated = self.epochs.at(rows)
        partials = np.broadcast_to(np.eye(6), (len(stated.gps_time), 6, 6))
        return pose_signals(stated, parameters, partials)
