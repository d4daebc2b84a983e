"""Ties that agree with their neighbours, how much a second of them is believed, what they hold.

And their gates: the distance of two views of one thing, by stated sigmas, then by residuals.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np
from scipy.spatial import cKDTree

from mlscorr.correction import Correction, PointSigma
from mlscorr.survey import Survey, TieFeatures, Ties
from mlscorr.ties.settings import SETTINGS

NORMAL_SCATTER = 1.4826  # a normal distribution's sigma over its median absolute deviation


def residuals(ties: Ties, correction: np.ndarray) -> np.ndarray:
    """What a correction leaves of the misclosures (n,). Units: m.

    Parameters
    ----------
    ties : Ties
    correction : (m, 3) array
        Of all features, as pair_features takes it. Units: m.
    """
    change = correction[ties.feature[:, 0]] - correction[ties.feature[:, 1]]
    return ties.misclosure - np.einsum("ni,ni->n", ties.direction, change)


def consistent_ties(ties: Ties, correction: np.ndarray) -> np.ndarray:
    """Which ties agree with those near them in both times whose direction is about parallel.

    A tie is refused that lies farther from the median of its neighbours than gate_sigmas of their
    scatter and its own noise: a car that left, another wall. Where fewer than five are near, none
    can be refused.

    Parameters
    ----------
    ties : Ties
    correction : (m, 3) array
        Of all features; what it leaves varies less from tie to tie. Units: m.

    Returns
    -------
    (n,) bool array
    """
    if len(ties) == 0:
        return np.zeros(0, bool)
    order = np.argsort(ties.gps_time[:, 0])  # whose neighbours lie side by side in memory too
    left = residuals(ties, correction)[order]
    variance = ties.variance[order]
    # a direction and its opposite are the same, with the other sign; pass pairs are apart in time
    points = np.column_stack([ties.gps_time / SETTINGS.agreement_interval, 2 * ties.direction])[
        order
    ]
    opposite = points * np.repeat([1.0, -1.0], [2, 3])
    values = np.append(np.append(left, -left), np.nan)
    count = min(SETTINGS.neighbours + 1, 2 * len(ties))
    _, rows = cKDTree(np.concatenate([points, opposite]), balanced_tree=False).query(
        points, range(1, count + 1), distance_upper_bound=1.0
    )
    votes = values[rows]
    votes[rows == np.arange(len(ties))[:, None]] = np.nan  # its own
    judged = np.isfinite(votes).sum(axis=1) >= 5
    agree = np.ones(len(ties), bool)
    middle = np.nanmedian(votes[judged], axis=1)
    scatter = NORMAL_SCATTER * np.nanmedian(np.abs(votes[judged] - middle[:, None]), axis=1)
    limit = SETTINGS.gate_sigmas * np.sqrt(scatter**2 + variance[judged])
    agree[order[judged]] = np.abs(left[judged] - middle) <= limit
    return agree


def information(ties: Ties, group: np.ndarray) -> np.ndarray:
    """Information sum of n n' / variance of groups of ties (g, 3, 3). Units: 1/m^2.

    Its eigenvectors are the directions in which the ties of a group hold a shift between both
    times; the weakest is what they hold least.

    Parameters
    ----------
    ties : Ties
    group : (n,) int array
        Number of each tie's group, from 0.
    """
    total = np.zeros((group.max(initial=-1) + 1, 3, 3))
    rows = ties.direction / ties.sigma[:, None]
    np.add.at(total, group, rows[:, :, None] * rows[:, None, :])
    return total


def unheld_directions(ties: Ties) -> Iterator[tuple[Ties, np.ndarray]]:
    """The ties of each two passes that hold no shift between them along an axis, and it (3,).

    Those of whole stretches, where these are more than half of all: drift changes from one to the
    next, so that a single wall across the way holds the one where it stands, and a bend is no wall
    across. In a tunnel normals stand across the way but for their noise, which seems to hold it:
    only those count that lean by more than two parallel ones may differ.

    Parameters
    ----------
    ties : Ties
    """
    ties = ties[np.lexsort(ties.pass_number.T[::-1])]
    stretch = group_by_time(ties, 0, SETTINGS.pause)
    axis = np.linalg.eigh(information(ties, stretch))[1][stretch, :, 0]
    along = np.einsum("ni,ni->n", ties.direction, axis)
    along = np.where(np.abs(along) > np.sin(SETTINGS.parallel), along, 0.0)
    held = np.bincount(stretch, along**2 / ties.variance) * SETTINGS.least_gate**2
    begins = np.flatnonzero(np.diff(ties.pass_number, axis=0, prepend=-1).any(axis=1))
    for begin, end in pairwise([*begins, len(ties)]):
        is_unheld = held[stretch[begin:end]] < 1.0
        if np.median(held[np.unique(stretch[begin:end])]) < 1.0:
            part = ties[begin:end][is_unheld]
            yield part, np.linalg.eigh(information(part, np.zeros(len(part), int))[0])[1][:, 0]


def unheld_sentence(ties: Ties, axis: np.ndarray) -> str:
    """A sentence on two passes whose ties leave an axis (3,) unheld.

    Parameters
    ----------
    ties : Ties
        Of two passes, those that leave it.
    axis : (3,) array
        Unit vector.
    """
    first, second = ties.pass_number[0]
    words = ", ".join(f"{value:.2f}" for value in axis + 0.0)
    return (
        f"Along most of the overlap of passes {first} and {second}, {len(ties)} ties leave the "
        f"direction E, N, H = {words} unconstrained: all walls are parallel there, as in a "
        "tunnel. Only control in both passes, or poles and walls across the road, constrain it."
    )


def weigh_by_time(ties: Ties) -> Ties:
    """Ties with variances so large that those of a second are together no better than a sigma.

    What thousands of them share, roughness or angles of the scanner, is in no variance of a single
    tie: as independent rows they would outweigh control. Where many hold a direction, each of them
    counts the less; what few ties hold keeps its weight.

    Parameters
    ----------
    ties : Ties
    """
    factor = np.ones(len(ties))
    for side in (0, 1):
        group = group_by_time(ties, side, SETTINGS.moment)
        held = information(ties, group)[group]
        held = np.einsum("ni,nij,nj->n", ties.direction, held, ties.direction)
        factor = np.maximum(factor, held * SETTINGS.best_second**2)
    return replace(ties, variance=ties.variance * factor)


def group_by_time(ties: Ties, side: int, duration: float) -> np.ndarray:
    """Number (n,) of each tie's pair of passes and stretch of time, from 0, in their order.

    Parameters
    ----------
    ties : Ties
    side : int
        Whose time counts: 0 for the earlier view, 1 for the later.
    duration : float
        Of a stretch. Units: s.
    """
    keys = np.column_stack([ties.pass_number, np.floor(ties.gps_time[:, side] / duration)])
    return np.unique(keys, axis=0, return_inverse=True)[1].ravel()


def placed_sigma(correction: Correction, survey: Survey, features: TieFeatures) -> np.ndarray:
    """One sigma (n,) of the places of features along any axis, after a correction. Units: m.

    Parameters
    ----------
    correction : Correction
    survey : Survey
        Its mountings with the covariance of what is open in them.
    features : TieFeatures
    """
    sigma = np.empty(len(features))
    for part, rows in survey.rows_by_scanner(features.scanner):
        of_part = PointSigma.of(correction, part.scanner, part.mounting)
        sigma[rows] = of_part.at(features.centre[rows], features.gps_time[rows]).max(axis=1)
    return sigma


def widest_gate(sigma: np.ndarray) -> float:
    """Largest distance of two features whose places have sigmas (n,). Units: m.

    Parameters
    ----------
    sigma : (n,) array
        Units: m.
    """
    return float(np.sqrt(2) * SETTINGS.gate_sigmas * sigma.max(initial=0.0))


def narrowest_gate(ties: Ties, moved: np.ndarray) -> float:
    """Largest distance of two features by the scatter of residuals of ties. Units: m.

    Parameters
    ----------
    ties : Ties
    moved : (m, 3) array
        What the correction adds to each feature. Units: m.
    """
    scatter = NORMAL_SCATTER * float(np.median(np.abs(residuals(ties, moved))))
    return SETTINGS.gate_sigmas * max(scatter, SETTINGS.best_second)
