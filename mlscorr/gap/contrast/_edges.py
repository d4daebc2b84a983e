"""Depth edges along scan lines: the angle over which a line passes to a surface behind.

A thin beam steps from the near surface to the far one. A wide beam gives pulses in between, or both
surfaces in one pulse, while its footprint covers both: their number times the angle between pulses
is the width of the edge.
"""

from dataclasses import dataclass

import numpy as np

from mlscorr.gap.contrast._settings import SETTINGS
from mlscorr.gap.residuals import SETTINGS as OBSERVE
from mlscorr.simulate.scan import recorded_platform
from mlscorr.surfaces import BoundedChoice, MomentStream, chance
from mlscorr.survey import Columns, PointCloud, Survey


@dataclass(frozen=True, repr=False)
class Edges(Columns):
    """Depth edges.

    Parameters
    ----------
    gps_time : (e,) array
        Units: s.
    place : (e, 3) array
        On the near surface. Units: m.
    range : (e,) array
        Of the near surface. Units: m.
    width : (e,) array
        Units: rad.
    """

    gps_time: np.ndarray
    place: np.ndarray
    range: np.ndarray
    width: np.ndarray

    @property
    def chance(self) -> np.ndarray:
        """Random number from 0 to 1 (e,) of the moment, the same in all clouds."""
        return chance(np.floor(self.gps_time / OBSERVE.moment).astype(np.int64))


class EdgeCollector:
    """Collector of about `limit` depth edges from chunks, regardless of their ends.

    Parameters
    ----------
    survey : Survey
    limit : int
    """

    def __init__(self, survey: Survey, limit: int = SETTINGS.kept):
        self._survey = survey
        self._origin = survey.trajectory.position.mean(axis=0)
        self._platform = recorded_platform(survey, self._origin)
        self._edges: BoundedChoice[Edges] = BoundedChoice(limit)
        self._stream = MomentStream(survey.trajectory)

    def add(self, chunk: PointCloud) -> None:
        """Add the edges of a chunk, except those of the moments around its last point."""
        rows = np.flatnonzero(self._survey.trajectory.segment(chunk.gps_time) >= 0)
        self._stream.add(chunk[rows], rows)
        self._take_until(chunk.gps_time[-1] if len(chunk) else np.inf)

    def _take_until(self, time):
        """Add the edges of the moments that are complete at a time (s)."""
        for _, cloud, _ in self._stream.moments(time):
            self._take(cloud[np.argsort(cloud.gps_time, kind="stable")])

    def _take(self, inside):
        """Add the edges of the points of a moment, sorted by time."""
        sight = inside.xyz - self._origin - self._platform.scanner(inside.gps_time)
        rough = max(OBSERVE.roughest, 6 * np.sqrt(6) * self._survey.scanner.range_noise)
        edges = edges_of(inside, sight, rough)
        self._edges.add(edges, edges.chance)

    def edges(self) -> Edges:
        """Return the edges of all chunks, after the last one."""
        self._take_until(np.inf)
        nothing = Edges(np.empty(0), np.empty((0, 3)), np.empty(0), np.empty(0))
        return Edges.concatenate([nothing, *self._edges.parts()])

    @property
    def share(self) -> float:
        """Share of the moments whose edges are kept."""
        return self._edges.share


def edges_of(cloud: PointCloud, sight: np.ndarray, rough: float) -> Edges:
    """Find depth edges of points in order of time.

    Parameters
    ----------
    cloud : PointCloud
    sight : (n, 3) array
        Vector from the scanner to each point. Units: m.
    rough : float
        Second difference of ranges below which points are on one surface. Units: m.
    """
    away = np.linalg.norm(sight, axis=1)
    beam = sight / np.maximum(away, 1e-9)[:, None]
    turn = np.append(np.inf, np.linalg.norm(np.diff(beam, axis=0), axis=1))
    across = turn * np.minimum(away, np.append(np.inf, away[:-1]))
    is_more = (np.diff(cloud.gps_time, prepend=-np.inf) == 0) & (across < SETTINGS.same_pulse)
    first = np.flatnonzero(~is_more)
    near = np.minimum.reduceat(away, first)
    far = np.maximum.reduceat(away, first)
    time = cloud.gps_time[first]
    step = np.append(turn[first][1:], np.inf)
    pause = np.append(np.diff(time), np.inf)
    follows = pause <= 1.5 * np.median(pause)
    bend = np.full(len(first), np.inf)
    bend[1:-1] = np.abs(near[2:] - 2 * near[1:-1] + near[:-2])
    is_smooth = (bend <= rough) & follows & np.append(False, follows[:-1])
    begin, end = _between_plateaus(is_smooth, follows)
    ahead = 2 * near[begin] - near[begin - 1]
    back = 2 * near[end] - near[end + 1]
    low = np.minimum(ahead, back)
    high = np.maximum(ahead, back)
    is_edge = (high - low >= SETTINGS.jump) & (end - begin - 1 >= 2)
    mixed = np.maximum(end - begin - 3, 0)  # without the ends on both surfaces
    last = len(first)
    is_double = far - near >= SETTINGS.jump
    is_near = near[begin] <= near[end]  # pulses that measure both surfaces end the near one
    both = np.where(is_near, _run(is_double)[begin + 1], _run(is_double[::-1])[::-1][end - 1])
    for offset in range(2, SETTINGS.widest + 2):  # a pulse in between is on neither surface
        k = np.minimum(begin + offset, last - 1)
        is_inside = offset < end - begin - 1
        is_edge &= ~is_inside | ((near[k] > low + rough) & (near[k] < high - rough))
    here = np.where(is_near, begin, end)[is_edge]
    width = (mixed + np.minimum(both, SETTINGS.widest))[is_edge] * step[begin[is_edge]]
    return Edges(time[here], cloud.xyz[first[here]], near[here], width)


def _run(is_double):
    """Number of pulses (n,) in unbroken sequence up to each one, inclusive."""
    number = np.arange(len(is_double))
    return number - np.maximum.accumulate(np.where(is_double, -1, number))


def _between_plateaus(is_smooth, follows):
    """Last pulse of a plateau (e,) and first pulse of the next, with few pulses between them."""
    change = np.flatnonzero(np.diff(is_smooth.astype(np.int8)))
    starts = np.append(0, change + 1)
    ends = np.append(change, len(is_smooth) - 1)
    length = ends - starts + 1
    smooth = is_smooth[starts]
    middle = np.arange(1, len(starts) - 1)
    gaps = np.append(0, np.cumsum(~follows))
    least = SETTINGS.plateau - 2  # neighbors of a smooth pulse are on the surface
    good = ~smooth[middle] & (length[middle] <= SETTINGS.widest + 2)
    good &= (length[middle - 1] >= least) & (length[middle + 1] >= least)
    begin = ends[middle - 1]
    end = starts[middle + 1]
    good &= (gaps[end] == gaps[begin]) & (begin >= 1) & (end < len(is_smooth) - 1)
    return begin[good], end[good]
