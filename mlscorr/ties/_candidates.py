"""Which features of other visits are near enough to be the same thing."""

import numpy as np
from numba import njit

from mlscorr.survey import PAINTED, TIE_KINDS, TieFeatures
from mlscorr.ties._cells import CELL_BITS
from mlscorr.ties.settings import SETTINGS
from mlscorr.ties.thinning import kind_number

_, POLE, LINE, DASH = range(len(TIE_KINDS))


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
    limit = np.hypot(min(radius, 2 * sigmas * sigma.max(initial=0.0)), SETTINGS.cell)
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
        SETTINGS.cell,
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


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
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
