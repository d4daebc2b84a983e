"""The pulses about observed targets, those too that nothing returned, and what lies behind."""

from collections.abc import Iterable

import numpy as np
from numba import njit

from mlscorr.gap.closure._settings import SETTINGS
from mlscorr.gap.closure._sightings import Sighting, board_of
from mlscorr.gap.closure._unreturned import unreturned
from mlscorr.gap.residuals import SETTINGS as OBSERVE
from mlscorr.simulate.scan import Platform, RecordedPulses, aim, recorded_platform, recorded_pulses
from mlscorr.survey import PointCloud, Survey
from mlscorr.targets import NO_POINTS, FittedTarget, search_radius


class Surroundings:
    """Points whose beams pass near surveyed targets, of the chunks that it is given.

    A target lies somewhere within its search radius; once it is fitted the points about it stay.

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
        """Take what it needs of a chunk."""
        inside = chunk[self._trajectory.segment(chunk.gps_time) >= 0]
        if len(inside) == 0 or len(self._targets) == 0:
            return
        if (np.diff(inside.gps_time) < 0).any():
            inside = inside[np.argsort(inside.gps_time, kind="stable")]
        extent = SETTINGS.around * self._targets.size + SETTINGS.search_margin + 2 * self._radius
        near = self._passing(inside, self._targets.position, extent)
        self._open.append((inside[near], inside.gps_time[[0, -1]]))

    def settle(self, fitted: Iterable[FittedTarget], since: float) -> None:
        """Let go of points before a time (s) but those about targets that are fitted.

        Parameters
        ----------
        fitted : iterable of FittedTarget
            Since the last call.
        since : float
            Targets to come have no point before it. Units: s.
        """
        self._fitted += [(t, _scanned(t), self._largest_extent(t)) for t in fitted]
        if not self._open:
            return
        last = min(since, self._open[-1][1][1]) - OBSERVE.moment
        remaining = []
        for cloud, limits in self._open:
            part = self._narrowed(cloud, last), limits
            (remaining if limits[1] >= last else self._settled).append(part)
        self._open = remaining

    def _narrowed(self, cloud, last):
        keep = cloud.gps_time >= last
        for target, times, extent in self._fitted:
            rows = slice(*np.searchsorted(cloud.gps_time, times))
            keep[rows] |= self._passing(cloud[rows], target.position[None], np.array([extent]))
        return cloud[keep]

    def _largest_extent(self, target):
        """How far from a fitted target beams may be wanted, whichever point it is. Units: m."""
        away = np.linalg.norm(self._targets.position - target.position, axis=1)
        return _extent(target, away[away <= self._radius].max(initial=away.min()))

    def _passing(self, cloud, place, extent):
        """Which beams (n,) of a cloud pass places (k, 3) within extents (k,), or would. m."""
        start = self._platform.scanner(cloud.gps_time)
        return _passing_any(start, cloud.xyz - self._origin, place - self._origin, extent**2)

    def about(self, platform: Platform, sighting: Sighting, origin: np.ndarray) -> list:
        """Pulses about a Sighting, whether they returned or not, wherever chunks end.

        Parameters
        ----------
        platform : Platform
            The recorded one about the origin.
        sighting : Sighting
        origin : (3,) array
            Units: m.

        Returns
        -------
        list of (RecordedPulses, (n,) array, (n,) array, (n, 2) array)
            One or none: pulses, and their distance (m), cosine of incidence and place where they
            cross the target's plane (m).
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
    """Times between which a fitted target and its surroundings were scanned. Units: s."""
    time = target.cloud.gps_time
    return time.min() - OBSERVE.moment, time.max() + OBSERVE.moment


def _extent(target, apart):
    """How far from a target, observed apart from where it was surveyed, beams matter. m."""
    return SETTINGS.around * target.size + SETTINGS.search_margin + apart


@njit(cache=True)
def _passing_any(start, end, place, squared_extent):
    """Which beams (n,) from start to end (n, 3) pass one of the places (k, 3), or would."""
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
    """Pulses in order of time without later echoes: the same time and direction, farther away."""
    apart = np.abs(np.diff(pulses.angle)) + np.abs(np.diff(pulses.elevation))
    same = (np.diff(pulses.gps_time) == 0) & (
        apart * np.minimum(pulses.range[1:], pulses.range[:-1]) < 5e-3
    )
    group = np.append(0, np.cumsum(~same))
    order = np.lexsort((pulses.range, group))
    return pulses[order[np.unique(group[order], return_index=True)[1]]]
