"""What a POS errs by along a drive: stated sigma(t), open scales, and when drift grows."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mlscorr.collocation import Signal
from mlscorr.pos.history import DriftHistory, drift_history
from mlscorr.pos.signals import SignalParameters, pose_signals
from mlscorr.pos.stated import StatedSigma, stated_sigma
from mlscorr.survey import Pos, Summary, Trajectory


@dataclass(frozen=True, repr=False)
class PosErrors(Summary):
    """The errors of a POS along a recorded drive.

    What the POS states is a hypothesis. Parameters (SignalParameters) scale it and say how fast
    errors change; whoever has observations makes a posterior of them.

    Parameters
    ----------
    trajectory : Trajectory
        As recorded, as a whole.
    pos : Pos
        Beliefs, used where the trajectory has no sigmas.
    starts : (k,) array
        When each drift of the history begins to grow. Units: s.
    """

    trajectory: Trajectory
    pos: Pos
    starts: np.ndarray

    @classmethod
    def stated(cls, trajectory: Trajectory, pos: Pos | None = None) -> PosErrors:
        """The errors as the POS states them.

        Parameters
        ----------
        trajectory : Trajectory
        pos : Pos, optional
        """
        return cls(trajectory, pos or Pos(), drift_history(trajectory).starts)

    @property
    def history(self) -> DriftHistory:
        """When drift starts anew, and when it is said to grow."""
        return drift_history(self.trajectory)

    def with_starts(self, starts: np.ndarray) -> PosErrors:
        """The same with drift that grows from other times on.

        Parameters
        ----------
        starts : (k,) array
            Units: s.
        """
        return replace(self, starts=starts)

    def at(self, gps_time: np.ndarray) -> StatedSigma:
        """Stated sigmas and their parts at some times.

        Parameters
        ----------
        gps_time : (n,) array
            Units: s.

        Raises
        ------
        ValueError
            Where a time lies outside the trajectory or in one of its gaps.
        """
        return stated_sigma(self.trajectory, self.pos, gps_time, self.starts)

    @cached_property
    def epochs(self) -> StatedSigma:
        """Stated sigmas and their parts at all epochs of the trajectory."""
        return stated_sigma(self.trajectory, self.pos, starts=self.starts)

    def pose_signals(
        self, parameters: SignalParameters, rows: slice | np.ndarray = slice(None)
    ) -> tuple[Signal, ...]:
        """Signals of position and rotation (six rows) at some epochs of the trajectory.

        Parameters
        ----------
        parameters : SignalParameters
        rows : slice or (k,) int array
            Of the trajectory's epochs; all by default.
        """
        stated = self.epochs.at(rows)
        partials = np.broadcast_to(np.eye(6), (len(stated.gps_time), 6, 6))
        return pose_signals(stated, parameters, partials)
