"""Which features of two visits are the same thing, given what is believed of their places."""

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from mlscorr.survey import PAINTED, TIE_KINDS, TieFeatures, Ties
from mlscorr.ties.settings import SETTINGS
from mlscorr.ties.thinning import direction_class, kind_number


def pair_features(
    features: TieFeatures,
    correction: np.ndarray,
    sigma: np.ndarray,
    radius: float,
    angle: float = SETTINGS.parallel,
    turned: np.ndarray | None = None,
) -> Ties:
    """Ties between features of two visits, or of two scanners that saw a thing on the same pass.

    A feature has at most one partner in each other pass of each scanner, and one in its own at
    another visit: the nearest whose direction is parallel, each the other's. Two passes have none
    in a direction in which more than half as many pair when they are displaced by two gates: those
    would be by chance; and paint has none where the next lane's is near enough to be taken for it.
    Call it again with a better correction, smaller sigma, radius and angle.

    Parameters
    ----------
    features : TieFeatures
    correction : (n, 3) array
        What is believed to be missing at each feature: corrected = centre + correction. Units: m.
    sigma : (n,) array
        One sigma of the correction, along any direction. Units: m.
    radius : float
        Two features are no pair where they are farther apart than this, or than three sigmas of
        the difference, along a plane's normal or across a pole. Units: m.
    angle : float
        Largest angle between directions: twice a boresight error and more, at first. Units: rad.

    turned : (n, 3) array, optional
        The features' directions as the correction turns them; as recorded by default.

    Returns
    -------
    Ties
        Misclosures are of the recorded places, whatever the correction.
    """
    present = features if turned is None else replace(features, direction=turned)
    pairs = _mutual(present, *candidate_pairs(present, correction, sigma, radius, angle))
    pairs = pairs[_beyond_chance(present, correction, sigma, radius, angle, pairs)]
    pairs = pairs[_is_unique(present, features.centre + correction, sigma)[pairs].all(axis=1)]
    direction = _common_direction(present, pairs)
    apart = np.diff((features.centre + correction)[pairs], axis=1)[:, 0]
    along = np.einsum("ni,ni->n", apart, direction)
    is_pole = features.kind[pairs[:, 0]] == "pole"
    across = np.maximum((apart**2).sum(axis=1) - along**2, 0.0)
    lever = np.where(is_pole, along**2, across)
    # each direction is taken to the middle between both centres
    variance = features.variance[pairs].sum(axis=1) + lever * features.tilt[pairs].sum(axis=1) / 4
    variance += 2 * SETTINGS.surface_sigma**2
    sides = _across(direction[is_pole])
    return Ties.between(
        features,
        np.concatenate([pairs[~is_pole], *[pairs[is_pole]] * 2]),
        np.concatenate([direction[~is_pole], *sides]),
        np.concatenate([variance[~is_pole], *[variance[is_pole]] * 2]),
        correction,
    )


def _beyond_chance(features, correction, sigma, radius, angle, pairs):
    """Which pairs (k,) are no chance for the most part, as are all of both passes and a direction.

    Chance is judged within gates as wide as sigmas make them, whatever the radius, and displaced by
    two of the widest near by, where no two views of one thing are a pair, however well the place of
    one of them is known: nearer, a rough surface pairs with itself. The correction chose the place
    where most agree: so of the displaced the fullest counts.
    """
    radius = max(radius, SETTINGS.least_gate)
    sigma = np.maximum(sigma, SETTINGS.roughest)
    widest = _largest_near(features.centre + correction, sigma, radius)
    variance = 2 * (widest**2 + features.variance + SETTINGS.surface_sigma**2)
    gate = np.minimum(radius, SETTINGS.gate_sigmas * np.sqrt(variance))
    way = features.direction.copy()
    is_pole = features.kind == "pole"
    way[is_pole] = _across(way[is_pole])[0]
    here, *displaced = (
        _mutual(features, *candidate_pairs(features, correction, sigma, radius, angle, shift))
        for shift in np.multiply.outer([0.0, 2.0, -2.0], gate[:, None] * way)
    )
    is_chance = np.zeros(len(pairs), bool)
    for group in (_passes, _passes_and_direction):
        own, number = group(features, pairs), group(features, here)
        for chance in displaced:
            scattered = _count(own, group(features, chance))
            # less what a count scatters by: three of four tell nothing
            is_chance |= 2 * (scattered - np.sqrt(scattered)) > _count(own, number)
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
    for rows in (painted[visit] for visit in _visits(features[is_painted])):
        pairs = cKDTree(place[rows]).query_pairs(
            2 * SETTINGS.least_gate + SETTINGS.cell, output_type="ndarray"
        )
        pairs = rows[np.concatenate([pairs, pairs[:, ::-1]])]
        apart = np.diff(place[pairs], axis=1)[:, 0]
        first, second = _directions(features, pairs)
        along = np.abs(np.einsum("ni,ni->n", apart, first))
        beside = np.sqrt(np.maximum((apart**2).sum(axis=1) - along**2, 0.0))
        like = (along > SETTINGS.widest_paint) & (along <= width[pairs[:, 0]])
        like &= (beside <= SETTINGS.cell) & (np.diff(kind_number(features)[pairs])[:, 0] == 0)
        like &= np.einsum("ni,ni->n", first, second) >= np.cos(SETTINGS.parallel)
        unique[pairs[like, 0]] = False
    return unique


