"""Flat pieces of the cloud: small in space and in time, each with the plane that fits it.

They are found while the cloud is streamed; of each patch only its moments and some points stay in
memory.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np
from numba import njit

from mlscorr.gap.residuals.rows import scanner_origin
from mlscorr.gap.residuals.settings import SETTINGS
from mlscorr.io.clouds import read_chunks
from mlscorr.survey import CloudFile, Columns, PointCloud, Survey
from mlscorr.targets import NO_POINTS, number_passes
from mlscorr.targets import SETTINGS as TARGETS
from mlscorr.ties import integer_hash


@dataclass(frozen=True, repr=False)
class Patches(Columns):
    """Flat pieces of the cloud, in no order.

    Parameters
    ----------
    pass_number : (p,) int array
    gps_time : (p,) array
        Mean of the points. Units: s.
    centre : (p, 3) array
        Mean of the points on the plane. Units: m.
    normal : (p, 3) array
        Towards the scanner.
    variance : (p,) array
        About the plane, with the plane's three parameters reckoned. Units: m^2.
    spread : (p,) array
        One sigma of the points along the plane's narrow direction. Units: m.
    ripple : (p,) array
        Variance about the plane over that between points which follow each other: about 1 for
        noise, more for what is curved.
    points : (p,) int array
        On the plane.
    fired, returned : (p,) int array
        Pulses between the first and the last return of each scan line on it; zeros where the time
        stamps have no regular step.
    block : (p,) array
        Random number from 0 to 1, the same for neighbours.
    xyz : (p, 12, 3), time, intensity : (p, 12) arrays
        Points of each patch, evenly taken in time.
    cloud : (p,) array of PointCloud
        Points on each plane in order of time, at most 400, for the simulator to fire again.
    """

    pass_number: np.ndarray
    gps_time: np.ndarray
    centre: np.ndarray
    normal: np.ndarray
    variance: np.ndarray
    spread: np.ndarray
    ripple: np.ndarray
    points: np.ndarray
    fired: np.ndarray
    returned: np.ndarray
    block: np.ndarray
    xyz: np.ndarray
    time: np.ndarray
    intensity: np.ndarray
    cloud: np.ndarray


def fit_patches(
    survey: Survey, cloud: PointCloud, number: np.ndarray, rows: np.ndarray
) -> Patches | None:
    """Patches of a pass in order of their place_key, without its number; None where there is none.

    Parameters
    ----------
    survey : Survey
    cloud : PointCloud
        n points.
    number : (n,) int array
        Of each in its file: points of numbers that follow each other were measured so.
    rows : (k,) int array
        Those to look at, of one pass.
    """
    key = place_key(cloud.xyz[rows], cloud.gps_time[rows])
    order = np.argsort(key, kind="stable")
    rows = rows[order]
    key = key[order]
    first = np.flatnonzero(np.append(True, key[1:] != key[:-1])[: len(key)])
    count = np.diff(np.append(first, len(rows)))
    keep = count >= SETTINGS.plane_points
    if not keep.any():
        return None
    return _fit(survey, cloud, number, rows[np.repeat(keep, count)], count[keep])


def block_chance(xyz: np.ndarray) -> np.ndarray:
    """A number from 0 to 1 (n,) for the block of the ground of points, the same in all clouds.

    Parameters
    ----------
    xyz : (n, 3) array
        Units: m.
    """
    cells = np.floor(_in_cells(xyz[:, :2]) / SETTINGS.block_cells)
    return chance(*cells.T.astype(np.int64))


def place_key(xyz: np.ndarray, gps_time: np.ndarray) -> np.ndarray:
    """A number for the cell and moment of points: those of one patch have the same.

    Parameters
    ----------
    xyz : (n, 3) array
        Units: m.
    gps_time : (n,) array
        Units: s.

    Returns
    -------
    (n,) uint64 array
    """
    cell = np.floor(_in_cells(xyz)).astype(np.int64)
    moment = np.floor(gps_time / SETTINGS.moment).astype(np.int64)
    return integer_hash(np.column_stack([cell, moment]))


def cell_corner(xyz: np.ndarray) -> np.ndarray:
    """The least corner (n, 3) of the cells of points. Units: m.

    Parameters
    ----------
    xyz : (n, 3) array
        Units: m.
    """
    return (np.floor(_in_cells(xyz)) - 1.0 / 3.0) * SETTINGS.cell


def _in_cells(xyz):
    """Places in edges of a cell, whose faces stand a third off the whole numbers: models have
    floors and walls there.
    """
    return xyz / SETTINGS.cell + 1.0 / 3.0


def _is_whole(centre, normal, variance):
    """Whether each plane (g,) shows all its noise: near a cell's face, along it, half is beyond."""
    inside = _in_cells(centre) % 1.0
    depth = SETTINGS.cell * np.minimum(inside, 1.0 - inside)
    return (depth > SETTINGS.trims[-1] * np.sqrt(variance)[:, None] * np.abs(normal)).all(axis=1)


