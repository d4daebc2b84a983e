"""Pairing of features of two visits, given the prior uncertainty of their positions."""

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from mlscorr.compiled_loops import loop
from mlscorr.surfaces import SETTINGS as SURFACES
from mlscorr.surfaces import direction_class, integer_hash, kind_number
from mlscorr.survey import PAINTED, TIE_KINDS, TieFeatures, Ties
from mlscorr.ties.settings import SETTINGS

_, POLE, LINE, DASH = range(len(TIE_KINDS))
CELL_BITS = 21  # bits of a cell's index along one axis: a million to each side of the origin


def pair_features(
    features: TieFeatures,
    correction: np.ndarray,
    sigma: np.ndarray,
    radius: float,
    turned: np.ndarray | None = None,
    pause: float = SETTINGS.pause,
) -> Ties:
    """Make ties between features of two visits, or of two scanners in the same pass.

    A feature has at most one partner in each other pass of each scanner, one at another visit of
    its own pass, and one at the same visit if those are allowed. Partners are mutual nearest
    neighbors with parallel directions. Two passes get no ties in a direction in which a
    displacement by two gates gives more than half as many pairs, because the pairs may then be due
    to chance. Paint gets none if the paint of the next lane is close enough to be confused with it.
    Call the function again with a better correction and a smaller sigma and radius.

    Parameters
    ----------
    features : TieFeatures
    correction : (n, 3) array
        Assumed correction of each feature: corrected = center + correction. Units: m.
    sigma : (n,) array
        One sigma of the correction, along any direction. Units: m.
    radius : float
        Largest distance of a pair. The distance along a plane's normal or across a pole must also
        be within three sigmas of the correction's difference and of their own noise. Units: m.
    turned : (n, 3) array, optional
        The features' directions after the correction; as recorded by default.
    pause : float
        Smallest time between two views of one scanner; if shorter than between visits, views of one
        visit count, too. Units: s.

    Returns
    -------
    Ties
        Misclosures refer to the recorded positions, whatever the correction.
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
    difference = np.diff((features.centre + correction)[pairs], axis=1)[:, 0]
    along = np.einsum("ni,ni->n", difference, direction)
    is_pole = features.kind[pairs[:, 0]] == "pole"
    across = np.maximum((difference**2).sum(axis=1) - along**2, 0.0)
    lever = np.where(is_pole, along**2, across)
    # each direction is transferred to the middle between both centers
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
    """Flag (k,) of pairs mostly not due to chance, judged for each two passes and direction.

    Chance pairs are counted within the gates from sigmas, whatever the radius, after a displacement
    by two of the widest gates nearby. Two views of one feature are then never paired; with a
    smaller displacement, a rough surface would pair with itself. The correction is where most pairs
    agree, so the displacement with the most pairs counts.
    """
    correction, sigma, radius, _, pause = search
    radius = max(radius, SETTINGS.least_gate)
    sigma = np.maximum(sigma, SURFACES.roughest)
    widest = _largest_near(features.centre + correction, sigma, radius)
    variance = 2 * (widest**2 + features.variance + SETTINGS.surface_sigma**2)
    gate = np.minimum(radius, SETTINGS.gate_sigmas * np.sqrt(variance))
    displacement = features.direction.copy()
    is_pole = features.kind == "pole"
    displacement[is_pole] = _across(displacement[is_pole])[0]
    displacement *= 2 * gate[:, None]
    here, *displaced = (
        _mutual(features, *candidate_pairs(features, correction, sigma, radius, s, pause))
        for s in (None, displacement, -displacement)
    )
    is_chance = np.zeros(len(pairs), bool)
    for group in (_passes, _passes_and_direction):
        own, row = np.unique(group(features, pairs), return_inverse=True)
        number, *by_chance = (_count(own, group(features, each)) for each in (here, *displaced))
        for scattered in by_chance:
            # minus the scatter of a count: three of four prove nothing
            is_chance |= (2 * (scattered - np.sqrt(scattered)) > number)[row]
    return ~is_chance


def _is_unique(features, place, sigma):
    """Flag (n,) of painted features with no similar one within two gates, because lanes repeat.

    Gates follow from sigmas. If one is wider than the minimum, two gates reach over the next lane,
    and no paint is unique.
    """
    width = 2 * np.sqrt(2) * SETTINGS.gate_sigmas * sigma
    is_painted = np.isin(features.kind, PAINTED)
    unique = ~is_painted | (width <= 2 * SETTINGS.least_gate)
    painted = np.flatnonzero(is_painted)
    edge = 2 * SETTINGS.least_gate + SURFACES.cell
    # visits lie farther apart than any pair, as one more coordinate
    points = np.column_stack([place, 2 * edge * visit_number(features)])[painted]
    pairs = painted[cKDTree(points).query_pairs(edge, output_type="ndarray")]
    pairs = np.concatenate([pairs, pairs[:, ::-1]])
    difference = np.diff(place[pairs], axis=1)[:, 0]
    first, second = _directions(features, pairs)
    along = np.abs(np.einsum("ni,ni->n", difference, first))
    lateral_distance = np.sqrt(np.maximum((difference**2).sum(axis=1) - along**2, 0.0))
    like = (along > SURFACES.widest_paint) & (along <= width[pairs[:, 0]])
    like &= (lateral_distance <= SURFACES.cell) & (
        features.kind[pairs[:, 0]] == features.kind[pairs[:, 1]]
    )
    like &= np.einsum("ni,ni->n", first, second) >= np.cos(SETTINGS.parallel)
    unique[pairs[like, 0]] = False
    return unique


def _largest_near(place, sigma, edge):
    """Largest sigma (n,) in each feature's cell with a given edge."""
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
    """Pass (k,) of partners; zero, which means none, if a scanner measures a feature again at a
    visit.
    """
    is_again = np.abs(features.gps_time[own] - features.gps_time[partner]) <= SETTINGS.pause
    is_again &= features.scanner[own] == features.scanner[partner]
    return np.where(is_again, 0, features.pass_number[partner])


