"""Path of the scanner, and visits of a position: one observation of a target for each visit."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import dist

import numpy as np

from mlscorr.matching import SETTINGS as MATCHING
from mlscorr.survey import PointCloud, Survey
from mlscorr.targets.settings import SETTINGS


@dataclass(frozen=True)
class ScannerPath:
    """Positions of a scanner, with uniform motion between them, accurate enough for directions.

    Parameters
    ----------
    gps_time : (k,) array
        At least two, sorted. Units: s.
    position : (k, 3) array
        Units: m.

    >>> path = ScannerPath(np.array([0.0, 1.0]), np.array([[0.0, 0.0, 2.0], [0.0, 8.0, 2.0]]))
    >>> path.at([0.25]).tolist()
    [[0.0, 2.0, 2.0]]
    """

    gps_time: np.ndarray
    position: np.ndarray

    @classmethod
    def of(cls, survey: Survey, gps_time: np.ndarray) -> ScannerPath:
        """Make the path from the epochs of a survey's trajectory around given times.

        Parameters
        ----------
        survey : Survey
            Trajectory and lever arm are used.
        gps_time : (n,) array
            At least one. Units: s.
        """
        trajectory = survey.trajectory
        time = survey.trajectory.gps_time
        before = np.searchsorted(time, gps_time.min(), "right") - 1
        before = int(np.clip(before, 0, len(time) - 2))
        epochs = slice(before, max(before + 2, np.searchsorted(time, gps_time.max()) + 1))
        arm = trajectory.attitude[epochs].apply(survey.assumed_mounting.lever_arm)
        return cls(time[epochs], trajectory.position[epochs] + arm)

    def at(self, gps_time: np.ndarray) -> np.ndarray:
        """Return positions (n, 3) at times (n,) in s. Units: m."""
        return np.column_stack([np.interp(gps_time, self.gps_time, p) for p in self.position.T])

    def seen_from(self, origin: np.ndarray) -> ScannerPath:
        """Return the path in coordinates relative to an origin (3,) in m."""
        return ScannerPath(self.gps_time, self.position - origin)


def split_visits(cloud: PointCloud, survey: Survey) -> list[tuple[int, PointCloud]]:
    """Split a cloud into visits of a position.

    Parameters
    ----------
    cloud : PointCloud
    survey : Survey
        Trajectory and lever arm are used.

    Returns
    -------
    list of (segment of the trajectory, PointCloud)
        Points of each visit, sorted by time, without those that have no pose. They are views if the
        cloud is sorted by time.

    A pause of two seconds separates visits, and so does a reversal (a U-turn before a target); a
    stop is one visit.
    """
    time = cloud.gps_time
    if (time[1:] < time[:-1]).any():
        cloud = cloud[np.argsort(time, kind="stable")]
    starts, ends = survey.trajectory.passes.T
    firsts, lasts = (np.searchsorted(cloud.gps_time, *at) for at in ((starts,), (ends, "right")))
    return [
        (number, visit)
        for number in np.flatnonzero(firsts < lasts).tolist()
        for visit in _visits(cloud[firsts[number] : lasts[number]], survey)
    ]


def _visits(cloud, survey):
    """Points of each visit in order of time, within a segment of the trajectory."""
    time = cloud.gps_time
    ends = np.unique([0, *(np.flatnonzero(np.diff(time) > MATCHING.visit_gap) + 1), len(time)])
    turns = [first + _turns(time[first:last], survey) for first, last in pairwise(ends)]
    ends = np.unique(np.concatenate([ends, *turns]))
    return [cloud[first:last] for first, last in pairwise(ends)]


def _turns(gps_time, survey):
    """Rows at which the vehicle reversed its direction."""
    scanner = ScannerPath.of(survey, gps_time)
    path = scanner.position
    marks = _each_step(path, SETTINGS.turn_step)
    steps = np.diff(path[marks, :2], axis=0)
    cuts = []
    forward = steps[0] if len(steps) else None
    for number in range(1, len(steps)):
        if steps[number] @ forward < 0:
            first = marks[number - 1]
            last = marks[number + 1]
            cuts.append(first + int(np.argmax(path[first:last, :2] @ forward)))
            forward = steps[number]
    return np.searchsorted(gps_time, scanner.gps_time[cuts])


def _each_step(path, step):
    """Rows (k,) of a path, each the first that is farther than a step from the previous one."""
    places = path[:, :2].tolist()
    marks = [0]
    for row, place in enumerate(places):
        if dist(place, places[marks[-1]]) > step:
            marks.append(row)
    return marks
