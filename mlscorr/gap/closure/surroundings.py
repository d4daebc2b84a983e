"""Observed targets, with the pulses around them (also without a return) and the background.

Files do not contain pulses without a return, but the regular steps of adjacent pulses reveal them.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from mlscorr.compiled_loops import loop
from mlscorr.gap.closure._settings import SETTINGS
from mlscorr.gap.residuals import SETTINGS as OBSERVE
from mlscorr.gap.residuals import Rows
from mlscorr.simulate import SETTINGS as SIMULATION
from mlscorr.simulate.scan import (
    FORMS,
    HOLE,
    Boards,
    Platform,
    RecordedPulses,
    aim,
    paints,
    recorded_platform,
    recorded_pulses,
)
from mlscorr.survey import PointCloud, Survey
from mlscorr.targets import NO_POINTS, FittedTarget, search_radius


@dataclass(frozen=True)
class Sighting:
    """Observed target behind rows: their item, and its surveyed position (3,) in m."""

    item: int
    fitted: FittedTarget
    surveyed: np.ndarray


@dataclass(frozen=True)
class SightedTarget:
    """Pulses around a target as observed, and its Boards; see Beams."""

    pulses: RecordedPulses
    board: Boards
    beyond: np.ndarray
    behind: np.ndarray

    @classmethod
    def join(cls, sighting: Sighting, parts: list) -> "SightedTarget":
        """Make the view of a Sighting from the pulses around it, from Surroundings.

        Parameters
        ----------
        sighting : Sighting
        parts : list of (RecordedPulses, (n,) array, (n,) array, (n, 2) array)
        """
        recorded, *arrays = zip(*parts, strict=True)
        pulses = RecordedPulses.concatenate(recorded)
        distance, slant, place = map(np.concatenate, arrays)
        away = np.abs(pulses.gps_time - sighting.fitted.gps_time)
        near = np.argsort(away, kind="stable")[: SETTINGS.target_pulses]
        near = near[np.argsort(pulses.gps_time[near], kind="stable")]
        pulses = pulses[near]
        place = place[near]
        beyond = pulses.range - distance[near]
        off = beyond * slant[near]
        form = FORMS.index(sighting.fitted.kind)
        shape = np.zeros(len(near), int), place / (1.0 if form == HOLE else SETTINGS.edge)
        board = board_of(sighting.fitted, np.zeros(3))
        own = (np.abs(off) <= SIMULATION.hiding_depth) & np.isfinite(board.paint(*shape))
        lit = (np.abs(off) <= SIMULATION.hiding_depth) & (board.paint(shape[0], place) == 1.0)
        if sighting.fitted.kind == "checkerboard":
            lit = own
        bright, dark, speckle = paints(sighting.fitted.kind, pulses.intensity[lit])
        board = board_of(sighting.fitted, np.zeros(3), bright, dark, speckle)
        others = np.flatnonzero(~own & ~(off < -SIMULATION.hiding_depth))
        beyond = beyond.copy()
        behind = pulses.intensity.copy()
        beyond[own] = np.nan
        behind[own] = 0.0
        if own.any() and len(others):
            nearest = others[cKDTree(place[others]).query(place[own])[1]]
            beyond[own] = beyond[nearest]
            behind[own] = behind[nearest]
        return cls(pulses, board, beyond, behind)


def sightings_of(rows: Rows, finding: Any) -> list[Sighting]:
    """Make the Sightings of the target rows.

    Parameters
    ----------
    rows : Rows
    finding : Finding
        Of the same survey.
    """
    on = rows.channel == "target"
    sightings = []
    matched = finding.matches.matched
    sights = zip(matched.name, matched.gps_time, strict=True)
    passes = dict(zip(sights, matched.pass_number, strict=True))
    items, first = np.unique(rows.item[on], return_index=True)
    for item, row in zip(items, np.flatnonzero(on)[first], strict=True):
        name = rows.targets.name[rows.survey_item[row]]
        time = rows.gps_time[row]
        target = finding.fitted.get((passes.get((name, time)), time))
        if target is not None:
            surveyed = rows.targets.position[rows.survey_item[row]]
            sightings.append(Sighting(int(item), target, surveyed))
    return sightings


def board_of(
    target: FittedTarget,
    origin: np.ndarray,
    bright: float = 1.0,
    dark: float = 0.0,
    speckle: float = 0.0,
) -> Boards:
    """Make the Boards of one FittedTarget.

    Parameters
    ----------
    target : FittedTarget
    origin : (3,) array
        Reference of its coordinates. Units: m.
    bright, dark, speckle : float
        Intensities of its paints, and their relative noise.
    """
    outline, (u, v) = target.view.outline, target.view.axes
    cos = np.cos(outline.turn)
    sin = np.sin(outline.turn)
    if target.kind == "circle":  # orientation of its board is unknown: upright
        normal = np.cross(u, v)
        if abs(normal[2]) < 0.99:
            side = np.array([0.0, 0.0, 1.0])
        else:
            side = np.array([1.0, 0.0, 0.0])
        u = np.cross(side, normal)
        u /= np.linalg.norm(u)
        v = np.cross(normal, u)
        cos = 1.0
        sin = 0.0
    edges = np.array([cos * u + sin * v, cos * v - sin * u])
    return Boards(
        centre=(target.position - origin)[None],
        axes=np.vstack([edges, np.cross(*edges)])[None],
        form=np.array([FORMS.index(target.kind)]),
        size=np.array([target.size]),
        inner=np.array([outline.inner]),
        bright=np.array([bright]),
        dark=np.array([dark]),
        speckle=np.array([speckle]),
    )


class Surroundings:
    """Points of chunks whose beams pass near surveyed targets.

    A target is somewhere within its search radius; after it is fitted, the points around it are
    kept.

    Parameters
    ----------
    survey : Survey
    """

    def __init__(self, survey: Survey):
        self._targets = survey.surveyed
        self._trajectory = survey.trajectory
        self._origin = survey.trajectory.position.mean(axis=0)
        self._platform = recorded_platform(survey, self._origin)
        self._radius = search_radius(survey, self._targets)
        self._open = []
        self._settled = []
        self._fitted = []

    def __len__(self):
        return sum(len(cloud) for cloud, _ in [*self._settled, *self._open])

    def add(self, chunk: PointCloud) -> None:
        """Add the relevant points of a chunk."""
        inside = chunk[self._trajectory.segment(chunk.gps_time) >= 0]
        if len(inside) == 0 or len(self._targets) == 0:
            return
        if (np.diff(inside.gps_time) < 0).any():
            inside = inside[np.argsort(inside.gps_time, kind="stable")]
        extent = SETTINGS.around * self._targets.size + SETTINGS.search_margin + 2 * self._radius
        near = self._passing(inside, self._targets.position, extent)
        self._open.append((inside[near], inside.gps_time[[0, -1]]))

    def settle(self, fitted: Iterable[FittedTarget], since: float) -> None:
        """Release points before a time (s), except those around fitted targets.

        Parameters
        ----------
        fitted : iterable of FittedTarget
            Fitted since the last call.
        since : float
            Further targets have no points before it. Units: s.
        """
        self._fitted += [(t, _scanned(t), self._largest_extent(t)) for t in fitted]
        if not self._open:
            return
        last = min(since, self._open[-1][1][1]) - OBSERVE.moment
        remaining = []
        for cloud, limits in self._open:
            part = self._narrowed(cloud, last), limits
            if limits[1] >= last:
                remaining.append(part)
            else:
                self._settled.append(part)
        self._open = remaining

    def _narrowed(self, cloud, last):
        keep = cloud.gps_time >= last
        for target, times, extent in self._fitted:
            rows = slice(*np.searchsorted(cloud.gps_time, times))
            keep[rows] |= self._passing(cloud[rows], target.position[None], np.array([extent]))
        return cloud[keep]

    def _largest_extent(self, target):
        """Largest distance of relevant beams from a fitted target, for any matched point.
        Units: m.
        """
        away = np.linalg.norm(self._targets.position - target.position, axis=1)
        return _extent(target, away[away <= self._radius].max(initial=away.min()))

    def _passing(self, cloud, place, extent):
        """Flag (n,) of beams of a cloud that pass positions (k, 3) within extents (k,), or
        would.
        """
        start = self._platform.scanner(cloud.gps_time)
        return _passing_any(start, cloud.xyz - self._origin, place - self._origin, extent**2)

    def about(self, platform: Platform, sighting: Sighting, origin: np.ndarray) -> list:
        """Pulses around a Sighting, with and without return, regardless of chunks.

        Parameters
        ----------
        platform : Platform
            Recorded platform, relative to the origin.
        sighting : Sighting
        origin : (3,) array
            Units: m.

        Returns
        -------
        list of (RecordedPulses, (n,) array, (n,) array, (n, 2) array)
            At most one: pulses, with distance (m), cosine of incidence and position of their
            crossing with the target's plane (m).
        """
        target = sighting.fitted
        times = np.array(_scanned(sighting.fitted))
        extent = _extent(target, np.linalg.norm(target.position - sighting.surveyed))
        clouds = [NO_POINTS]
        read = []
        for chunk, limits in [*self._settled, *self._open]:
            if limits[0] <= times[1] and limits[1] >= times[0]:
                clouds.append(chunk[slice(*np.searchsorted(chunk.gps_time, times))])
                read += np.clip(times, *limits).tolist()
        cloud = PointCloud.concatenate(clouds)
        place = target.position - origin
        start = platform.scanner(cloud.gps_time)
        near = _passing_any(start, cloud.xyz - origin, place[None], np.array([extent**2]))
        if not near.any():
            return []
        nearest = np.linalg.norm(start[near] - place, axis=1).min()
        span = np.clip([min(read), max(read)], *platform.epochs[[0, -1]])
        cloud = cloud[np.flatnonzero(near)[np.argsort(cloud.gps_time[near], kind="stable")]]
        pulses = _first_returns(recorded_pulses(platform, cloud, origin, target.normal))
        pulses = RecordedPulses.concatenate([pulses, unreturned(pulses, span, extent / nearest)])
        beams = aim(platform, pulses.gps_time, pulses.angle, pulses.elevation)
        board = board_of(target, origin)
        number = np.zeros(len(pulses), int)
        distance, slant, place = board.crossings(number, *beams)
        with np.errstate(invalid="ignore"):
            near = np.isfinite(distance) & (np.hypot(*place.T) <= extent)
        if near.any():
            return [(pulses[near], distance[near], slant[near], place[near])]
        return []


def _scanned(target):
    """Time interval in which a fitted target and its surroundings were scanned. Units: s."""
    time = target.cloud.gps_time
    return time.min() - OBSERVE.moment, time.max() + OBSERVE.moment


def _extent(target, separation):
    """Distance from a target within which beams matter, given its offset from the survey. m."""
    return SETTINGS.around * target.size + SETTINGS.search_margin + separation


@loop
def _passing_any(start, end, place, squared_extent):
    """Flag (n,) of beams from start to end (n, 3) that pass one of the positions (k, 3), or
    would.
    """
    near = np.zeros(len(start), np.bool_)
    for i in range(len(start)):
        x = end[i, 0] - start[i, 0]
        y = end[i, 1] - start[i, 1]
        z = end[i, 2] - start[i, 2]
        length = np.sqrt(x**2 + y**2 + z**2)
        for k in range(len(place)):
            a = place[k, 0] - start[i, 0]
            b = place[k, 1] - start[i, 1]
            c = place[k, 2] - start[i, 2]
            along = (a * x + b * y + c * z) / length
            if along > 0 and a**2 + b**2 + c**2 - along**2 <= squared_extent[k]:
                near[i] = True
                break
    return near


def _first_returns(pulses):
    """Pulses in order of time without later echoes, which have the same time and direction."""
    separation = np.abs(np.diff(pulses.angle)) + np.abs(np.diff(pulses.elevation))
    same = (np.diff(pulses.gps_time) == 0) & (
        separation * np.minimum(pulses.range[1:], pulses.range[:-1]) < 5e-3
    )
    group = np.append(0, np.cumsum(~same))
    order = np.lexsort((pulses.range, group))
    return pulses[order[np.unique(group[order], return_index=True)[1]]]


def unreturned(pulses: RecordedPulses, span: tuple[float, float], opening: float) -> RecordedPulses:
    """Pulses without a return, reconstructed between and next to recorded ones.

    Parameters
    ----------
    pulses : RecordedPulses
        Pulses around one position, in order of time.
    span : (float, float)
        Time interval of interest. Units: s.
    opening : float
        Angle about the recorded ones. Units: rad.

    Times and angles continue in the recorded steps. The result is empty if these are not regular
    (rings of beams, jitter, a thinned cloud); a target before the sky then has only the beams that
    hit it.
    """
    none = pulses[:0]
    start = pulses.gps_time[0]
    pause = np.diff(pulses.gps_time)
    if len(pause) < SETTINGS.line_pulses or np.ptp(pulses.elevation) > SETTINGS.plane_elevation:
        return none
    step = np.percentile(pause, 25)
    single = np.abs(pause - step) < 0.1 * step
    regular = max(OBSERVE.rule * (pause < 1.5 * step).sum(), SETTINGS.delivered * len(pause))
    if single.sum() < regular:
        return none
    number = np.append(0, np.cumsum(np.round(pause / pause[single].mean()).astype(int)))
    first, step = _line(number, pulses.gps_time - start)
    if np.abs(pulses.gps_time - start - first - step * number).max() > 0.3 * step:
        return none
    turned = np.mod(np.diff(pulses.angle) + np.pi, 2 * np.pi) - np.pi
    rate = turned[single].mean()
    left = np.unwrap(np.mod(pulses.angle - rate * number, 2 * np.pi))
    zero, more = _line(number, left)
    uneven = np.std(left - zero - more * number) > max(0.5 * abs(rate), 1e-3)
    if uneven or rate + more == 0:
        return none
    middle = np.angle(np.exp(1j * pulses.angle).mean())
    width = np.abs(np.mod(pulses.angle - middle + np.pi, 2 * np.pi) - np.pi).max() + opening
    ends = np.ceil((np.array(span) - start - first) / step).astype(int)
    every = _each_turn(zero - middle, rate + more, width, ends)
    angle = np.mod(zero + (rate + more) * every + np.pi, 2 * np.pi) - np.pi
    is_adjacent = np.abs(np.mod(angle - middle + np.pi, 2 * np.pi) - np.pi) <= width
    lost = np.flatnonzero(is_adjacent & ~np.isin(every, number))
    n = len(lost)
    return RecordedPulses(
        gps_time=start + first + step * every[lost],
        angle=angle[lost],
        elevation=np.full(n, np.median(pulses.elevation)),
        range=np.full(n, np.nan),
        intensity=np.zeros(n),
        incidence=np.ones(n),
    )


def _each_turn(zero, rate, width, ends):
    """Numbers between ends whose angle, increasing from zero at a rate, is within a width of a
    whole turn, or next to it, because a scanner mostly points away.
    """
    first, last = np.sort(zero + rate * ends) / (2 * np.pi)
    turns = 2 * np.pi * np.arange(np.floor(first), np.ceil(last) + 1)
    starts, stops = np.sort(np.sort((turns - zero + [[-width], [width]]) / rate, axis=0))
    starts, stops = (np.clip(n, *ends).astype(int) for n in (np.floor(starts), stops + 2))
    starts[1:] = np.maximum(starts[1:], stops[:-1])
    return np.concatenate(list(map(np.arange, starts, stops)))


def _line(x, y):
    """Value at 0 and slope of the straight line through points (n,), by least squares."""
    slope = np.cov(x, y)[0, 1] / np.var(x, ddof=1)
    return y.mean() - slope * x.mean(), slope
