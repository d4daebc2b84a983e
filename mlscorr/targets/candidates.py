"""First pass over the cloud: the points near each control point, for files of any size.

Each control point has a ball; a raster of the balls finds the points of a chunk in each.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from mlscorr.compiled_loops import loop
from mlscorr.io import SETTINGS as IO
from mlscorr.matching import SETTINGS as MATCHING
from mlscorr.survey import ControlPoints, PointCloud, Survey

NO_POINTS = PointCloud(np.empty((0, 3)), np.empty(0), np.empty(0, np.uint16))


@dataclass(frozen=True)
class Candidates:
    """Selected points near control points, and the passes of the clouds.

    Parameters
    ----------
    cloud : PointCloud
        Points on targets, once these are matched.
    pass_number : (n,) int array
        Pass of each point. A pass starts with each file and at each gap of the trajectory; passes
        are numbered from 1 in order of time.
    unplaced : PointCloud
        Points without a pose.
    passes : dict
        Numbers of passes by (index of the file, segment of the trajectory).
    starts : dict
        Start of these, with the same keys. Units: s.
    seconds : (k,) int array
        Whole seconds of gps_time with points of the clouds.
    """

    cloud: PointCloud = NO_POINTS
    pass_number: np.ndarray = field(default_factory=lambda: np.empty(0, int))
    unplaced: PointCloud = NO_POINTS
    passes: dict[tuple[int, int], int] = field(default_factory=dict)
    starts: dict[tuple[int, int], float] = field(default_factory=dict)
    seconds: np.ndarray = field(default_factory=lambda: np.empty(0, int))


def search_radius(survey: Survey, points: ControlPoints) -> np.ndarray:
    """Radius (n,) around surveyed points that contains their targets with edges. Units: m.

    It is the sum of the survey's radius, the target's half diagonal, and the same again for the
    area around its edges.

    Parameters
    ----------
    survey : Survey
    points : ControlPoints
    """
    return survey.search_radius + points.size * np.sqrt(2)


def collect(
    survey: Survey,
    read: Callable,
    fit: Callable,
    count: Callable,
    settled: Callable,
    progress: Callable,
) -> Candidates:
    """Stream a survey's cloud files and pass on the points near each of its surveyed points.

    Memory does not grow with a file if its points are roughly in order of time: when many points
    are in memory, those of surveyed points already passed are processed.

    Parameters
    ----------
    survey : Survey
    read : function of a CloudFile
        Returns an iterator of PointCloud.
    fit : function
        ``fit(file, index, cloud)`` receives points relative to a surveyed point (m), with the
        indices of the file and of this point.
    count : function of a PointCloud
        Receives the points with a pose near surveyed points, as they are read.
    settled : function
        ``settled(since)`` follows some calls of fit: the remaining points of the file are not older
        than since (s).
    progress : function of a number of points
    """
    trajectory = survey.trajectory
    points = survey.surveyed
    near = Neighbourhoods(points.position, search_radius(survey, points))
    unplaced = [NO_POINTS]
    starts = {}
    seconds = [np.empty(0, int)]

    def hand_on(file, pending, before, latest):
        for index in pending.passed(before):
            fit(file, index, pending.take(index))
        settled(min(pending.since(), latest))

    for number, file in enumerate(survey.clouds):
        pending = PointsInBalls(near)
        limit = IO.chunk_points
        for chunk in read(file):
            segment = trajectory.segment(chunk.gps_time)
            for part in np.unique(segment[segment >= 0]).tolist():
                start = chunk.gps_time[segment == part].min()
                starts[number, part] = min(starts.get((number, part), np.inf), start)
            seconds.append(_whole_seconds(chunk.gps_time[segment >= 0]))
            rows = near.contains(chunk.xyz)
            has_pose = segment[rows] >= 0
            unplaced.append(chunk[rows[~has_pose]])
            placed = chunk[rows[has_pose]]
            pending.add(placed)
            count(placed)
            if len(pending) > limit:
                latest = chunk.gps_time.max()
                hand_on(number, pending, latest - MATCHING.visit_gap, latest)
                limit = max(IO.chunk_points, 2 * len(pending))
            progress(len(chunk))
            del chunk, segment, rows, has_pose, placed  # large, and not needed any more
        hand_on(number, pending, np.inf, np.inf)
    cloud = PointCloud.concatenate(unplaced)
    passes = number_passes(starts)
    times = np.unique(np.concatenate(seconds))
    return Candidates(unplaced=cloud, passes=passes, starts=starts, seconds=times)


def _whole_seconds(gps_time):
    """Seconds with points (k,); only changes are sorted, as adjacent points mostly share a
    second.
    """
    seconds = np.floor(gps_time).astype(int)
    return np.unique(seconds[np.flatnonzero(np.diff(seconds, prepend=-1))])


def number_passes(starts: dict[tuple[int, int], float]) -> dict[tuple[int, int], int]:
    """Number passes from 1 in order of time, by (index of the file, segment of the trajectory).

    Parameters
    ----------
    starts : dict
        Start of each pass. Units: s.
    """
    return {key: i for i, key in enumerate(sorted(starts, key=starts.get), start=1)}


class Neighbourhoods:
    """Balls around positions: a raster of their bounding squares first, then exact distances.

    Parameters
    ----------
    position : (b, 3) array
        Units: m.
    radius : (b,) array
        Units: m.
    """

    def __init__(self, position: np.ndarray, radius: np.ndarray):
        self.position = np.ascontiguousarray(position, float)
        self.radius = radius
        margin = radius[:, None] * (1 + 1e-9)  # distances decide, not this rounding
        ends = [self.position[:, :2] + sign * margin for sign in (-1, 1)]
        low = ends[0].min(axis=0, initial=np.inf)
        extent = ends[1].max(axis=0, initial=-np.inf) - low
        edge = max(1.0, float(np.sqrt(max(extent.prod(), 0.0) / IO.chunk_points)))
        first, last = (np.floor((end - low) / edge).astype(int) for end in ends)
        shape = last.max(axis=0, initial=-1) + 1
        self._raster = low, edge, shape, *_reaching(first, last, shape)

    def __getitem__(self, numbers: np.ndarray) -> "Neighbourhoods":
        return Neighbourhoods(self.position[numbers], self.radius[numbers])

    def contains(self, xyz: np.ndarray) -> np.ndarray:
        """Return the sorted rows (k,) of the points in any ball.

        Parameters
        ----------
        xyz : (n, 3) array
            Units: m.
        """
        return np.flatnonzero(np.bincount(np.concatenate([np.empty(0, int), *self.each(xyz)])))

    def each(self, xyz: np.ndarray) -> list[np.ndarray]:
        """Return the sorted rows of the points within each ball.

        Parameters
        ----------
        xyz : (n, 3) array
            Units: m.
        """
        balls = self._raster, self.position, self.radius**2
        xyz = np.ascontiguousarray(xyz)
        counts = np.zeros(len(self.position), int)
        _enter(xyz, *balls, counts, np.empty(0, int))
        ends = np.cumsum(counts)
        rows = np.empty(counts.sum(), int)
        _enter(xyz, *balls, ends - counts, rows)
        if len(ends):
            return np.split(rows, ends[:-1])
        return []


def _reaching(first, last, shape):
    """Numbers of the balls that overlap each cell, cell by cell, and start of each cell."""
    cells = [
        np.arange(x, east + 1)[:, None] * shape[1] + np.arange(y, north + 1)
        for (x, y), (east, north) in zip(first, last, strict=True)
    ]
    ball = np.repeat(np.arange(len(cells)), [part.size for part in cells])
    cell = np.concatenate([np.empty(0, int), *map(np.ravel, cells)])
    starts = np.concatenate([[0], np.cumsum(np.bincount(cell, minlength=shape.prod()))])
    return starts, ball[np.argsort(cell, kind="stable")]


@loop
def _enter(xyz, raster, position, squares, free, rows):
    """Store the row of each point for each ball that contains it, or only count if there is no
    room.
    """
    low, edge, shape, starts, balls = raster
    for i in range(len(xyz)):
        x = (xyz[i, 0] - low[0]) / edge
        y = (xyz[i, 1] - low[1]) / edge
        if not (x >= 0 and y >= 0 and x < shape[0] and y < shape[1]):
            continue
        cell = int(x) * shape[1] + int(y)
        for k in range(starts[cell], starts[cell + 1]):
            ball = balls[k]
            square = 0.0
            for axis in range(3):
                square += (xyz[i, axis] - position[ball, axis]) ** 2
            if square <= squares[ball]:
                if len(rows) > 0:
                    rows[free[ball]] = i
                free[ball] += 1


class PointsInBalls:
    """Points of a file in balls, in the parts in which they were read, until a ball is passed.

    Parameters
    ----------
    balls : Neighbourhoods
    """

    def __init__(self, balls: Neighbourhoods):
        self._balls = balls
        self._parts = []
        self._read = 0
        self._first = np.full(len(balls.position), np.inf)
        self._last = -self._first
        self._size, self._taken = np.zeros((2, len(balls.position)), int)

    def __len__(self):
        return sum(len(part) for _, part, _ in self._parts)

    def add(self, cloud: PointCloud) -> None:
        """Store points, each in at least one ball."""
        self._read += 1
        counts = np.zeros(len(cloud), np.uint16)
        for ball, rows in enumerate(self._balls.each(cloud.xyz)):
            time = cloud.gps_time[rows]
            self._first[ball] = min(self._first[ball], time.min(initial=np.inf))
            self._last[ball] = max(self._last[ball], time.max(initial=-np.inf))
            self._size[ball] += len(rows)
            counts[rows] += 1
        self._parts.append((self._read, cloud, counts))

    def since(self) -> float:
        """Return the time of the oldest point. Units: s."""
        return float(self._first.min(initial=np.inf))

    def passed(self, before: float) -> np.ndarray:
        """Numbers (k,) of the balls whose points are all before a time (s).

        Those with the fewest points come first, so that little else is stored when the largest is
        taken.
        """
        numbers = np.flatnonzero((self._last > -np.inf) & (self._last < before))
        return numbers[np.argsort(self._size[numbers], kind="stable")]

    def take(self, number: int) -> PointCloud:
        """Take the points in a ball, relative to its middle (m), in reading order.

        Points that no other ball needs are released part by part, because dense balls are large.
        """
        ball = self._balls[np.array([number])]
        size = self._size[number]
        end = 0
        kind = self._parts[0][1].intensity.dtype
        cloud = PointCloud(np.empty((size, 3)), np.empty(size), np.empty(size, kind))
        for place, (read, part, counts) in enumerate(self._parts):
            if read > self._taken[number]:
                rows = ball.contains(part.xyz)
                there = slice(end, end + len(rows))
                end += len(rows)
                np.subtract(part.xyz[rows], ball.position, out=cloud.xyz[there])
                cloud.gps_time[there] = part.gps_time[rows]
                cloud.intensity[there] = part.intensity[rows]
                counts[rows] -= 1
                kept = counts > 0
                if not kept.all():
                    self._parts[place] = read, part[kept], counts[kept]
        self._parts = [entry for entry in self._parts if len(entry[1])]
        self._first[number] = np.inf
        self._last[number] = -np.inf
        self._size[number] = 0
        self._taken[number] = self._read
        return cloud
