"""Pass 1 over the cloud: keep the points near control points, whatever the file's size."""

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
    """Points near control points.

    Parameters
    ----------
    cloud : PointCloud
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

    cloud: PointCloud
    pass_number: np.ndarray
    unplaced: PointCloud
    passes: dict[tuple[int, int], int]
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


def collect(
    survey: Survey,
    read: Callable,
    progress: Callable | None = None,
    finished: Callable | None = None,
) -> Candidates:
    """Stream a survey's cloud files and keep the points near its surveyed points.

    Parameters
    ----------
    survey : Survey
    read : function of a CloudFile
        Gives an iterator of PointCloud.
    progress : function of a number of points, optional
    finished : function, optional
        ``finished(file, cloud, segment, since)`` is given the number of a file, points of it near
        control points, and the segment of the trajectory of each, when the file has ended, or
        earlier, where many points are held, those near control points that were passed. What it
        will still be given of the file so far is not older than since (s). Points that it was
        given are not kept: memory does not grow with the files, as long as their points come about
        in order of time.
    """
    trajectory, points = survey.trajectory, survey.surveyed
    near = Neighbourhoods(points.position, search_radius(survey, points))
    kept, numbers, unplaced, starts = [NO_POINTS], [np.empty((0, 2), int)], [NO_POINTS], {}
    for number, file in enumerate(survey.clouds):
        held, segments, limit = NO_POINTS, np.empty(0, int), SETTINGS.held_points
        for chunk in read(file):
            segment = trajectory.segment(chunk.gps_time)
            for part in np.unique(segment[segment >= 0]).tolist():
                start = chunk.gps_time[segment == part].min()
                starts[number, part] = min(starts.get((number, part), np.inf), start)
            rows = near.contains(chunk.xyz)
            has_pose = segment[rows] >= 0
            held = PointCloud.concatenate([held, chunk[rows[has_pose]]])
            segments = np.append(segments, segment[rows[has_pose]])
            unplaced.append(chunk[rows[~has_pose]])
            if finished is not None and len(held) > limit:
                passed = near.passed(held, chunk.gps_time.max() - MATCHING.pause)
                late = held[~passed]
                since = late.gps_time.min(initial=chunk.gps_time.max())
                finished(number, held[passed], segments[passed], since)
                held, segments = late, segments[~passed]
                limit = max(SETTINGS.held_points, 2 * len(held))
            if progress is not None:
                progress(len(chunk))
        if finished is not None:
            finished(number, held, segments, np.inf)
        else:
            kept.append(held)
            numbers.append(np.column_stack([np.full(len(segments), number), segments]))
    passes = number_passes(starts)
    keys = map(tuple, np.concatenate(numbers).tolist())
    pass_number = np.array([passes[key] for key in keys], int)
    clouds = map(PointCloud.concatenate, (kept, unplaced))
    return Candidates(next(clouds), pass_number, next(clouds), passes, starts)


def number_passes(starts: dict[tuple[int, int], float]) -> dict[tuple[int, int], int]:
    """Numbers of passes from 1 in time, by (number of the file, segment of the trajectory).

    Parameters
    ----------
    starts : dict
        When each begins. Units: s.
    """
    return {key: i for i, key in enumerate(sorted(starts, key=starts.get), start=1)}
