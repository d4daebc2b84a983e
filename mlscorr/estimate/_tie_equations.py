"""Ties as observation equations: one row, seen at two epochs.

n . (c(t1) - c(t2)) at the places of both views is the misclosure, with c = P (trend + signals); a
control target is the case in which one of both sides is surveyed. A mounting is the same at both.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from mlscorr.collocation import Noise, SparseRows
from mlscorr.estimate.settings import SETTINGS
from mlscorr.estimate.signals import SignalParameters, pose_signals
from mlscorr.frames import mounting_partials, partials_by_scanner, pose_partials
from mlscorr.pos import StatedSigma, stated_sigma
from mlscorr.survey import Mounting, Pos, Ties, Trajectory

SIGNS = np.array([1.0, -1.0])  # of the corrections at the first and the second view


@dataclass(frozen=True)
class TieEquations:
    """The equations of n ties.

    Parameters
    ----------
    gps_time : (n, 2) array
        Views within SETTINGS.tie_epoch share their mean time. Units: s.
    misclosure, variance : (n,) array
        Units: m, m^2.
    partials : (n, 2, 6) array
        n^T P of the first view, -n^T P of the second.
    stated : StatedSigma
        At the 2 n views.
    weight : (n,) array
        By which the variance is divided: what robust estimation makes of each.
    mounting : (n, p) array, optional
        n^T (M of the first view - M of the second): partial derivatives by mountings that are
        estimated, six columns each (Eq. 16-18).
    """

    gps_time: np.ndarray
    misclosure: np.ndarray
    variance: np.ndarray
    partials: np.ndarray
    stated: StatedSigma
    weight: np.ndarray
    mounting: np.ndarray | None = None

    @classmethod
    def of(
        cls,
        trajectory: Trajectory,
        pos: Pos,
        ties: Ties,
        stated: StatedSigma,
        mountings: Mapping[int, Mounting] | None = None,
    ) -> TieEquations:
        """The equations of ties.

        Parameters
        ----------
        trajectory : Trajectory
            As recorded.
        pos : Pos
        ties : Ties
        stated : StatedSigma
            Of the control points, whose segments and whose growth of drift the ties share.
        mountings : dict, optional
            Those with which the ties were georeferenced and whose errors are estimated, by the
            number of their scanner.
        """
        times = ties.gps_time.ravel()
        places = ties.place.reshape(-1, 3)
        along = along_ties(ties.direction, pose_partials(trajectory, places, times))
        epochs = _epochs(times, stated.history)
        columns = None
        if mountings:
            columns = mounting_columns(trajectory, mountings, ties)
        return cls(
            gps_time=epochs.reshape(-1, 2),
            misclosure=ties.misclosure,
            variance=ties.variance,
            partials=along,
            stated=stated_sigma(trajectory, pos, epochs, stated.starts),
            weight=np.ones(len(ties)),
            mounting=columns,
        )

    def __len__(self) -> int:
        return len(self.misclosure)

    def select(self, rows: np.ndarray | slice) -> TieEquations:
        """The equations of some ties.

        Parameters
        ----------
        rows : (n,) bool or (k,) int array, or slice
        """
        views = np.arange(2 * len(self)).reshape(-1, 2)[rows].ravel()
        mounting = self.mounting
        if mounting is not None:
            mounting = mounting[rows]
        return replace(
            self,
            gps_time=self.gps_time[rows],
            misclosure=self.misclosure[rows],
            variance=self.variance[rows],
            partials=self.partials[rows],
            stated=self.stated.at(views),
            weight=self.weight[rows],
            mounting=mounting,
        )

    def with_starts(self, starts: np.ndarray) -> TieEquations:
        """The same with drift that grows from other times on.

        Parameters
        ----------
        starts : (k,) array
            Units: s.
        """
        return replace(self, stated=replace(self.stated, starts=starts))

    def rows(self, parameters: SignalParameters, pose_design: Callable) -> SparseRows:
        """Rows for the solver.

        Parameters
        ----------
        parameters : SignalParameters
        pose_design : function of times
            A (q, 6, p) of position and rotation, where the columns of mountings come first: they
            move no pose. What comes behind them no tie sees.
        """
        n = len(self)
        times = self.gps_time.ravel()
        views = self.partials.reshape(2 * n, 1, 6)
        pose = pose_design(times)
        design = (views @ pose).reshape(n, 2, 1, pose.shape[2]).sum(axis=1)
        if self.mounting is not None:
            design[:, 0, : self.mounting.shape[1]] += self.mounting
        return SparseRows(
            gps_time=self.gps_time,
            misclosure=self.misclosure[:, None],
            noise=Noise((self.variance / self.weight)[:, None, None]),
            design=design,
            signals=pose_signals(self.stated, parameters, views),
        )


def mounting_columns(
    trajectory: Trajectory, mountings: Mapping[int, Mounting], ties: Ties
) -> np.ndarray:
    """Partial derivatives (n, 6 k) of ties by the errors of k mountings  (Eq. 16-18).

    Parameters
    ----------
    trajectory : Trajectory
    mountings : dict
        By the number of their scanner.
    ties : Ties
    """
    views = ties.place.reshape(-1, 3), ties.gps_time.ravel(), ties.scanner.ravel()
    partials = partials_by_scanner(mounting_partials, trajectory, mountings, *views)
    return along_ties(ties.direction, partials).sum(axis=1)


def _epochs(gps_time, history):
    """Mean time (q,) of the views of each short stretch of a segment. Units: s.

    Each epoch is an unknown of the noise of GNSS: with those of all views a survey of two scanners
    takes 17 times as long to solve.
    """
    since = gps_time - gps_time.min(initial=np.inf)
    stretch = np.floor(since / SETTINGS.tie_epoch)
    keys = np.column_stack([history.segment(gps_time), stretch])
    number = np.unique(keys, axis=0, return_inverse=True)[1].ravel()
    mean = np.bincount(number, since) / np.bincount(number)
    return (gps_time - since) + mean[number]


def along_ties(direction: np.ndarray, partials: np.ndarray) -> np.ndarray:
    """Partial derivatives (n, 2, j) of ties by what moves both views, the second with minus.

    Parameters
    ----------
    direction : (n, 3) array
    partials : (2 n, 3, j) array
        Of the places of both views, one after the other.
    """
    by_view = partials.reshape(len(direction), 2, 3, partials.shape[2])
    return SIGNS[:, None] * np.einsum("ni,nvij->nvj", direction, by_view)
