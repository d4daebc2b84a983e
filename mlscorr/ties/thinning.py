"""Choices of ties, as many in each second and direction, and of features in some blocks."""

import numpy as np

from mlscorr.surfaces import SETTINGS as SURFACES
from mlscorr.surfaces import direction_class, first_of_groups, integer_hash
from mlscorr.survey import TieFeatures, Ties
from mlscorr.ties.settings import SETTINGS


def some_blocks(features: TieFeatures, number: int) -> TieFeatures:
    """About a number of features: all of some blocks of space, the same blocks in every pass.

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
    moment = np.floor(ties.gps_time[:, 0] / SURFACES.moment).astype(np.int64)
    bins = direction_class(ties.direction)
    earlier, later = ties.pass_number.T
    group = np.column_stack([earlier, ties.scanner[:, 1], moment, np.minimum(bins, 26 - bins)])
    cell = np.floor(ties.place[:, 0] / SURFACES.cell).astype(np.int64)
    chance = integer_hash(np.column_stack([cell, later]))
    return ties[first_of_groups(group, [ties.gps_time[:, 0], chance], number)]
