"""Which features of two visits are the same thing, given what is believed of their places."""

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from mlscorr.compiled_loops import loop
from mlscorr.surfaces import SETTINGS as SURFACES
from mlscorr.surfaces import direction_class, integer_hash, kind_number
from mlscorr.survey import PAINTED, TIE_KINDS, TieFeatures, Ties
from mlscorr.ties.settings import SETTINGS

_, POLE, LINE, DASH = range(len(TIE_KINDS))
CELL_BITS = 21  # of a cell's number along one axis: a million to each side of the origin


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
    sigma = np.maximum(sigma, SURFACES.roughest)
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
    edge = 2 * SETTINGS.least_gate + SURFACES.cell
    # visits lie farther apart than any pair, as one more coordinate
    points = np.column_stack([place, 2 * edge * visit_number(features)])[painted]
    pairs = painted[cKDTree(points).query_pairs(edge, output_type="ndarray")]
    pairs = np.concatenate([pairs, pairs[:, ::-1]])
    apart = np.diff(place[pairs], axis=1)[:, 0]
    first, second = _directions(features, pairs)
    along = np.abs(np.einsum("ni,ni->n", apart, first))
    beside = np.sqrt(np.maximum((apart**2).sum(axis=1) - along**2, 0.0))
    like = (along > SURFACES.widest_paint) & (along <= width[pairs[:, 0]])
    like &= (beside <= SURFACES.cell) & (features.kind[pairs[:, 0]] == features.kind[pairs[:, 1]])
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


def candidate_pairs(
    features: TieFeatures,
    correction: np.ndarray,
    sigma: np.ndarray,
    radius: float,
    shift: np.ndarray | None = None,
    pause: float = SETTINGS.pause,
    angle: float = SETTINGS.parallel,
) -> tuple[np.ndarray, np.ndarray]:
    """Pairs (k, 2) of parallel features within their gates, and distances (k,) in such units.

    The earlier visit's stands first. Of each visit some nearest count, of either view.

    Parameters
    ----------
    features, correction, sigma, radius, pause
        As of pair_features.
    shift : (n, 3) array, optional
        By which the later of two visits is displaced. Units: m.
    angle : float
        Largest between directions: twice a boresight error and more, at first. Units: rad.
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
    # directions that differ by the angle are as far apart as places may be; no pole is near a plane
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
    """Number (n,) of the visit: a stretch of time of a pass, so that a loop counts as another.

    Parameters
    ----------
    features : TieFeatures
    """
    stretch = np.floor(features.gps_time / SETTINGS.pause).astype(np.int64)
    stretch -= stretch.min(initial=0)
    key = features.pass_number * (stretch.max(initial=0) + 1) + stretch
    return np.unique(key, return_inverse=True)[1]


def _attitude(features):
    """Vectors (n, 3) that are near each other for parallel features of a kind: their directions.

    Paint has neither front nor back: half of the unit vector of twice its azimuth stands for it.
    """
    attitude = features.direction.copy()
    is_painted = np.isin(features.kind, PAINTED)
    east, north, _ = attitude[is_painted].T
    attitude[is_painted, :2] = np.column_stack([east**2 - north**2, 2 * east * north]) / 2
    return attitude + 4.0 * kind_number(features)[:, None]


@loop
def _pairs_near(cells, edge, visit, number, side, views, limits):
    """Pairs within the limits, each as first * n + second, and their distances.

    Views come in the order of the cells of an edge. Of each visit those of a number count that are
    nearest to a view: of visits before where it is displaced to the side 1, of visits after where
    to the side -1, else of all others; of its own visit in each case, beyond the pause.
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
    """Distance of a pair of features in units of gate and cell; infinite if it is none."""
    points, shift, direction, kinds, gps_time, scanner, extent, noise, variances = views
    radius, least_cosine, pause, edge, sigmas, surface_variance = limits
    seconds = abs(gps_time[first] - gps_time[second])
    # a pass starts with each file too: tiles of one scanner see the street at one visit
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
        way = points[second, axis] - points[first, axis] + shift[second, axis]
        along += way * (mean / length)
        square += way**2
    along = abs(along)
    across = np.sqrt(max(square - along**2, 0.0))
    misfit, beside = (across, along) if kind == POLE else (along, across)
    known = variances[first] + variances[second]
    own = noise[first] + noise[second] + surface_variance
    gate = min(radius, sigmas * np.sqrt(known + own))
    if kind == POLE:  # however well places are known, what poles leave open doesn't shrink
        gate = np.hypot(min(radius, sigmas * np.sqrt(known)), sigmas * np.sqrt(own))
    # a dash as long as the other, to twice the sigma of its middle: else one was hidden in part
    longer = np.sqrt(12.0) * abs(extent[first] - extent[second])
    sigma = 2.0 * np.sqrt(noise[first] + noise[second])
    unlike = kind == DASH and longer > sigmas * sigma
    if unlike or misfit > gate or beside > edge:
        return np.inf
    return np.hypot(misfit / gate, beside / edge)