def chance(*numbers: np.ndarray) -> np.ndarray:
    """A number from 0 to 1 (n,) that depends on integers (n,) alone."""
    return (integer_hash(np.column_stack(numbers)) >> np.uint64(11)) / float(1 << 53)


def _fit(survey, chunk, number, rows, count):
    """Planes through groups of points: rows (n,) of the chunk, count (g,) of each group."""
    first = np.cumsum(count) - count
    group = np.repeat(np.arange(len(count)), count)
    local = chunk.xyz[rows] - chunk.xyz[rows[first]][group]
    weight, (mean, values, normal) = _trimmed(local, first, group)
    held = np.add.reduceat(weight, first)
    variance = values[:, 0] * held / freedom(held)
    least = np.maximum(SETTINGS.plane_points, SETTINGS.rule * count)
    good = (held >= least) & (variance <= SETTINGS.roughest**2)
    good &= values[:, 1] >= SETTINGS.narrowest_patch**2
    good &= _is_whole(chunk.xyz[rows[first]] + mean, normal, variance)
    if not good.any():
        return None
    fired, returned = _misses(chunk.gps_time[rows], number[rows], first, group)
    away = _heights(local, mean, normal, group)
    sample = rows[_taken(weight > 0, first)[good]]
    begin = chunk.gps_time[rows[first]]
    time = np.add.reduceat(weight * (chunk.gps_time[rows] - begin[group]), first) / held
    normal = normal[good]
    slant = np.einsum("pi,pi->p", normal, _sight(survey, chunk, sample))
    normal *= np.sign(slant)[:, None]
    return Patches(
        pass_number=np.zeros(good.sum(), int),
        gps_time=(begin + time)[good],
        centre=chunk.xyz[rows[first]][good] + mean[good],
        normal=normal,
        variance=variance[good],
        spread=np.sqrt(values[good, 1]),
        ripple=(variance / _between(away, weight, first, group))[good],
        points=held[good].astype(int),
        fired=fired[good],
        returned=returned[good],
        block=block_chance(chunk.xyz[rows[first]][good]),
        xyz=chunk.xyz[sample],
        time=chunk.gps_time[sample],
        intensity=chunk.intensity[sample].astype(float),
        cloud=_on_planes(chunk, rows[np.repeat(good, count)], count[good], sample, normal),
    )[np.abs(slant) >= TARGETS.least_crossing_sine]


def _trimmed(local, first, group):
    """Which points (n,) lie on their group's plane, as weights, and the moments of these."""
    weight = np.ones(len(local))
    for trim in SETTINGS.trims:
        mean, values, normal = moments(local, weight, first)
        away = np.abs(_heights(local, mean, normal, group))
        held = np.add.reduceat(weight, first)
        sigma = np.sqrt(values[:, 0] * held / freedom(held))
        weight = (away <= trim * np.maximum(sigma, SETTINGS.file_step / 10)[group]).astype(float)
    return weight, moments(local, weight, first)


def _on_planes(chunk, rows, count, sample, normal):
    """PointCloud of the points on each plane (g,), of groups of rows (n,) with counts (g,)."""
    first = np.cumsum(count) - count
    group = np.repeat(np.arange(len(count)), count)
    origin = chunk.xyz[sample[:, 0]]
    height = _heights(chunk.xyz[rows], origin, normal, group)
    heights = np.einsum("gsi,gi->gs", chunk.xyz[sample] - origin[:, None], normal)
    middle = np.median(heights, axis=1)
    sigma = np.maximum(heights.std(axis=1), SETTINGS.file_step / 2)
    _narrow(height, first, middle, sigma, SETTINGS.trims[-1], SETTINGS.file_step / 2)
    on = np.flatnonzero(np.abs(height - middle[group]) <= SETTINGS.trims[-1] * sigma[group])
    on = on[np.lexsort((chunk.gps_time[rows[on]], group[on]))]
    clouds = np.empty(len(count), dtype=object)
    limit = SETTINGS.patch_pulses
    half = np.arange(limit) + 0.5
    for i, part in enumerate(np.split(rows[on], np.searchsorted(group[on], range(1, len(count))))):
        if len(part) > limit:
            some = part[(half * len(part) / limit).astype(int)]
        else:
            some = part
        clouds[i] = PointCloud(chunk.xyz[some], chunk.gps_time[some], chunk.intensity[some])
    return clouds


def freedom(points: np.ndarray) -> np.ndarray:
    """Degrees of freedom about a plane through numbers (n,) of points: a plane has three."""
    return np.maximum(points - 3, 1)


