"""Which features of two visits are the same thing, given what is believed of their places."""

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from mlscorr.survey import PAINTED, TIE_KINDS, TieFeatures, Ties
from mlscorr.ties._candidates import candidate_pairs, visit_number
from mlscorr.ties.settings import SETTINGS
from mlscorr.ties.thinning import direction_class, integer_hash, kind_number


def pair_features(
    features: TieFeatures,
    correction: np.ndarray,
    sigma: np.ndarray,
    radius: float,
    turned: np.ndarray | None = None,
    pause: float = SETTINGS.pause,
) -> Ties:
    """Ties between features of two visits, or of two scanners that saw a thing on the same pass.

    A feature has at most one partner in each other pass of each scanner, one in its own at another
    visit, and one at this visit where that counts: the nearest whose direction is parallel, each
    the other's. Two passes have none in a direction in which more than half as many pair when they
    are displaced by two gates: those would be by chance; and paint has none where the next lane's
    is near enough to be taken for it.
    Call it again with a better correction, smaller sigma and radius.

    Parameters
    ----------
    features : TieFeatures
    correction : (n, 3) array
        What is believed to be missing at each feature: corrected = centre + correction. Units: m.
    sigma : (n,) array
        One sigma of the correction, along any direction. Units: m.
    radius : float
        Two features are no pair where they are farther apart than this, or than three sigmas of
        the correction's difference, and their own noise explains, along a plane's normal or across
        a pole. Units: m.
    turned : (n, 3) array, optional
        The features' directions as the correction turns them; as recorded by default.
    pause : float
        Between two views of one scanner; below that of two visits, those of one visit count.
        Units: s.

    Returns
    -------
    Ties
        Misclosures are of the recorded places, whatever the correction.
    """
    if turned is None:
        present = features
    else:
        present = replace(features, direction=turned)
    search = correction, sigma, radius, None, pause
    pairs = _mutual(present, *candidate_pairs(present, *search))
    pairs = pairs[_beyond_chance(present, search, pairs)]
    pairs = pairs[_is_unique(present, features.centre + correction, sigma)[pairs].all(axis=1)]
    direction = np.add(*_directions(present, pairs))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    apart = np.diff((features.centre + correction)[pairs], axis=1)[:, 0]
    along = np.einsum("ni,ni->n", apart, direction)
    is_pole = features.kind[pairs[:, 0]] == "pole"
    across = np.maximum((apart**2).sum(axis=1) - along**2, 0.0)
    lever = np.where(is_pole, along**2, across)
    # each direction is taken to the middle between both centres
    variance = features.variance[pairs].sum(axis=1) + lever * features.tilt[pairs].sum(axis=1) / 4
    variance += 2 * SETTINGS.surface_sigma**2
    sides = _across(direction[is_pole], _wall_normals(features, pairs, is_pole))
    return Ties.between(
        features,
        np.concatenate([pairs[~is_pole], *[pairs[is_pole]] * 2]),
        np.concatenate([direction[~is_pole], *sides]),
        np.concatenate([variance[~is_pole], *[variance[is_pole]] * 2]),
        correction,
    )


def _beyond_chance(features, search, pairs):
    """Which pairs (k,) are no chance for the most part, as are all of both passes and a direction.

    Chance is judged within gates as wide as sigmas make them, whatever the radius, and displaced by
    two of the widest near by, where no two views of one thing are a pair, however well the place of
    one of them is known: nearer, a rough surface pairs with itself. The correction chose the place
    where most agree: so of the displaced the fullest counts.
    """
    correction, sigma, radius, _, pause = search
    radius = max(radius, SETTINGS.least_gate)
    sigma = np.maximum(sigma, SETTINGS.roughest)
    widest = _largest_near(features.centre + correction, sigma, radius)
    variance = 2 * (widest**2 + features.variance + SETTINGS.surface_sigma**2)
    gate = np.minimum(radius, SETTINGS.gate_sigmas * np.sqrt(variance))
    way = features.direction.copy()
    is_pole = features.kind == "pole"
    way[is_pole] = _across(way[is_pole])[0]
    way *= 2 * gate[:, None]
    here, *displaced = (
        _mutual(features, *candidate_pairs(features, correction, sigma, radius, s, pause))
        for s in (None, way, -way)
    )
    is_chance = np.zeros(len(pairs), bool)
    for group in (_passes, _passes_and_direction):
        own, row = np.unique(group(features, pairs), return_inverse=True)
        number, *by_chance = (_count(own, group(features, each)) for each in (here, *displaced))
        for scattered in by_chance:
            # less what a count scatters by: three of four tell nothing
            is_chance |= (2 * (scattered - np.sqrt(scattered)) > number)[row]
    return ~is_chance


