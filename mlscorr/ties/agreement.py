"""Agreement of ties with their neighbors, their weights in time, and the directions they constrain.

Also gates: the largest distance of two views of a feature, from stated sigmas, then from residuals.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np
from scipy.spatial import cKDTree

from mlscorr.correction import Correction, PointSigma
from mlscorr.surfaces import SETTINGS as SURFACES
from mlscorr.survey import Survey, TieFeatures, Ties
from mlscorr.ties.settings import SETTINGS

NORMAL_SCATTER = 1.4826  # sigma of a normal distribution over its median absolute deviation


def residuals(ties: Ties, correction: np.ndarray) -> np.ndarray:
    """Residuals (n,) of the misclosures after a correction. Units: m.

    Parameters
    ----------
    ties : Ties
    correction : (m, 3) array
        Of all features; see pair_features. Units: m.
    """
    change = correction[ties.feature[:, 0]] - correction[ties.feature[:, 1]]
    return ties.misclosure - np.einsum("ni,ni->n", ties.direction, change)


def consistent_ties(ties: Ties, correction: np.ndarray) -> np.ndarray:
    """Flag (n,) of ties that agree with nearly parallel ties close to them at both times.

    A tie is refused if it differs from the median of its neighbors by more than gate_sigmas of
    their scatter and its own noise, such as a parked car or another wall. With fewer than five
    neighbors, none is refused.

    Parameters
    ----------
    ties : Ties
    correction : (m, 3) array
        Of all features; the residuals vary less from tie to tie. Units: m.

    Returns
    -------
    (n,) bool array
    """
    if len(ties) == 0:
        return np.zeros(0, bool)
    order = np.argsort(ties.gps_time[:, 0])  # so that neighbors are adjacent in memory, too
    left = residuals(ties, correction)[order]
    variance = ties.variance[order]
    # opposite directions are the same, with the other sign; pairs of passes are separated in time
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
    votes[rows == np.arange(len(ties))[:, None]] = np.nan  # its own vote
    judged = np.isfinite(votes).sum(axis=1) >= 5
    agree = np.ones(len(ties), bool)
    middle = np.nanmedian(votes[judged], axis=1)
    scatter = NORMAL_SCATTER * np.nanmedian(np.abs(votes[judged] - middle[:, None]), axis=1)
    limit = SETTINGS.gate_sigmas * np.sqrt(scatter**2 + variance[judged])
    agree[order[judged]] = np.abs(left[judged] - middle) <= limit
    return agree


def information(ties: Ties, group: np.ndarray) -> np.ndarray:
    """Information matrices of groups of ties (g, 3, 3): sum of n n' / variance. Units: 1/m^2.

    The eigenvectors are the directions in which the ties of a group constrain a shift between both
    times, and the smallest eigenvalue belongs to the weakest.

    Parameters
    ----------
    ties : Ties
    group : (n,) int array
        Index of each tie's group, from 0.
    """
    total = np.zeros((group.max(initial=-1) + 1, 3, 3))
    rows = ties.direction / ties.sigma[:, None]
    np.add.at(total, group, rows[:, :, None] * rows[:, None, :])
    return total


def unconstrained_directions(ties: Ties) -> Iterator[tuple[Ties, np.ndarray]]:
    """Yield the ties of each two passes that leave a shift along an axis (3,) open, with it.

    Intervals of time are judged separately, and reported if they are more than half of all. Drift
    changes between intervals, so a single wall across the path constrains only its own interval,
    and a bend in the path does not replace such a wall. In a tunnel, normals are perpendicular to
    the path except for noise, so only those count that deviate by more than two parallel normals
    may differ.

    Parameters
    ----------
    ties : Ties
    """
    ties = ties[np.lexsort(ties.pass_number.T[::-1])]
    interval = group_by_time(ties, 0, SETTINGS.pause)
    axis = np.linalg.eigh(information(ties, interval))[1][interval, :, 0]
    along = np.einsum("ni,ni->n", ties.direction, axis)
    along = np.where(np.abs(along) > np.sin(SETTINGS.parallel), along, 0.0)
    constraint = np.bincount(interval, along**2 / ties.variance) * SETTINGS.least_gate**2
    begins = np.flatnonzero(np.diff(ties.pass_number, axis=0, prepend=-1).any(axis=1))
    for begin, end in pairwise([*begins, len(ties)]):
        is_unconstrained = constraint[interval[begin:end]] < 1.0
        if np.median(constraint[np.unique(interval[begin:end])]) < 1.0:
            part = ties[begin:end][is_unconstrained]
            yield part, np.linalg.eigh(information(part, np.zeros(len(part), int))[0])[1][:, 0]


def unconstrained_sentence(ties: Ties, axis: np.ndarray) -> str:
    """Return a sentence on two passes with an axis (3,) that their ties do not constrain.

    Parameters
    ----------
    ties : Ties
        Ties of the two passes.
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
    """Increase variances of ties so that together, the ties of a second are no better than a limit.

    Errors shared by thousands of ties, from roughness or scanner angles, are not part of the
    variance of a single tie. As independent rows, ties would outweigh control. If many constrain a
    direction, each counts less; a direction with few ties keeps its weight.

    Parameters
    ----------
    ties : Ties
    """
    factor = np.ones(len(ties))
    for side in (0, 1):
        group = group_by_time(ties, side, SURFACES.moment)
        precision = information(ties, group)[group]
        precision = np.einsum("ni,nij,nj->n", ties.direction, precision, ties.direction)
        factor = np.maximum(factor, precision * SETTINGS.best_second**2)
    return replace(ties, variance=ties.variance * factor)


def group_by_time(ties: Ties, side: int, duration: float) -> np.ndarray:
    """Index (n,) of each tie's pair of passes and interval of time, from 0, in their order.

    Parameters
    ----------
    ties : Ties
    side : int
        Side whose time counts: 0 for the earlier view, 1 for the later.
    duration : float
        Of an interval. Units: s.
    """
    keys = np.column_stack([ties.pass_number, np.floor(ties.gps_time[:, side] / duration)])
    return np.unique(keys, axis=0, return_inverse=True)[1].ravel()


def placed_sigma(correction: Correction, survey: Survey, features: TieFeatures) -> np.ndarray:
    """One sigma (n,) of the positions of features along any axis, after a correction. Units: m.

    Parameters
    ----------
    correction : Correction
    survey : Survey
        With mountings and their covariances.
    features : TieFeatures
    """
    sigma = np.empty(len(features))
    for part, rows in survey.rows_by_scanner(features.scanner):
        of_part = PointSigma.of(correction, part.scanner, part.mounting)
        sigma[rows] = of_part.at(features.centre[rows], features.gps_time[rows]).max(axis=1)
    return sigma


def widest_gate(sigma: np.ndarray) -> float:
    """Largest distance of two features whose positions have sigmas (n,). Units: m.

    Parameters
    ----------
    sigma : (n,) array
        Units: m.
    """
    return float(np.sqrt(2) * SETTINGS.gate_sigmas * sigma.max(initial=0.0))


def narrowest_gate(ties: Ties, moved: np.ndarray) -> float:
    """Largest distance of two features, from the scatter of the residuals of ties. Units: m.

    Parameters
    ----------
    ties : Ties
    moved : (m, 3) array
        Correction of each feature. Units: m.
    """
    scatter = NORMAL_SCATTER * float(np.median(np.abs(residuals(ties, moved))))
    return SETTINGS.gate_sigmas * max(scatter, SETTINGS.best_second)
