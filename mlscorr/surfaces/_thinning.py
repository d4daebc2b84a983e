"""Choice among many features: as many in each second and direction."""

from collections.abc import Sequence

import numpy as np

from mlscorr.surfaces.places import integer_hash
from mlscorr.surfaces.settings import SETTINGS
from mlscorr.survey import TIE_KINDS, TieFeatures, Trajectory


def direction_class(direction: np.ndarray) -> np.ndarray:
    """Number (n,) from 0 to 26 of the nearest of the directions to a cube's neighbours.

    Parameters
    ----------
    direction : (n, 3) array
        Unit vectors.
    """
    largest = np.abs(direction).max(axis=1, keepdims=True)
    return np.rint(direction / largest).astype(int) @ [9, 3, 1] + 13


def kind_number(features: TieFeatures) -> np.ndarray:
    """Numbers (n,) of the kinds of features among TIE_KINDS.

    Parameters
    ----------
    features : TieFeatures
    """
    return sum(number * (features.kind == kind) for number, kind in enumerate(TIE_KINDS))


def moment_number(gps_time: np.ndarray, trajectory: Trajectory | None = None) -> np.ndarray:
    """Number (n,) of the moment of times; a standstill is one moment a pause long.

    Parameters
    ----------
    gps_time : (n,) array
        Units: s.
    trajectory : Trajectory, optional
        That says where the scanner stands.
    """
    moment = np.floor(gps_time / SETTINGS.moment).astype(np.int64)
    if trajectory is None:
        return moment
    window = np.floor(trajectory.gps_time / SETTINGS.pause)
    first = np.flatnonzero(np.diff(window, prepend=-np.inf))
    position = trajectory.position
    extent = np.maximum.reduceat(position, first) - np.minimum.reduceat(position, first)
    stands = window[first][np.linalg.norm(extent, axis=1) < SETTINGS.cell]
    own = np.floor(gps_time / SETTINGS.pause)
    whole = np.floor(own * SETTINGS.pause / SETTINGS.moment).astype(np.int64)
    return np.where(np.isin(own, stands), whole, moment)


def thin(
    features: TieFeatures, origin: np.ndarray, trajectory: Trajectory | None = None
) -> np.ndarray:
    """Rows (k,) of the features to keep, whatever the order in which they came.

    At most SETTINGS.features are kept of each second, pass, kind and class of directions, so that
    memory follows the time of the drive, not the points. The blocks of space with the smallest of
    some random numbers are kept. These are the same in all passes, so the same blocks are, too.

    Parameters
    ----------
    features : TieFeatures
    origin : (3,) array
        Of the blocks: the same for all passes. Units: m.
    trajectory : Trajectory, optional
        As of moment_number.
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
    """Rows (k,) of at most a number of each group: the first in an order.

    Parameters
    ----------
    group : (n, g) array
        Rows that are equal are of one group.
    order : sequence of (n,) arrays
        As of numpy.lexsort: the last one counts first.
    number : int
    """
    rows = np.lexsort([*order, *group.T])
    begins = np.append(True, (np.diff(group[rows], axis=0) != 0).any(axis=1))[: len(rows)]
    first = np.flatnonzero(begins)
    rank = np.arange(len(rows)) - np.repeat(first, np.diff(np.append(first, len(rows))))
    return np.sort(rows[rank < number])
