"""Flat patches of the cloud: small in space and in time, each with its fitted plane.

They are found while the cloud is streamed; only the moments and some points of each patch are kept
in memory.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from mlscorr.gap.residuals.rows import scanner_origin
from mlscorr.gap.residuals.settings import SETTINGS
from mlscorr.io.clouds import read_chunks
from mlscorr.surfaces import (
    BoundedChoice,
    MomentStream,
    block_chance,
    cell_corner,
    pass_numbers,
    place_key,
    search_planes,
)
from mlscorr.survey import CloudFile, Columns, PointCloud, Survey
from mlscorr.targets import SETTINGS as TARGETS


@dataclass(frozen=True, repr=False)
class Patches(Columns):
    """Flat patches of the cloud, unordered.

    Parameters
    ----------
    pass_number : (p,) int array
    gps_time : (p,) array
        Mean of the points. Units: s.
    centre : (p, 3) array
        Mean of the points on the plane. Units: m.
    normal : (p, 3) array
        Toward the scanner.
    variance : (p,) array
        Variance about the plane, accounting for its three parameters. Units: m^2.
    spread : (p,) array
        One sigma of the points along the plane's narrow direction. Units: m.
    ripple : (p,) array
        Variance about the plane over that between consecutive points: about 1 for noise, more for
        curved surfaces.
    points : (p,) int array
        On the plane.
    fired, returned : (p,) int array
        Pulses between the first and the last return of each scan line on it; zero without regular
        time stamps.
    block : (p,) array
        Random number from 0 to 1, the same for neighbors.
    xyz : (p, 12, 3), time, intensity : (p, 12) arrays
        Points of each patch, evenly sampled in time.
    cloud : (p,) array of PointCloud
        Points on each plane in order of time, at most 400, for replay in the simulator.
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


def fit_patches(survey: Survey, cloud: PointCloud, number: np.ndarray) -> Patches | None:
    """Fit patches in a part of a pass, without its number; None if there are none.

    Parameters
    ----------
    survey : Survey
    cloud : PointCloud
        n points, with complete moments.
    number : (n,) int array
        Index of each in its file; consecutive indices were measured consecutively.
    """
    search = search_planes(cloud, survey.trajectory.position[0])
    rows = search.rows
    first = search.ends[:-1]
    count = np.diff(search.ends)
    planes = search.planes
    centre = search.middle + planes.mean
    least = np.maximum(SETTINGS.plane_points, SETTINGS.rule * count)
    good = (planes.points >= least) & (planes.variance <= SETTINGS.roughest**2)
    good &= planes.spread >= SETTINGS.narrowest_patch
    good &= _is_whole(centre, planes.normal, planes.variance)
    if not good.any():
        return None
    group = np.repeat(np.arange(len(count)), count)
    fired, returned = _misses(cloud.gps_time[rows], number[rows], first, group)
    is_on = search.is_on & good[group]
    group = (np.cumsum(good) - 1)[group[is_on]]
    rows = rows[is_on]
    planes = planes[good]
    sample = _taken(rows, planes.points)
    slant = np.einsum("pi,pi->p", planes.normal, _sight(survey, cloud, sample))
    between = np.maximum(planes.between, SETTINGS.rounding**2)
    return Patches(
        pass_number=np.zeros(len(planes), int),
        gps_time=search.begin[good] + planes.since,
        centre=centre[good],
        normal=planes.normal * np.sign(slant)[:, None],
        variance=planes.variance,
        spread=planes.spread,
        ripple=planes.variance / between,
        points=planes.points,
        fired=fired[good],
        returned=returned[good],
        block=block_chance(search.middle[good]),
        xyz=cloud.xyz[sample],
        time=cloud.gps_time[sample],
        intensity=cloud.intensity[sample].astype(float),
        cloud=_points_on_planes(cloud, rows, group),
    )[np.abs(slant) >= TARGETS.least_crossing_sine]


def _is_whole(centre, normal, variance):
    """Flag (g,) of planes that show all their noise; close and parallel to a cell's face, half
    is beyond.
    """
    inside = centre - cell_corner(centre)
    depth = np.minimum(inside, SETTINGS.cell - inside)
    return (depth > SETTINGS.trims[-1] * np.sqrt(variance)[:, None] * np.abs(normal)).all(axis=1)