@njit(cache=True, nogil=True, error_model="numpy")
def _narrow(height, first, middle, sigma, trim, least):
    """Make middles and sigmas (g,) those of the heights (n,) within so many sigmas, four times."""
    ends = np.append(first[1:], len(height))
    for g in range(len(first)):
        part = height[first[g] : ends[g]]
        for _ in range(4):
            on = part[np.abs(part - middle[g]) <= trim * sigma[g]]
            middle[g] = on.mean()
            sigma[g] = max(on.std(), least)


@njit(cache=True, nogil=True)
def _heights(xyz, origin, normal, group):
    """How far points (n, 3) lie over the planes (g,) of their groups (n,). Units: m."""
    height = np.zeros(len(xyz))
    for i in range(len(xyz)):
        for axis in range(3):
            height[i] += (xyz[i, axis] - origin[group[i], axis]) * normal[group[i], axis]
    return height


def moments(
    local: np.ndarray, weight: np.ndarray, first: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Moments of groups of points.

    Parameters
    ----------
    local : (n, 3) array
        Points, group after group, about a place near them. Units: m.
    weight : (n,) array
    first : (g,) int array
        Where each group begins.

    Returns
    -------
    tuple of three (g, 3) arrays
        Mean (m), variances from the least (m^2), and the axis of the least.
    """
    values, axes = np.linalg.eigh((sums := _sums(local, weight, first))[:, 1:])
    # of points in a line rounding makes it negative
    return sums[:, 0], np.maximum(values, 0.0), np.ascontiguousarray(axes[:, :, 0])


@njit(cache=True, nogil=True)
def _sums(local, weight, first):
    """Means, and below them the lower halves of covariances, of groups of points: (g, 4, 3)."""
    sums = np.zeros((len(first), 4, 3))
    ends = np.append(first[1:], len(local))
    for g in range(len(first)):
        total = max(weight[first[g] : ends[g]].sum(), 1.0)
        for i in range(first[g], ends[g]):
            for a in range(3):
                sums[g, 0, a] += weight[i] * local[i, a] / total
        for i in range(first[g], ends[g]):
            for a in range(3):
                for b in range(a + 1):
                    square = (local[i, a] - sums[g, 0, a]) * (local[i, b] - sums[g, 0, b])
                    sums[g, 1 + a, b] += weight[i] * square / total
    return sums


def _between(away, weight, first, group):
    """Half the mean square (g,) of differences of distances (n,) that follow each other. m^2."""
    both = weight * np.append(weight[1:] * (group[1:] == group[:-1]), 0.0)
    squares = both * np.diff(away, append=0.0) ** 2
    total = np.maximum(np.add.reduceat(both, first), 1.0)
    return np.maximum(np.add.reduceat(squares, first) / total / 2, (SETTINGS.file_step / 10) ** 2)


def _taken(on_plane, first):
    """Places (g, 12) of points on each group's plane, evenly spread; repeated where few are."""
    held = np.add.reduceat(on_plane.astype(int), first)
    inliers = np.flatnonzero(on_plane)
    begin = np.cumsum(held) - held
    step = np.maximum(held, 1)[:, None] * (np.arange(SETTINGS.samples) + 0.5) / SETTINGS.samples
    return inliers[np.minimum(begin[:, None] + step.astype(int), len(inliers) - 1)]


def _sight(survey, chunk, sample):
    """Unit vector (p, 3) from each patch to the scanner."""
    middle = sample[:, SETTINGS.samples // 2]
    away = scanner_origin(survey, chunk.gps_time[middle]) - chunk.xyz[middle]
    return away / np.linalg.norm(away, axis=1, keepdims=True)


def _misses(gps_time, number, first, group):
    """Pulses fired and returned within the scan lines of a group, their ends not counted.

    The step of pulses is the least one of the group. Nothing is counted where pauses are not whole
    multiples of it (jitter, another order), or too many are long (a cloud that was thinned there).
    """
    pause = np.diff(gps_time, append=gps_time[-1])
    follows = np.append((np.diff(number) == 1) & (np.diff(group) == 0), False) & (pause > 0)
    step = np.minimum.reduceat(np.where(follows, pause, np.finfo(float).max), first)
    pulses = np.where(follows, pause / step[group], np.finfo(float).max)
    near = pulses <= SETTINGS.longest_miss
    longer = (pulses > SETTINGS.longest_miss) & (pulses <= SETTINGS.line_pause)
    pulses = np.where(near, pulses, 0.0)

    def count(which):
        return np.add.reduceat(which.astype(int), first)

    pauses = count(near)
    lines = count(near & ~np.append(False, near[:-1]))
    whole = count(near & (np.abs(pulses % 1 - 0.5) > 0.4))
    interrupted = count(longer)
    regular = (whole >= SETTINGS.rule * pauses) & (interrupted <= (1 - SETTINGS.rule) / 2 * pauses)
    # a line's first and last returns are there by choice: what lies between them counts
    fired = np.add.reduceat(np.round(pulses).astype(int), first) - lines
    return np.where(regular, fired, 0), np.where(regular, pauses - lines, 0)


class PatchCollector:
    """Keeps at most `pool` flat patches of the chunks that it is given, spread over the place.

    Which blocks of the ground are kept is told by a hash of their place: the same in all passes.
    Points of the moments about the end of a chunk are held until those that follow have come. So
    patches do not depend on chunks, where points come about in order of time, up or down.

    Parameters
    ----------
    survey : Survey
    pool : int
    """

    def __init__(self, survey: Survey, pool: int = SETTINGS.pool):
        self._survey = survey
        self._pool = pool
        self._parts = []
        self._starts = {}
        self._share = 1.0
        self._read = 0
        self._file: CloudFile | None = None
        self._held, self._number = NO_POINTS, np.empty(0, int)

    def add(self, file: CloudFile, chunk: PointCloud) -> None:
        """Take a chunk of a file; the chunks of a file follow each other."""
        if file != self._file:
            self._close(np.inf)
            self._file = file
            self._read = 0
        segment = self._survey.trajectory.segment(chunk.gps_time)
        for number in np.unique(segment[segment >= 0]).tolist():
            start = chunk.gps_time[segment == number].min()
            self._starts[file, number] = min(self._starts.get((file, number), np.inf), start)
        rows = np.flatnonzero((segment >= 0) & (block_chance(chunk.xyz) < self._share))
        self._held = PointCloud.concatenate([self._held, chunk[rows]])
        self._number = np.append(self._number, self._read + rows)
        self._read += len(chunk)
        self._close(chunk.gps_time[-1] if len(chunk) else np.inf)

    def _close(self, time):
        """Keep the patches of held points, but those of the moments about a time (s)."""
        segment = self._survey.trajectory.segment(self._held.gps_time)
        moments, is_open = moments_before(time, self._held.gps_time, segment)
        for part in moments:  # memory follows the largest
            patches = fit_patches(self._survey, self._held, self._number, part)
            if patches is not None:
                key = self._file, int(segment[part[0]])
                self._parts.append((key, patches[patches.block < self._share]))
            while sum(len(patches) for _, patches in self._parts) > self._pool:
                self._share /= 2
                self._parts = [(key, p[p.block < self._share]) for key, p in self._parts]
        self._held = self._held[is_open]
        self._number = self._number[is_open]

    def patches(self) -> Patches | None:
        """Patches of all chunks, of which none follows, by pass and place; None where none is."""
        self._close(np.inf)
        if not any(len(patches) for _, patches in self._parts):
            return None
        order = number_passes(self._starts)
        patches = Patches.concatenate(patches for _, patches in self._parts)
        number = np.repeat([order[key] for key, _ in self._parts], [len(p) for _, p in self._parts])
        rows = np.lexsort((place_key(patches.xyz[:, 0], patches.time[:, 0]), number))
        return replace(patches, pass_number=number)[rows]


def moments_before(
    time: float, gps_time: np.ndarray, segment: np.ndarray
) -> tuple[list[np.ndarray], np.ndarray]:
    """Rows of the points of each moment and segment, but of those about a time.

    Parameters
    ----------
    time : float
        About which points are still to come. Units: s.
    gps_time : (n,) array
        Units: s.
    segment : (n,) int array
        Of the trajectory.

    Returns
    -------
    moments : list of (k,) int array
    is_open : (n,) bool array
        Which points are of the moments about the time.
    """
    moment = np.floor(gps_time / SETTINGS.moment)
    # beams that take turns come a little late
    is_open = np.abs(moment - np.floor(time / SETTINGS.moment)) <= 1
    rows = np.lexsort((moment, segment))
    rows = rows[~is_open[rows]]
    is_next = (np.diff(segment[rows]) != 0) | (np.diff(moment[rows]) != 0)
    return [part for part in np.split(rows, np.flatnonzero(is_next) + 1) if len(part)], is_open


def find_patches(
    survey: Survey,
    pool: int = SETTINGS.pool,
    chunks: Callable[[CloudFile], Iterable[PointCloud]] = read_chunks,
) -> Patches | None:
    """Stream all clouds of a survey and keep at most `pool` flat patches: see PatchCollector.

    Parameters
    ----------
    survey : Survey
    pool : int
    chunks : function of a CloudFile
        Gives an iterator of PointCloud.

    Returns
    -------
    Patches or None
        None where the clouds hold no flat patch.
    """
    collector = PatchCollector(survey, pool)
    for file in survey.clouds:
        for chunk in chunks(file):
            collector.add(file, chunk)
    return collector.patches()