def _passes_and_direction(features, pairs):
    """Number (k,) of the two passes, the kind and the direction of pairs."""
    bins = direction_class(features.direction[pairs[:, 0]])
    kind = kind_number(features)[pairs[:, 0]]
    return (_passes(features, pairs) * 14 + np.minimum(bins, 26 - bins)) * len(TIE_KINDS) + kind


def _count(values, others):
    """Number of occurrences of some values (n,) among others (m,)."""
    others = np.sort(others)
    return others.searchsorted(values, "right") - others.searchsorted(values, "left")


def _wall_normals(features, pairs, is_pole):
    """Normals (n, 3) of the walls measured next to the poles of pairs; north without any.

    Poles are split along and across the wall, because the direction that walls constrain better is
    down-weighted.
    """
    first = features[pairs[:, 0]]
    walls = first[(first.kind == "plane") & (np.abs(first.direction[:, 2]) < 0.5)]
    if len(walls) == 0:
        return np.array([0.0, 1.0, 0.0])
    nearest = cKDTree(walls.gps_time[:, None]).query(first.gps_time[is_pole, None])[1]
    return walls.direction[nearest]


def _across(axis, normal=(0.0, 1.0, 0.0)):
    """Two perpendicular unit vectors (n, 3) across axes, the first of them along walls."""
    side = np.cross(axis, normal)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    return side, np.cross(axis, side)


def _directions(features, pairs):
    """Directions (2, k, 3) of pairs; those of paint point to the same side."""
    first, second = features.direction[pairs.T]
    is_opposite = np.isin(features.kind[pairs[:, 0]], PAINTED)
    is_opposite &= np.einsum("ni,ni->n", first, second) < 0
    return first, np.where(is_opposite[:, None], -second, second)


