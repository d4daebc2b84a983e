"""Quick search for some surveyed targets along the drive, before the clouds are read."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from time import perf_counter, process_time

import numpy as np

from mlscorr.io.clouds import read_intervals
from mlscorr.io.tables import nearest_epochs
from mlscorr.pipeline.finding import (
    FoundTargets,
    check_found_control,
    fit_while_reading,
    match_fitted,
    match_silently,
    nothing_found,
)
from mlscorr.pipeline.settings import SETTINGS
from mlscorr.survey import ControlPoints, Matched, PointCloud, Survey
from mlscorr.targets import search_radius


@dataclass(frozen=True)
class QuickLook:
    """Result of a quick search near some surveyed points.

    Parameters
    ----------
    points : ControlPoints
        Searched points.
    matched : Matched
        Found points.
    fault : str
        Sentence if another size or height finds them, otherwise empty.
    refusal : str
        Error of a correction with only these points; otherwise empty.
    doubt : str
        Sentence if few were found without a known reason.
    seconds : float
        Time to fit a target. Units: s.
    """

    points: ControlPoints
    matched: Matched
    fault: str
    refusal: str
    doubt: str
    seconds: float


def check_near_control(survey: Survey) -> QuickLook:
    """Search for some targets of a survey where the vehicle passed them.

    Targets found are matched with all surveyed points, as in a correction. Missing targets are
    searched again with doubled sizes (radii given for diameters) and with heights of the cloud.

    Parameters
    ----------
    survey : Survey
        With surveyed points.

    Raises
    ------
    ValueError
        If the files are not in order of time, so that the search would take as long as reading
        them.
    """
    whole = survey
    survey = replace(
        survey,
        control=spread_points(survey),
        check=survey.surveyed[[]],
        excluded=survey.surveyed[[]],
    )
    chunks = {file: list(_near(survey, file)) for file in survey.clouds}
    survey = replace(survey, control=_affordable(survey, chunks))
    start = perf_counter()
    near_control = _fit(survey, chunks)
    seconds = (perf_counter() - start) / len(survey.control)
    matched, refusal = _decided(whole, near_control)
    matched = matched[np.isin(matched.name, survey.control.name)]
    fault = doubt = ""
    if 2 * len(set(matched.name)) < len(survey.control):
        fault = _with_sizes_doubled(survey, chunks, matched) or _with_other_heights(
            survey, chunks, matched
        )
        doubt = "" if fault else _doubt(survey, matched, near_control)
    return QuickLook(survey.control, matched, fault, refusal, doubt, seconds)


def _decided(survey, near_control):
    """Matches of all surveyed points, and the error of a correction that refuses them."""
    try:
        matches = match_silently(near_control, survey)
    except ValueError as error:
        return Matched.none(), str(error)
    try:
        check_found_control(matches)
    except ValueError as error:
        return matches.matched, str(error)
    return matches.matched, ""


def spread_points(survey: Survey) -> ControlPoints:
    """Select some surveyed points, spread over the drive.

    Parameters
    ----------
    survey : Survey
    """
    order = np.argsort(nearest_epochs(survey.surveyed.position[:, :2], survey.trajectory)[1])
    some = np.linspace(0, len(order) - 1, min(len(order), SETTINGS.looked_points))
    return survey.surveyed[order[np.rint(some).astype(int)]]


def _affordable(survey, chunks):
    """Select points, still spread, that can be fitted in the available time.

    Processor time is used, so that other load on the machine does not change the result.
    """
    points = survey.control
    share = SETTINGS.looked_seconds / SETTINGS.looked_points
    single = replace(survey, control=points[len(points) // 2 :][:1])
    for _ in range(2):  # the first fit may include compilation
        start = process_time()
        _fit(single, chunks)
        seconds = process_time() - start
        if seconds <= share:
            return points
    count = min(len(points), max(3, int(SETTINGS.looked_seconds / seconds)))
    return points[np.rint(np.linspace(0, len(points) - 1, count)).astype(int)]


def _near(survey, file) -> Iterator[PointCloud]:
    """Yield points of a file near surveyed points, at any height."""
    place = survey.control.position
    radius = search_radius(survey, survey.control)
    for chunk in read_intervals(file, _spans(survey)):
        is_near = np.zeros(len(chunk), bool)
        for centre, limit in zip(place, radius, strict=True):
            rows = np.flatnonzero(np.abs(chunk.xyz[:, 0] - centre[0]) <= limit)
            plan = chunk.xyz[rows, :2] - centre[:2]
            is_near[rows] |= np.hypot(*plan.T) <= limit
        if is_near.any():
            yield chunk[is_near]


def _spans(survey):
    """Sorted intervals (k, 2) in which the points were passed. Units: s."""
    trajectory = survey.trajectory
    inside = np.zeros(len(survey.trajectory), bool)
    for centre in survey.control.position[:, :2]:
        distance = np.hypot(*(trajectory.position[:, :2] - centre).T)
        inside |= distance <= np.hypot(distance.min(), SETTINGS.looked_length)
    number = np.where(inside, trajectory.segment(trajectory.gps_time) + 1, 0)
    edge = np.diff(number, prepend=0, append=0) != 0
    starts = np.flatnonzero(edge[:-1] & inside)
    ends = np.flatnonzero(edge[1:] & inside)
    return np.column_stack([trajectory.gps_time[starts], trajectory.gps_time[ends]])


def _fit(survey, chunks) -> FoundTargets:
    """Targets near surveyed points, fitted in the points read."""
    return fit_while_reading(survey, lambda file: iter(chunks[file]))


def _find(survey, chunks) -> Matched:
    """Surveyed targets found in the points read."""
    near_control = _fit(survey, chunks)
    return match_fitted(survey, near_control.targets, near_control.candidates).control


def _with_sizes_doubled(survey, chunks, matched):
    """Sentence if sizes are radii."""
    points = survey.control
    doubled = replace(points, size=2 * points.size)
    refit = _find(replace(survey, control=doubled), chunks)
    if not _is_better(refit, matched, points):
        return ""
    return (
        f"The sizes in the control seem to be radii: {_count(matched)} of {len(points)} tested "
        f"points are found with these sizes, {_count(refit)} with sizes doubled. The size is the "
        "diameter of a circle or the edge of a square."
    )


def _with_other_heights(survey, chunks, matched):
    """Sentence if heights belong to another system."""
    points = survey.control
    above = _above_cloud(points, [chunk for clouds in chunks.values() for chunk in clouds])
    if not np.isfinite(above) or abs(above) < survey.search_radius / 2:
        return ""
    lowered = replace(points, position=points.position - [0.0, 0.0, above])
    refit = _find(replace(survey, control=lowered), chunks)
    if not _is_better(refit, matched, points):
        return ""
    shift = above + refit.misclosure[:, 2]
    return (
        f"The height systems of control and cloud differ: {_count(refit)} of {len(points)} "
        f"tested points are found {abs(np.median(shift)):.2f} m "
        f"{'below' if np.median(shift) > 0 else 'above'} their heights (scatter "
        f"{np.std(shift):.3f} m), {_count(matched)} at their heights. Likely cause: ellipsoidal "
        "and geoid heights mixed, another vertical datum, or feet. Convert both to one height "
        "system."
    )


def _above_cloud(points, chunks):
    """Median height of points above the middle of the cloud around them. Units: m."""
    cloud = np.concatenate([np.empty((0, 3)), *(chunk.xyz for chunk in chunks)])
    near = [
        np.hypot(*(cloud[:, :2] - place[:2]).T) < SETTINGS.scanned_radius
        for place in points.position
    ]
    above = [
        place[2] - np.median(cloud[rows, 2])
        for place, rows in zip(points.position, near, strict=True)
        if rows.any()
    ]
    if above:
        return np.median(above)
    return np.nan


def _is_better(refit, matched, points):
    return _count(refit) > max(_count(matched), len(points) // 2)


def _count(matched):
    return len(set(matched.name))


def _doubt(survey, matched, near_control):
    """Sentence on targets that a quick search does not find."""
    near = near_control.near
    if not len(matched):
        return nothing_found(survey, near_control.candidates, near)
    return (
        f"A quick search found {_count(matched)} of the {len(survey.control)} surveyed points "
        f"tested, among {near.points} points ({near.intensity_range}) near them. Check kind, "
        "size and position in the control file, and the intensity of the cloud."
    )
