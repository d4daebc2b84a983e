"""Where the scanner was while a piece of cloud was measured."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mlscorr.survey import Survey


@dataclass(frozen=True)
class ScannerPath:
    """Places of a scanner, between which it moved evenly: exact enough for directions.

    Parameters
    ----------
    gps_time : (k,) array
        Two at least, in order. Units: s.
    position : (k, 3) array
        Units: m.

    >>> path = ScannerPath(np.array([0.0, 1.0]), np.array([[0.0, 0.0, 2.0], [0.0, 8.0, 2.0]]))
    >>> path.at([0.25]).tolist()
    [[0.0, 2.0, 2.0]]
    """

    gps_time: np.ndarray
    position: np.ndarray

    @classmethod
    def of(cls, survey: Survey, gps_time: np.ndarray) -> ScannerPath:
        """The path at the epochs of a survey's trajectory about times.

        Parameters
        ----------
        survey : Survey
            Its trajectory and lever arm.
        gps_time : (n,) array
            One at least. Units: s.
        """
        trajectory = survey.trajectory
        time = survey.trajectory.gps_time
        before = np.searchsorted(time, gps_time.min(), "right") - 1
        before = int(np.clip(before, 0, len(time) - 2))
        epochs = slice(before, max(before + 2, np.searchsorted(time, gps_time.max()) + 1))
        arm = trajectory.attitude[epochs].apply(survey.assumed_mounting.lever_arm)
        return cls(time[epochs], trajectory.position[epochs] + arm)

    def at(self, gps_time: np.ndarray) -> np.ndarray:
        """Places (n, 3) at times (n,) in s. Units: m."""
        return np.column_stack([np.interp(gps_time, self.gps_time, p) for p in self.position.T])

    def seen_from(self, origin: np.ndarray) -> ScannerPath:
        """The path in coordinates from an origin (3,) in m."""
        return ScannerPath(self.gps_time, self.position - origin)