def _mutual(features, pairs, distance):
    """Pairs (k, 2) of mutual nearest neighbors in their passes and at their visits."""
    pairs = pairs[np.argsort(distance, kind="stable")]
    nearest = np.ones(len(pairs), bool)
    for feature, partner in (pairs.T, pairs.T[::-1]):
        passes = features.pass_number.max(initial=0) + 1
        key = feature * passes + _partner_pass(features, feature, partner)
        is_first = np.zeros(len(pairs), bool)
        is_first[np.unique(key, return_index=True)[1]] = True
        nearest &= is_first
    return pairs[nearest]


def candidate_pairs(
    features: TieFeatures,
    correction: np.ndarray,
    sigma: np.ndarray,
    radius: float,
    shift: np.ndarray | None = None,
    pause: float = SETTINGS.pause,
    angle: float = SETTINGS.parallel,
) -> tuple[np.ndarray, np.ndarray]:
    """Pairs (k, 2) of parallel features within their gates, and distances (k,) in gates.

    The feature of the earlier visit comes first. From each visit, some nearest neighbors of either
    view are considered.

    Parameters
    ----------
    features, correction, sigma, radius, pause
        See pair_features.
    shift : (n, 3) array, optional
        Displacement of the later of two visits. Units: m.
    angle : float
        Largest angle between directions: at first, more than twice a boresight error. Units: rad.
    """
    place = features.centre + correction
    sigmas = SETTINGS.gate_sigmas
    noise = features.variance.max(initial=0.0)
    limit = np.hypot(min(radius, 2 * sigmas * sigma.max(initial=0.0)), SURFACES.cell)
    limit = np.hypot(limit, sigmas * np.sqrt(2 * (noise + SETTINGS.surface_sigma**2)))
    edge = np.sqrt(2) * limit
    cell = np.floor(place[:, :2] / edge) @ [1 << CELL_BITS, 1]
    order = np.argsort(cell, kind="stable")
    features = features[order]
    place = place[order]
    sigma = sigma[order]
    # directions that differ by the angle are scaled to the largest distance; no pole is near a
    # plane
    attitude = limit / (2 * np.sin(angle / 2)) * _attitude(features)
    points = np.column_stack([place, attitude])
    if shift is None:
        displaced = np.zeros_like(place)
    else:
        displaced = shift[order]
    views = (
        points,
        displaced,
        features.direction,
        kind_number(features),
        features.gps_time,
        features.scanner,
        features.extent,
        features.variance,
        sigma**2,
    )
    limits = (
        float(radius),
        np.cos(angle),
        pause,
        SURFACES.cell,
        SETTINGS.gate_sigmas,
        2 * SETTINGS.surface_sigma**2,
    )
    grid = cell[order], edge, visit_number(features), SETTINGS.neighbours
    sides = [0.0] if shift is None else [1.0, -1.0]
    parts = [_pairs_near(*grid, side, views, limits) for side in sides]
    pairs, distance = map(np.concatenate, zip(*parts, strict=True))
    pairs = order[np.column_stack(np.divmod(pairs, len(order)))]
    number = pairs @ [len(order), 1]
    rows = np.argsort(number)
    rows = rows[np.diff(number[rows], prepend=-1) > 0]
    return pairs[rows], distance[rows]


def visit_number(features: TieFeatures) -> np.ndarray:
    """Index (n,) of the visit, an interval of time within a pass, so that a loop is another visit.

    Parameters
    ----------
    features : TieFeatures
    """
    interval = np.floor(features.gps_time / SETTINGS.pause).astype(np.int64)
    interval -= interval.min(initial=0)
    key = features.pass_number * (interval.max(initial=0) + 1) + interval
    return np.unique(key, return_inverse=True)[1]


def _attitude(features):
    """Vectors (n, 3) that are close for parallel features of a kind: their directions.

    Paint has neither front nor back, and is represented by half of the unit vector of twice its
    azimuth.
    """
    attitude = features.direction.copy()
    is_painted = np.isin(features.kind, PAINTED)
    east, north, _ = attitude[is_painted].T
    attitude[is_painted, :2] = np.column_stack([east**2 - north**2, 2 * east * north]) / 2
    return attitude + 4.0 * kind_number(features)[:, None]


