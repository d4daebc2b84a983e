"""Thinning of ties by second and direction, and of features by blocks."""

import numpy as np

from mlscorr.surfaces import SETTINGS as SURFACES
from mlscorr.surfaces import direction_class, first_of_groups, integer_hash
from mlscorr.survey import TieFeatures, Ties
from mlscorr.ties.settings import SETTINGS


def some_blocks(features: TieFeatures, number: int) -> TieFeatures:
    """Select about a number of features: all in some blocks of space, the same in every pass.

    Parameters
    ----------
    features : TieFeatures
    number : int
    """
    if len(features) <= number:
        return features
    chance = integer_hash(np.floor(features.centre / SURFACES.thinning_block).astype(np.int64))
    return features[chance <= np.partition(chance, number)[number]]


def thinned_ties(ties: Ties, number: int = SETTINGS.ties) -> Ties:
    """Thin ties to a useful number for each second of a pass, direction and other scanner.

    The ties of a second are limited to the accuracy SETTINGS.best_second (``weigh_by_time``), so
    more of them would only cost time. A feature observed at m visits has m - 1 independent
    differences, not m (m - 1) / 2, so the number holds for the earlier view with all later visits
    together. The ties with the smallest random numbers of first position and later pass are kept,
    sorted by time, which makes their solution twice as fast.

    Parameters
    ----------
    ties : Ties
    number : int
        For each second of a pass, direction and other scanner.
    """
    ties = ties[np.argsort(ties.gps_time[:, 0], kind="stable")]
    moment = np.floor(ties.gps_time[:, 0] / SURFACES.moment).astype(np.int64)
    bins = direction_class(ties.direction)
    earlier, later = ties.pass_number.T
    group = np.column_stack([earlier, ties.scanner[:, 1], moment, np.minimum(bins, 26 - bins)])
    cell = np.floor(ties.place[:, 0] / SURFACES.cell).astype(np.int64)
    chance = integer_hash(np.column_stack([cell, later]))
    return ties[first_of_groups(group, [ties.gps_time[:, 0], chance], number)]
