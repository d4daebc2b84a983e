"""Thinning of many features to a fixed number for each second and direction."""

from collections.abc import Sequence

import numpy as np

from mlscorr.surfaces.places import integer_hash
from mlscorr.surfaces.settings import SETTINGS
from mlscorr.survey import TIE_KINDS, TieFeatures, Trajectory


def direction_class(direction: np.ndarray) -> np.ndarray:
    """Index (n,) from 0 to 26 of the nearest of the directions to a cube's neighbors.

    Parameters
    ----------
    direction : (n, 3) array
        Unit vectors.
    """
    largest = np.abs(direction).max(axis=1, keepdims=True)
    return np.rint(direction / largest).astype(int) @ [9, 3, 1] + 13


def kind_number(features: TieFeatures) -> np.ndarray:
    """Indices (n,) of the kinds of features in TIE_KINDS.

    Parameters
    ----------
    features : TieFeatures
    """
    return sum(number * (features.kind == kind) for number, kind in enumerate(TIE_KINDS))


def moment_number(gps_time: np.ndarray, trajectory: Trajectory | None = None) -> np.ndarray:
    """Index (n,) of the moment of each time; a standstill is one moment as long as a pause.

    Parameters
    ----------
    gps_time : (n,) array
        Units: s.
    trajectory : Trajectory, optional
        Shows the standstills of the scanner.
    """
    moment = np.floor(gps_time / SETTINGS.moment).astype(np.int64)
    if trajectory is None:
        return moment
    interval = np.floor(trajectory.gps_time / SETTINGS.pause)
    first = np.flatnonzero(np.diff(interval, prepend=-np.inf))
    position = trajectory.position
    extent = np.maximum.reduceat(position, first) - np.minimum.reduceat(position, first)
    stands = interval[first][np.linalg.norm(extent, axis=1) < SETTINGS.cell]
    own = np.floor(gps_time / SETTINGS.pause)
    whole = np.floor(own * SETTINGS.pause / SETTINGS.moment).astype(np.int64)
    return np.where(np.isin(own, stands), whole, moment)


def thin(
    features: TieFeatures, origin: np.ndarray, trajectory: Trajectory | None = None
) -> np.ndarray:
    """Select rows (k,) of the features to keep, independent of their order.

    At most SETTINGS.features are kept for each second, pass, kind and class of directions, so that
    memory depends on the duration of the drive, not on the points. The blocks of space with the
    smallest random numbers are kept. The numbers, and thus the blocks, are the same in all passes.

    Parameters
    ----------
    features : TieFeatures
    origin : (3,) array
        Origin of the blocks, the same for all passes. Units: m.
    trajectory : Trajectory, optional
        See moment_number.
    """
    moment = moment_number(features.gps_time, trajectory)
    bins = len(TIE_KINDS) * direction_class(features.direction) + kind_number(features)
    chances = [
        integer_hash(np.floor((features.centre - origin) / edge).astype(np.int64))
        for edge in (SETTINGS.thinning_block, SETTINGS.cell)
    ]
    group = np.column_stack([features.pass_number, moment, bins])
    return first_of_groups(group, [features.gps_time, *chances[::-1]], SETTINGS.features)


def first_of_groups(group: np.ndarray, order: Sequence[np.ndarray], number: int) -> np.ndarray:
    """Rows (k,) of at most a given number of each group: the first in an order.

    Parameters
    ----------
    group : (n, g) array
        Equal rows belong to one group.
    order : sequence of (n,) arrays
        As for numpy.lexsort, the last one is the primary key.
    number : int
    """
    rows = np.lexsort([*order, *group.T])
    begins = np.append(True, (np.diff(group[rows], axis=0) != 0).any(axis=1))[: len(rows)]
    first = np.flatnonzero(begins)
    rank = np.arange(len(rows)) - np.repeat(first, np.diff(np.append(first, len(rows))))
    return np.sort(rows[rank < number])