def _points_on_planes(cloud, rows, group):
    """PointCloud of the points on each plane: rows (n,) of planes (n,), in order of time."""
    rows = rows[np.lexsort((cloud.gps_time[rows], group))]
    parts = np.split(rows, np.flatnonzero(np.diff(group)) + 1)
    clouds = np.empty(len(parts), dtype=object)
    limit = SETTINGS.patch_pulses
    half = np.arange(limit) + 0.5
    for i, part in enumerate(parts):
        if len(part) > limit:
            some = part[(half * len(part) / limit).astype(int)]
        else:
            some = part
        clouds[i] = PointCloud(cloud.xyz[some], cloud.gps_time[some], cloud.intensity[some])
    return clouds


def _taken(rows, points):
    """Positions (g, 12) of rows (n,) of planes (g,), evenly spread; repeated if there are few."""
    begin = np.cumsum(points) - points
    step = points[:, None] * (np.arange(SETTINGS.samples) + 0.5) / SETTINGS.samples
    return rows[begin[:, None] + step.astype(int)]


def _sight(survey, chunk, sample):
    """Unit vector (p, 3) from each patch to the scanner."""
    middle = sample[:, SETTINGS.samples // 2]
    away = scanner_origin(survey, chunk.gps_time[middle]) - chunk.xyz[middle]
    return away / np.linalg.norm(away, axis=1, keepdims=True)


def _misses(gps_time, number, first, group):
    """Pulses fired and returned within the scan lines of a group, excluding their ends.

    The pulse step is the smallest one of the group. Nothing is counted if pauses are not multiples
    of it (jitter, another order), or too many are long (a thinned cloud).
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
    # a line's first and last returns are selected: only those in between count
    fired = np.add.reduceat(np.round(pulses).astype(int), first) - lines
    return np.where(regular, fired, 0), np.where(regular, pauses - lines, 0)


class PatchCollector:
    """Collector of at most `pool` flat patches of chunks, spread over the area.

    Ground blocks are selected by a hash of their position, the same in all passes. Patches do not
    depend on chunks if points are roughly in order of time (see MomentStream).

    Parameters
    ----------
    survey : Survey
    pool : int
    """

    def __init__(self, survey: Survey, pool: int = SETTINGS.pool):
        self._survey = survey
        self._patches: BoundedChoice[Patches] = BoundedChoice(pool)
        self._starts = np.full((len(survey.clouds), len(survey.trajectory.passes)), np.inf)
        self._read = 0
        self._source = -1
        self._stream = MomentStream(survey.trajectory)

    def add(self, file: CloudFile, chunk: PointCloud) -> None:
        """Add a chunk of a file; the chunks of a file must be in sequence."""
        source = self._survey.clouds.index(file)
        if source != self._source:
            self._fit(np.inf)
            self._source = source
            self._read = 0
        segment = self._survey.trajectory.segment(chunk.gps_time)
        inside = segment >= 0
        np.minimum.at(self._starts[source], segment[inside], chunk.gps_time[inside])
        rows = np.flatnonzero(inside & (block_chance(chunk.xyz) < self._patches.share))
        self._stream.add(chunk[rows], self._read + rows)
        self._read += len(chunk)
        self._fit(chunk.gps_time[-1] if len(chunk) else np.inf)

    def _fit(self, time):
        """Keep the patches of the moments that are complete at a time (s)."""
        for segment, cloud, number in self._stream.moments(time):  # memory depends on the largest
            patches = fit_patches(self._survey, cloud, number)
            if patches is not None:
                group = self._source * self._starts.shape[1] + segment  # until everything is read
                patches = replace(patches, pass_number=np.full(len(patches), group))
                self._patches.add(patches, patches.block)

    def patches(self) -> Patches | None:
        """Return the patches of all chunks, after the last one, by pass and position; None
        without any.
        """
        self._fit(np.inf)
        parts = self._patches.parts()
        if not any(map(len, parts)):
            return None
        patches = Patches.concatenate(parts)
        number = pass_numbers(self._starts)[patches.pass_number]
        rows = np.lexsort((place_key(patches.xyz[:, 0], patches.time[:, 0]), number))
        return replace(patches, pass_number=number)[rows]


def find_patches(
    survey: Survey,
    pool: int = SETTINGS.pool,
    chunks: Callable[[CloudFile], Iterable[PointCloud]] = read_chunks,
) -> Patches | None:
    """Stream all clouds of a survey and keep at most `pool` flat patches; see PatchCollector.

    Parameters
    ----------
    survey : Survey
    pool : int
    chunks : function of a CloudFile
        Returns an iterator of PointCloud.

    Returns
    -------
    Patches or None
        None if the clouds have no flat patch.
    """
    collector = PatchCollector(survey, pool)
    for file in survey.clouds:
        for chunk in chunks(file):
            collector.add(file, chunk)
    return collector.patches()