def _is_unique(features, place, sigma):
    """Whether nothing like a painted feature (n,) lies within two gates of it: lanes repeat.

    Gates are as wide as sigmas make them. Where they are wider than the least, two of them reach
    over the next lane, and no paint is unique.
    """
    width = 2 * np.sqrt(2) * SETTINGS.gate_sigmas * sigma
    is_painted = np.isin(features.kind, PAINTED)
    unique = ~is_painted | (width <= 2 * SETTINGS.least_gate)
    painted = np.flatnonzero(is_painted)
    edge = 2 * SETTINGS.least_gate + SETTINGS.cell
    # visits lie farther apart than any pair, as one more coordinate
    points = np.column_stack([place, 2 * edge * visit_number(features)])[painted]
    pairs = painted[cKDTree(points).query_pairs(edge, output_type="ndarray")]
    pairs = np.concatenate([pairs, pairs[:, ::-1]])
    apart = np.diff(place[pairs], axis=1)[:, 0]
    first, second = _directions(features, pairs)
    along = np.abs(np.einsum("ni,ni->n", apart, first))
    beside = np.sqrt(np.maximum((apart**2).sum(axis=1) - along**2, 0.0))
    like = (along > SETTINGS.widest_paint) & (along <= width[pairs[:, 0]])
    like &= (beside <= SETTINGS.cell) & (features.kind[pairs[:, 0]] == features.kind[pairs[:, 1]])
    like &= np.einsum("ni,ni->n", first, second) >= np.cos(SETTINGS.parallel)
    unique[pairs[like, 0]] = False
    return unique


def _largest_near(place, sigma, edge):
    """The largest sigma (n,) in each one's cell of an edge."""
    key = integer_hash(np.floor(place / edge).astype(np.int64))
    cell = np.unique(key, return_inverse=True)[1]
    largest = np.zeros(cell.max(initial=-1) + 1)
    np.maximum.at(largest, cell, sigma)
    return largest[cell]


def _passes(features, pairs):
    """Number (k,) of both passes of pairs; views of one visit count as another pass."""
    first = features.pass_number[pairs[:, 0]]
    return first * (features.pass_number.max(initial=0) + 1) + _partner_pass(features, *pairs.T)


def _partner_pass(features, own, partner):
    """Pass (k,) of partners; zero, which is none, where a scanner sees a thing again at a visit."""
    is_again = np.abs(features.gps_time[own] - features.gps_time[partner]) <= SETTINGS.pause
    is_again &= features.scanner[own] == features.scanner[partner]
    return np.where(is_again, 0, features.pass_number[partner])


def _passes_and_direction(features, pairs):
    """Number (k,) of both passes, the kind and the direction of pairs."""
    bins = direction_class(features.direction[pairs[:, 0]])
    kind = kind_number(features)[pairs[:, 0]]
    return (_passes(features, pairs) * 14 + np.minimum(bins, 26 - bins)) * len(TIE_KINDS) + kind


def _count(values, others):
    """How often each of some values (n,) is among others (m,)."""
    others = np.sort(others)
    return others.searchsorted(values, "right") - others.searchsorted(values, "left")


def _wall_normals(features, pairs, is_pole):
    """Normals (n, 3) of the walls that were seen next to the poles of pairs; north without any.

    Along a wall and across it poles tell things apart: what walls hold better is weighed down.
    """
    first = features[pairs[:, 0]]
    walls = first[(first.kind == "plane") & (np.abs(first.direction[:, 2]) < 0.5)]
    if len(walls) == 0:
        return np.array([0.0, 1.0, 0.0])
    nearest = cKDTree(walls.gps_time[:, None]).query(first.gps_time[is_pole, None])[1]
    return walls.direction[nearest]


def _across(axis, normal=(0.0, 1.0, 0.0)):
    """Two unit vectors (n, 3) across axes and each other, the first of them along walls."""
    side = np.cross(axis, normal)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    return side, np.cross(axis, side)


def _directions(features, pairs):
    """Directions (2, k, 3) of pairs, of paint those that point to the same side."""
    first, second = features.direction[pairs.T]
    is_opposite = np.isin(features.kind[pairs[:, 0]], PAINTED)
    is_opposite &= np.einsum("ni,ni->n", first, second) < 0
    return first, np.where(is_opposite[:, None], -second, second)


def _mutual(features, pairs, distance):
    """Pairs (k, 2) of which each is the other's nearest in its pass, and at its visit."""
    pairs = pairs[np.argsort(distance, kind="stable")]
    nearest = np.ones(len(pairs), bool)
    for feature, partner in (pairs.T, pairs.T[::-1]):
        passes = features.pass_number.max(initial=0) + 1
        key = feature * passes + _partner_pass(features, feature, partner)
        is_first = np.zeros(len(pairs), bool)
        is_first[np.unique(key, return_index=True)[1]] = True
        nearest &= is_first
    return pairs[nearest]
