"""When the scanner came by: one observation of a target for each pass and visit of it."""

from itertools import pairwise
from math import dist

import numpy as np

from mlscorr.matching import SETTINGS as MATCHING
from mlscorr.pos import stated_sigma
from mlscorr.survey import PointCloud, Pos, Survey, Trajectory
from mlscorr.targets.scanner_path import ScannerPath
from mlscorr.targets.settings import SETTINGS


def split_visits(cloud: PointCloud, survey: Survey) -> list[tuple[int, PointCloud]]:
    """Visits of a place.

    Parameters
    ----------
    cloud : PointCloud
    survey : Survey
        Its trajectory and lever arm.

    Returns
    -------
    list of (segment of the trajectory, PointCloud)
        The points of each visit, in time; those without a pose in none. Of a cloud in order of
        time these are views.

    A pause of two seconds parts two visits, and so does a turn back (a U-turn before a target); a
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
    """The points in order of time of each visit, of those of a segment of the trajectory."""
    time = cloud.gps_time
    ends = np.unique([0, *(np.flatnonzero(np.diff(time) > MATCHING.visit_gap) + 1), len(time)])
    turns = [first + _turns(time[first:last], survey) for first, last in pairwise(ends)]
    ends = np.unique(np.concatenate([ends, *turns]))
    return [cloud[first:last] for first, last in pairwise(ends)]


def _turns(gps_time, survey):
    """Rows at which the vehicle turned back against the way it came."""
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
    """Rows (k,) of a path, of which each is the first farther than a step from the one before."""
    places = path[:, :2].tolist()
    marks = [0]
    for row, place in enumerate(places):
        if dist(place, places[marks[-1]]) > step:
            marks.append(row)
    return marks


def motion_covariance(
    trajectory: Trajectory, pos: Pos, gps_time: np.ndarray, duration: np.ndarray
) -> np.ndarray:
    """Covariance (n, 3, 3) of centres as the POS error moves while targets are scanned. m^2.

    Parameters
    ----------
    trajectory : Trajectory
    pos : Pos
    gps_time, duration : (n,) array
        Of each centre, and the standard deviation of its points' times. Units: s.

    Source: the rate of a smooth (Matern 3/2) process is sigma sqrt(3) / correlation time; the
    centre's time and the mean time of its points differ by at most their spread. The attitude's
    share is left out: an error of 0.1 mrad moves a target at 10 m by 1 mm in all.
    """
    sigma = stated_sigma(trajectory, pos, gps_time).position
    moved = sigma * np.sqrt(3) / pos.correlation_time * np.asarray(duration)[:, None]
    return moved[:, :, None] ** 2 * np.eye(3)
