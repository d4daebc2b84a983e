"""Which of many features and ties stay: the same number in each second and direction."""

import numpy as np

from mlscorr.survey import TIE_KINDS, TieFeatures, Ties, Trajectory
from mlscorr.ties.settings import SETTINGS


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
    """Number (n,) of the moment of times; a stand is one of a pause: nothing new is seen there.

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
    way = np.maximum.reduceat(position, first) - np.minimum.reduceat(position, first)
    stands = window[first][np.linalg.norm(way, axis=1) < SETTINGS.cell]
    own = np.floor(gps_time / SETTINGS.pause)
    whole = np.floor(own * SETTINGS.pause / SETTINGS.moment).astype(np.int64)
    return np.where(np.isin(own, stands), whole, moment)


def thin(
    features: TieFeatures, origin: np.ndarray, trajectory: Trajectory | None = None
) -> np.ndarray:
    """Rows (k,) of the features that stay, whatever the order in which they came.

    Of each second and pass, kind and class of directions stay at most SETTINGS.features, so that
    memory follows the time that was driven, not the points. Those stay whose block of space has
    the least of some random numbers, the same in all passes: what is left of one pass is left of
    the others.

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
    return _least(group, [features.gps_time, *chances[::-1]], SETTINGS.features)


def some_blocks(features: TieFeatures, number: int) -> TieFeatures:
    """About a number of features: all of some blocks of space, the same blocks in every pass.

    Parameters
    ----------
    features : TieFeatures
    number : int
    """
    if len(features) <= number:
        return features
    chance = integer_hash(np.floor(features.centre / SETTINGS.thinning_block).astype(np.int64))
    return features[chance <= np.partition(chance, number)[number]]


def thinned_ties(ties: Ties, number: int = SETTINGS.ties) -> Ties:
    """As many ties of each second of a pass, direction and other scanner as can tell anything.

    A second of them is believed to SETTINGS.best_second only (``weigh_by_time``): more of them
    would cost time alone. What m visits saw has m - 1 differences that tell something new, not
    m (m - 1) / 2, so the earlier view has as many ties with all later visits together. Those stay
    whose first place and later pass have the least of some random numbers, in the order of time,
    in which they are solved twice as fast.

    Parameters
    ----------
    ties : Ties
    number : int
        Of each second of a pass, direction and other scanner.
    """
    ties = ties[np.argsort(ties.gps_time[:, 0], kind="stable")]
    moment = np.floor(ties.gps_time[:, 0] / SETTINGS.moment).astype(np.int64)
    bins = direction_class(ties.direction)
    earlier, later = ties.pass_number.T
    group = np.column_stack([earlier, ties.scanner[:, 1], moment, np.minimum(bins, 26 - bins)])
    cell = np.floor(ties.place[:, 0] / SETTINGS.cell).astype(np.int64)
    chance = integer_hash(np.column_stack([cell, later]))
    return ties[_least(group, [ties.gps_time[:, 0], chance], number)]


def _least(group, order, number):
    """Rows (k,) of at most a number of each group (n, g): the first in an order, as of lexsort."""
    rows = np.lexsort([*order, *group.T])
    begins = np.append(True, (np.diff(group[rows], axis=0) != 0).any(axis=1))[: len(rows)]
    first = np.flatnonzero(begins)
    rank = np.arange(len(rows)) - np.repeat(first, np.diff(np.append(first, len(rows))))
    return np.sort(rows[rank < number])


def integer_hash(numbers: np.ndarray) -> np.ndarray:
    """A 64-bit number (n,) of integers (n, k): random, but the same for the same ones.

    Parameters
    ----------
    numbers : (n, k) int array
    """
    mixed = np.zeros(len(numbers), np.uint64)
    for number in numbers.T:
        mixed ^= number.astype(np.uint64)
        mixed *= np.uint64(0x9E3779B97F4A7C15)  # 2^64 over the golden ratio (Fibonacci hashing)
        mixed ^= mixed >> np.uint64(32)
    return mixed