@loop
def _pairs_near(cells, edge, visit, number, side, views, limits):
    """Pairs within the limits, each as first * n + second, and their distances.

    Views are sorted by cells. From each visit, a given number of nearest views count: from earlier
    visits if the displacement has side 1, from later visits if -1, otherwise from all others. Views
    of the same visit always count, beyond the pause.
    """
    points = views[0]
    shift = views[1]
    gps_time = views[4]
    pause = limits[2]
    count = len(points)
    columns = float(1 << CELL_BITS)
    near = np.empty(count, np.int64)
    square = np.empty(count)
    rank = np.zeros(count, np.int64)
    pairs = []
    distances = []
    for row in range(count):
        point = points[row].copy()
        size = 0
        point[:3] += side * shift[row]
        for line in (-1.0, 0.0, 1.0):
            cell = (np.floor(point[0] / edge) + line) * columns + np.floor(point[1] / edge)
            end = np.searchsorted(cells, cell + 1.0, "right")
            for i in range(np.searchsorted(cells, cell - 1.0), end):
                later = visit[i] - visit[row]
                total = 0.0
                if later == 0 and abs(gps_time[i] - gps_time[row]) <= pause:
                    continue
                for axis in range(point.size):
                    total += (points[i, axis] - point[axis]) ** 2
                if total < edge**2 and later * side <= 0:
                    near[size] = i
                    square[size] = total
                    size += 1
        for i in near[np.argsort(square[:size])]:
            rank[visit[i]] += 1
            if rank[visit[i]] <= number:
                is_before = visit[i] < visit[row]
                is_before |= visit[i] == visit[row] and gps_time[i] < gps_time[row]
                first, second = (i, row) if is_before else (row, i)
                distance = _distance(views, first, second, limits)
                if distance < np.inf:
                    pairs.append(first * count + second)
                    distances.append(distance)
        rank[visit[near[:size]]] = 0
    return np.array(pairs), np.array(distances)


@loop
def _distance(views, first, second, limits):
    """Distance of a pair of features in units of gate and cell; infinite if it is not a pair."""
    points, shift, direction, kinds, gps_time, scanner, extent, noise, variances = views
    radius, least_cosine, pause, edge, sigmas, surface_variance = limits
    seconds = abs(gps_time[first] - gps_time[second])
    # a pass also starts with each file: tiles of one scanner belong to one visit
    is_pair = seconds > pause or scanner[first] != scanner[second]
    kind = kinds[first]
    sign = 1.0
    cosine = 0.0
    for axis in range(3):
        cosine += direction[first, axis] * direction[second, axis]
    if kind >= LINE and cosine < 0.0:  # paint has no front
        sign = -1.0
        cosine = -cosine
    if not is_pair or kind != kinds[second] or cosine < least_cosine:
        return np.inf
    length = along = square = 0.0
    for axis in range(3):
        length += (direction[first, axis] + sign * direction[second, axis]) ** 2
    length = np.sqrt(length)
    for axis in range(3):
        mean = direction[first, axis] + sign * direction[second, axis]
        difference = points[second, axis] - points[first, axis] + shift[second, axis]
        along += difference * (mean / length)
        square += difference**2
    along = abs(along)
    across = np.sqrt(max(square - along**2, 0.0))
    misclosure, lateral = (across, along) if kind == POLE else (along, across)
    known = variances[first] + variances[second]
    own = noise[first] + noise[second] + surface_variance
    gate = min(radius, sigmas * np.sqrt(known + own))
    if kind == POLE:  # the uncertainty of poles does not decrease with better positions
        gate = np.hypot(min(radius, sigmas * np.sqrt(known)), sigmas * np.sqrt(own))
    # dashes of equal length, to twice the sigma of the middle; otherwise one was partly hidden
    longer = np.sqrt(12.0) * abs(extent[first] - extent[second])
    sigma = 2.0 * np.sqrt(noise[first] + noise[second])
    unlike = kind == DASH and longer > sigmas * sigma
    if unlike or misclosure > gate or lateral > edge:
        return np.inf
    return np.hypot(misclosure / gate, lateral / edge)
