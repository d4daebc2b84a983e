"""Pass 1 over the cloud: the points near each control point, whatever the file's size."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from mlscorr.matching import SETTINGS as MATCHING
from mlscorr.survey import ControlPoints, PointCloud, Survey
from mlscorr.targets.balls import Neighbourhoods
from mlscorr.targets.settings import SETTINGS

NO_POINTS = PointCloud(np.empty((0, 3)), np.empty(0), np.empty(0, np.uint16))


@dataclass(frozen=True)
class Candidates:
    """Points near control points that are kept, and the passes of the clouds.

    Parameters
    ----------
    cloud : PointCloud
        On targets, once these are matched.
    pass_number : (n,) int array
        Of each point. A pass starts with each file and at each gap of the trajectory; passes count
        from 1 in time.
    unplaced : PointCloud
        Those that have no pose.
    passes : dict
        Numbers of passes by (number of the file, segment of the trajectory).
    starts : dict
        When these begin, likewise. Units: s.
    """

    cloud: PointCloud = NO_POINTS
    pass_number: np.ndarray = field(default_factory=lambda: np.empty(0, int))
    unplaced: PointCloud = NO_POINTS
    passes: dict[tuple[int, int], int] = field(default_factory=dict)
    starts: dict[tuple[int, int], float] = field(default_factory=dict)


def search_radius(survey: Survey, points: ControlPoints) -> np.ndarray:
    """Radius (n,) about surveyed points in which their images must lie. Units: m.

    The survey's, and the target's own half diagonal.

    Parameters
    ----------
    survey : Survey
    points : ControlPoints
    """
    return survey.search_radius + points.size / np.sqrt(2)


class PointsInBalls:
    """Points of a file in balls, in the parts in which they were read, until a ball is passed.

    Parameters
    ----------
    balls : Neighbourhoods
    """

    def __init__(self, balls: Neighbourhoods):
        self._balls, self._parts = balls, []
        self._first = np.full(len(balls.position), np.inf)
        self._last = -self._first

    def __len__(self):
        return sum(map(len, self._parts))

    def add(self, cloud: PointCloud) -> None:
        """Hold points, each in a ball at least."""
        self._parts.append(cloud)
        for ball, rows in enumerate(self._balls.each(cloud.xyz)):
            time = cloud.gps_time[rows]
            self._first[ball] = min(self._first[ball], time.min(initial=np.inf))
            self._last[ball] = max(self._last[ball], time.max(initial=-np.inf))

    def since(self) -> float:
        """Time of the oldest point. Units: s."""
        return float(self._first.min(initial=np.inf))

    def passed(self, before: float) -> np.ndarray:
        """Numbers (k,) of the balls with points of which none is later than a time (s)."""
        return np.flatnonzero((self._last > -np.inf) & (self._last < before))

    def inside(self, number: int) -> PointCloud:
        """Points in a ball from its middle (m), as they were read."""
        ball = self._balls[np.array([number])]
        rows = [ball.contains(part.xyz) for part in self._parts]
        ends = np.cumsum([len(k) for k in rows])
        xyz, columns = np.empty((ends[-1], 3)), []  # filled by parts, as dense balls are large
        for part, k, places in zip(self._parts, rows, np.split(xyz, ends[:-1]), strict=True):
            np.subtract(part.xyz[k], ball.position, out=places)
            columns.append((part.gps_time[k], part.intensity[k]))
        return PointCloud(xyz, *map(np.concatenate, zip(*columns, strict=True)))

    def release(self, numbers: np.ndarray) -> None:
        """Let go of what is in these balls (k,) alone."""
        self._first[numbers], self._last[numbers] = np.inf, -np.inf
        others = self._balls[np.isfinite(self._last)]
        for number, part in enumerate(self._parts):
            self._parts[number] = part[others.contains(part.xyz)]
        self._parts = list(filter(len, self._parts))


def collect(
    survey: Survey,
    read: Callable,
    fit: Callable,
    count: Callable,
    settled: Callable,
    progress: Callable,
) -> Candidates:
    """Stream a survey's cloud files and hand on the points near each of its surveyed points.

    Memory does not grow with a file, as long as its points come about in order of time: a surveyed
    point that was passed has its points handed on where many are held.

    Parameters
    ----------
    survey : Survey
    read : function of a CloudFile
        Gives an iterator of PointCloud.
    fit : function
        ``fit(file, index, cloud)`` is given points near a surveyed point, from there (m), by the
        numbers of the file and of this point.
    count : function of a PointCloud
        Is given the points near surveyed points that have a pose, as they are read.
    settled : function
        ``settled(since)`` follows some calls of fit: what is still to come of the file is not older
        than since (s).
    progress : function of a number of points
    """
    trajectory, points = survey.trajectory, survey.surveyed
    near = Neighbourhoods(points.position, search_radius(survey, points))
    unplaced, starts = [NO_POINTS], {}

    def hand_on(file, held, before, latest):
        passed = held.passed(before)
        for index in passed:
            fit(file, index, held.inside(index))
        held.release(passed)
        settled(min(held.since(), latest))

    for number, file in enumerate(survey.clouds):
        held, limit = PointsInBalls(near), SETTINGS.held_points
        for chunk in read(file):
            segment = trajectory.segment(chunk.gps_time)
            for part in np.unique(segment[segment >= 0]).tolist():
                start = chunk.gps_time[segment == part].min()
                starts[number, part] = min(starts.get((number, part), np.inf), start)
            rows = near.contains(chunk.xyz)
            has_pose = segment[rows] >= 0
            unplaced.append(chunk[rows[~has_pose]])
            placed = chunk[rows[has_pose]]
            held.add(placed)
            count(placed)
            if len(held) > limit:
                latest = chunk.gps_time.max()
                hand_on(number, held, latest - MATCHING.pause, latest)
                limit = max(SETTINGS.held_points, 2 * len(held))
            progress(len(chunk))
            del chunk, segment, rows, has_pose, placed  # large, and needed no more
        hand_on(number, held, np.inf, np.inf)
    cloud = PointCloud.concatenate(unplaced)
    return Candidates(unplaced=cloud, passes=number_passes(starts), starts=starts)


def number_passes(starts: dict[tuple[int, int], float]) -> dict[tuple[int, int], int]:
    """Numbers of passes from 1 in time, by (number of the file, segment of the trajectory).

    Parameters
    ----------
    starts : dict
        When each begins. Units: s.
    """
    return {key: i for i, key in enumerate(sorted(starts, key=starts.get), start=1)}