def _largest_near(place, sigma, edge):
    """The largest sigma (n,) in each one's cell of an edge."""
    cell = np.unique(np.floor(place / edge), axis=0, return_inverse=True)[1].ravel()
    largest = np.zeros(cell.max(initial=-1) + 1)
    np.maximum.at(largest, cell, sigma)
    return largest[cell]


def _passes(features, pairs):
    """Number (k,) of both passes of pairs."""
    first, second = features.pass_number[pairs].T
    return first * (features.pass_number.max(initial=0) + 1) + second


def _passes_and_direction(features, pairs):
    """Number (k,) of both passes, the kind and the direction of pairs."""
    bins = direction_class(features.direction[pairs[:, 0]])
    kind = kind_number(features)[pairs[:, 0]]
    return (_passes(features, pairs) * 14 + np.minimum(bins, 26 - bins)) * len(TIE_KINDS) + kind


def _count(values, others):
    """How often each of some values (n,) is among others (m,)."""
    others = np.sort(others)
    return others.searchsorted(values, "right") - others.searchsorted(values, "left")


def _across(axis):
    """Two unit vectors (n, 3) across axes and each other, the first of them horizontal."""
    side = np.cross(axis, [0.0, 1.0, 0.0])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    return side, np.cross(axis, side)


def candidate_pairs(
    features: TieFeatures,
    correction: np.ndarray,
    sigma: np.ndarray,
    radius: float,
    angle: float = SETTINGS.parallel,
    shift: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Pairs (k, 2) of parallel features within their gates, and distances (k,) in such units.

    The earlier visit's stands first.

    Parameters
    ----------
    features, correction, sigma, radius, angle
        As of pair_features.
    shift : (n, 3) array, optional
        By which the later of two visits is displaced. Units: m.
    """
    place = features.centre + correction
    shift = np.zeros_like(place) if shift is None else shift
    visits = _visits(features)
    limit = np.hypot(min(radius, 2 * SETTINGS.gate_sigmas * sigma.max(initial=0.0)), SETTINGS.cell)
    # directions that differ by the angle are as far apart as places may be; no pole is near a plane
    weight = limit / (2 * np.sin(angle / 2))
    points = np.column_stack([place, weight * _attitude(features)])
    trees = [cKDTree(points[rows]) for rows in visits]
    low, high = (
        np.array([edge(place[rows], axis=0) for rows in visits]).reshape(-1, 3)
        for edge in (np.min, np.max)
    )
    farthest = limit + np.abs(shift).max(initial=0.0)
    parts = [np.empty((0, 2), int)]
    for i, tree in enumerate(trees):
        near = (low <= high[i] + farthest) & (high >= low[i] - farthest)
        for j in np.flatnonzero(near.all(axis=1)):
            if i != j:
                moved = points[visits[j]]
                moved[:, :3] += np.sign(j - i) * shift[visits[j]]
                _, nearest = tree.query(
                    moved, range(1, SETTINGS.neighbours + 1),
                    distance_upper_bound=np.sqrt(2) * limit,
                )  # fmt: skip
                first, column = np.nonzero(nearest < len(visits[i]))
                partner = visits[i][nearest[first, column]]
                pairs = np.column_stack([partner, visits[j][first]])
                parts.append(pairs if i < j else pairs[:, ::-1])
    number = np.sort(np.concatenate(parts) @ [len(features), 1])
    number = number[np.diff(number, prepend=-1) > 0]  # each once, sooner than by np.unique
    pairs = np.column_stack(np.divmod(number, len(features)))
    apart = np.diff(place[pairs], axis=1)[:, 0] + shift[pairs[:, 1]]
    distance = _distance(features, apart, sigma, radius, pairs)
    cosine = np.einsum("ni,ni->n", *_directions(features, pairs))
    kept = np.isfinite(distance) & (cosine >= np.cos(angle))
    return pairs[kept], distance[kept]


def _attitude(features):
    """Vectors (n, 3) that are near each other for parallel features of a kind: their directions.

    Paint has neither front nor back: half of the unit vector of twice its azimuth stands for it.
    """
    attitude = features.direction.copy()
    is_painted = np.isin(features.kind, PAINTED)
    east, north, _ = attitude[is_painted].T
    attitude[is_painted, :2] = np.column_stack([east**2 - north**2, 2 * east * north]) / 2
    return attitude + 4.0 * kind_number(features)[:, None]


def _directions(features, pairs):
    """Directions (2, k, 3) of pairs, of paint those that point to the same side."""
    first, second = features.direction[pairs.T]
    is_opposite = np.isin(features.kind[pairs[:, 0]], PAINTED)
    is_opposite &= np.einsum("ni,ni->n", first, second) < 0
    return first, np.where(is_opposite[:, None], -second, second)


def _common_direction(features, pairs):
    """Mean directions (k, 3) of pairs."""
    direction = np.add(*_directions(features, pairs))
    return direction / np.linalg.norm(direction, axis=1, keepdims=True)


def _visits(features):
    """Rows of each visit: a stretch of time of a pass, so that a loop counts as another visit."""
    stretch = np.floor(features.gps_time / SETTINGS.pause)
    keys = np.column_stack([features.pass_number, stretch])
    number = np.unique(keys, axis=0, return_inverse=True)[1].ravel()
    order = np.argsort(number, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(number[order])) + 1) if len(order) else []


def _distance(features, apart, sigma, radius, pairs):
    """Distances (k,) of pairs, ways (k, 3) apart, in units of gate and cell; infinite for none."""
    first, second = pairs.T
    axis = _common_direction(features, pairs)
    along = np.abs(np.einsum("ni,ni->n", apart, axis))
    across = np.sqrt(np.maximum((apart**2).sum(axis=1) - along**2, 0.0))
    is_pole = features.kind[first] == "pole"
    misfit, beside = np.where(is_pole, [across, along], [along, across])
    variance = (sigma**2 + features.variance)[pairs].sum(axis=1) + 2 * SETTINGS.surface_sigma**2
    gate = np.minimum(radius, SETTINGS.gate_sigmas * np.sqrt(variance))
    # a pass starts with each file too: tiles of one scanner see the street at one visit
    is_pair = np.abs(np.diff(features.gps_time[pairs])[:, 0]) > SETTINGS.pause
    is_pair |= features.scanner[first] != features.scanner[second]
    is_pair &= (features.kind[first] == features.kind[second]) & (misfit <= gate)
    is_pair &= beside <= SETTINGS.cell
    # a dash as long as the other, to twice the sigma of its middle: else one was hidden in part
    longer = np.sqrt(12) * np.abs(np.diff(features.extent[pairs])[:, 0])
    unlike = longer > SETTINGS.gate_sigmas * 2 * np.sqrt(features.variance[pairs].sum(axis=1))
    is_pair &= ~unlike | (features.kind[first] != "dash")
    return np.where(is_pair, np.hypot(misfit / gate, beside / SETTINGS.cell), np.inf)


def _mutual(features, pairs, distance):
    """Pairs (k, 2) of which each is the other's nearest in its pass."""
    pairs = pairs[np.argsort(distance, kind="stable")]
    nearest = np.ones(len(pairs), bool)
    for feature, partner in (pairs.T, pairs.T[::-1]):
        key = feature * (features.pass_number.max(initial=0) + 1) + features.pass_number[partner]
        is_first = np.zeros(len(pairs), bool)
        is_first[np.unique(key, return_index=True)[1]] = True
        nearest &= is_first
    return pairs[nearest]
