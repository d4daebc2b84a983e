"""Candidate pairs of observations and surveyed points, each judged by itself."""

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from mlscorr.matching.settings import SETTINGS
from mlscorr.survey import ControlPoints, TargetObservations


class CandidatePairs(NamedTuple):
    """Pairs of observation and control point within the search radius.

    Parameters
    ----------
    first : (n + 1,) int array
        Pairs first[i] to first[i + 1] are those of observation i.
    control : (p,) int array
        Rows of the control points.
    misclosure : (p, 3) array
        Surveyed - observed. Units: m.
    same : (p,) bool array
        True if kind and size agree.
    """

    first: np.ndarray
    control: np.ndarray
    misclosure: np.ndarray
    same: np.ndarray

    def of(self, row: int) -> slice:
        """Return the slice of an observation's pairs.

        Parameters
        ----------
        row : int
        """
        return slice(self.first[row], self.first[row + 1])


def same_appearance(
    observations: TargetObservations, rows: np.ndarray, control: ControlPoints, columns: np.ndarray
) -> np.ndarray:
    """Flag (k,) of observations that have the kind and size of control points.

    Parameters
    ----------
    observations : TargetObservations
    rows : (k,) int array
        Rows of the observations.
    control : ControlPoints
    columns : (k,) int array
        Rows of the control points.
    """
    kinds = (np.array(part.kind, dtype=object) for part in (observations, control))
    same_kind = np.equal(next(kinds)[rows], next(kinds)[columns]).astype(bool)
    difference = np.abs(control.size[columns] - observations.size[rows])
    return same_kind & (difference <= SETTINGS.size_tolerance)


def find_pairs(
    observations: TargetObservations, control: ControlPoints, search_radius: float
) -> CandidatePairs:
    """Find pairs within the search radius, with the observations' rows in order.

    Parameters
    ----------
    observations : TargetObservations
    control : ControlPoints
    search_radius : float
        Units: m.
    """
    n = len(observations)
    if n == 0 or len(control) == 0:
        first = np.zeros(n + 1, int)
        return CandidatePairs(first, np.empty(0, int), np.empty((0, 3)), np.empty(0, bool))
    tree = cKDTree(control.position)
    near = tree.query_ball_point(observations.position, search_radius, return_sorted=True)
    count = [len(columns) for columns in near]
    column = np.concatenate(near).astype(int)
    row = np.repeat(range(n), count)
    return CandidatePairs(
        first=np.append(0, np.cumsum(count)),
        control=column,
        misclosure=control.position[column] - observations.position[row],
        same=same_appearance(observations, row, control, column),
    )
