"""Coarse search for meters of misclosure between passes, without prior information."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from mlscorr.surfaces import SETTINGS as SURFACES
from mlscorr.surfaces import direction_class
from mlscorr.survey import TieFeatures
from mlscorr.ties.settings import SETTINGS


@dataclass(frozen=True)
class Votes:
    """Parallel planes of an interval of time and of earlier passes, n pairs.

    Parameters
    ----------
    arm : (n, 3) array
        From the middle of the interval to its planes. Units: m.
    normal : (n, 3) array
        Mean of both.
    misclosure : (n,) array
        Along the normal, earlier pass - interval. Units: m.
    """

    arm: np.ndarray
    normal: np.ndarray
    misclosure: np.ndarray


def coarse_correction(features: TieFeatures, radius: float) -> np.ndarray:
    """Correction that aligns each pass with earlier ones: a rigid motion of each interval of time.

    In an interval, all parallel planes within the radius vote for a shift along their normal. The
    shift with the most votes in each direction starts a motion (shift and small rotation) that is
    refined with ever narrower weights. The result is only a start for pair_features. The earliest
    pass is not moved, nor are the others along a direction that no plane constrains.

    Parameters
    ----------
    features : TieFeatures
    radius : float
        Search radius. Units: m.

    Returns
    -------
    correction : (n, 3) array
        Of each feature. Units: m.
    """
    correction = np.zeros((len(features), 3))
    is_plane = features.kind == "plane"
    order = np.argsort(features.pass_number, kind="stable")
    passes = np.split(order, np.flatnonzero(np.diff(features.pass_number[order])) + 1)
    low, high = np.empty((2, len(passes), 3))
    for number, rows in enumerate(passes):
        lowest, highest = _edges(features.centre[rows], np.hypot(radius, SURFACES.cell))
        near = ((low[:number] <= highest) & (high[:number] >= lowest)).all(axis=1)
        before = np.concatenate([order[:0], *(passes[i] for i in np.flatnonzero(near))])
        before = before[is_plane[before]]
        tree = cKDTree(features.centre[before] + correction[before])
        interval = np.floor(features.gps_time[rows] / SETTINGS.pause)
        times = []
        motions = []
        middles = []
        for part in np.unique(interval):
            inside = rows[(interval == part) & is_plane[rows]]
            votes = _votes(features, inside, before, tree, radius)
            if len(votes.misclosure) >= SURFACES.feature_points:
                times.append((part + 0.5) * SETTINGS.pause)
                motions.append(_motion(votes, radius))
                middles.append(features.centre[inside].mean(axis=0))
        if times:
            motion, middle = (
                np.column_stack(
                    [np.interp(features.gps_time[rows], times, c) for c in np.array(v).T]
                )
                for v in (motions, middles)
            )
            arm = features.centre[rows] - middle
            correction[rows] = motion[:, :3] + np.cross(motion[:, 3:], arm)
        low[number], high[number] = _edges(features.centre[rows] + correction[rows])
    return correction


def _edges(place, margin=0.0):
    """Lowest and highest coordinates (3,) of positions (n, 3), with a margin."""
    return place.min(axis=0, initial=np.inf) - margin, place.max(axis=0, initial=-np.inf) + margin


def _votes(features, inside, before, tree, radius):
    """Votes of planes (k,) with those before, whose positions the tree contains."""
    limit = np.hypot(radius, SURFACES.cell)
    count = min(4 * SETTINGS.neighbours, len(before))
    if count == 0 or len(inside) == 0:
        return Votes(np.empty((0, 3)), np.empty((0, 3)), np.empty(0))
    _, near = tree.query(features.centre[inside], range(1, count + 1), distance_upper_bound=limit)
    row, column = np.nonzero(near < len(before))
    near = near[row, column]
    row = inside[row]
    first = features.direction[row]
    second = features.direction[before[near]]
    parallel = np.einsum("ni,ni->n", first, second) >= np.cos(SETTINGS.parallel)
    near = near[parallel]
    row = row[parallel]
    normal = (first + second)[parallel]
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    difference = tree.data[near] - features.centre[row]
    misclosure = np.einsum("ni,ni->n", normal, difference)
    is_near = np.linalg.norm(difference - misclosure[:, None] * normal, axis=1) <= SURFACES.cell
    arm = features.centre[row] - features.centre[inside].mean(axis=0)
    return Votes(arm[is_near], normal[is_near], misclosure[is_near])


def _motion(votes, radius):
    """Shift and rotation (6,), m and rad, with the most votes."""
    design = np.column_stack([votes.normal, np.cross(votes.arm, votes.normal)])
    prior = np.repeat([radius, SETTINGS.parallel], 3) ** -2.0
    motion = np.append(_most_votes(votes, radius), np.zeros(3))
    width = radius / 2
    while width > SURFACES.roughest:
        for _ in range(3):
            left = votes.misclosure - design @ motion
            weight = width**2 / (width**2 + left**2) ** 2  # Geman-McClure
            normal = (design.T * weight) @ design + np.diag(prior)
            motion = np.linalg.solve(normal, design.T @ (weight * votes.misclosure))
        width /= 2
    return motion


def _most_votes(votes, radius):
    """Shift (3,) from the fullest bin of misclosures in each class of directions. Units: m."""
    bins = direction_class(votes.normal)
    opposite = bins > 13  # folded: walls on the left and on the right vote together
    bins = np.where(opposite, 26 - bins, bins)
    sign = np.where(opposite, -1.0, 1.0)
    total = 1e-6 * np.eye(3)
    right = np.zeros(3)
    width = 2 * SURFACES.roughest
    for number in np.unique(bins):
        misclosure = (votes.misclosure * sign)[bins == number]
        edges = np.arange(-radius - width, radius + 2 * width, width)
        count = np.convolve(np.histogram(misclosure, edges)[0], [1, 2, 1], "same")
        best = edges[np.argmax(count)] + width / 2
        weight = float(count.max() - np.median(count))
        normal = (votes.normal * sign[:, None])[bins == number].mean(axis=0)
        total += weight * np.outer(normal, normal)
        right += weight * best * normal
    return np.linalg.solve(total, right)
