"""Checks that a trajectory moves like a vehicle, with headings along its course."""

import warnings
from pathlib import Path

import numpy as np

from mlscorr.frames import angles_from_attitude
from mlscorr.io.settings import SETTINGS
from mlscorr.io.store import OpenPlace, OpenQuestion
from mlscorr.io.trajectories.time_systems import DAY
from mlscorr.survey import WEEK, Trajectory

GON = 0.9  # deg
SECTOR = np.radians(30.0)  # rad, width of courses in one direction


def checked_motion(path: Path, trajectory: Trajectory) -> Trajectory:
    """Return the trajectory if a vehicle can move like this: no single outlier, no jump.

    Epochs within a microsecond are merged, because our files do not separate them. At GNSS
    re-acquisition, a POS jumps by meters, so a single step may be faster than any vehicle, but not
    two consecutive ones.

    Parameters
    ----------
    path : Path
        For messages.
    trajectory : Trajectory

    Raises
    ------
    ValueError
        With the number of impossible steps, and the fastest.

    Warns
    -----
    UserWarning
        If epochs are merged; see also check_heading.
    """
    trajectory = _distinct_epochs(path, trajectory)
    length = np.linalg.norm(np.diff(trajectory.position, axis=0), axis=1)
    speed = length / np.diff(trajectory.gps_time)
    if np.ptp(trajectory.gps_time) > WEEK and speed.max() < SETTINGS.moving:
        raise ValueError(
            f"{path} lasts {np.ptp(trajectory.gps_time) / DAY:.1f} days at no more than "
            f"{speed.max():.2g} m/s: its times may be in milli- or microseconds. Give seconds."
        )
    is_fast = np.concatenate([[True], speed > SETTINGS.fastest, [True]])
    bad = is_fast[1:-1] & (is_fast[:-2] | is_fast[2:] | (length > SETTINGS.near))
    if bad.any():
        worst = int(np.argmax(np.where(bad, speed, 0.0)))
        raise ValueError(
            f"{bad.sum()} of {len(bad)} steps of {path} are faster than {SETTINGS.fastest:.0f} "
            f"m/s (fastest: {length[worst]:.1f} m at {speed[worst]:.3g} m/s, at "
            f"{trajectory.gps_time[worst]:.3f} s). An epoch is wrong, or the units are not m and "
            "s: remove it, or export the trajectory again."
        )
    check_heading(path, trajectory)
    return trajectory


def _distinct_epochs(path, trajectory):
    """Trajectory with the first of each few coincident epochs, whose speeds are noise.

    Times are compared as ``write_trajectory_csv`` writes them.
    """
    is_same = np.diff(np.round(trajectory.gps_time, 6), prepend=-np.inf) == 0
    if not is_same.any():
        return trajectory
    warnings.warn(
        f"{is_same.sum()} of {len(trajectory)} epochs of {path} are within a microsecond of the "
        f"one before (first: {trajectory.gps_time[np.argmax(is_same)]:.6f} s). They were omitted.",
        stacklevel=5,
    )
    return Trajectory.concatenate([trajectory.select(~is_same)])


def check_units(path: Path, gps_time: np.ndarray, position: np.ndarray, angles: np.ndarray) -> None:
    """Refuse radians and gon in columns of degrees, judged by the course over ground.

    Parameters
    ----------
    path : Path
        For messages.
    gps_time : (n,) array
        Units: s.
    position, angles : (n, 3) array
        Easting, northing, height (m); roll, pitch, heading (deg).

    Raises
    ------
    ValueError
        If headings match the course as radians or gon, but not as degrees.
    """
    heading, course = heading_and_course(gps_time, position, angles[:, 2])
    if len(course) < SETTINGS.course_epochs:
        return
    degrees = np.degrees(median_difference(np.radians(heading), course))
    radians = np.degrees(median_difference(heading, course))
    tolerance = SETTINGS.course_tolerance
    if np.abs(angles).max() <= 2 * np.pi and radians < tolerance <= degrees:
        raise OpenQuestion(
            f"The angles of {path} seem to be in radians: none exceeds 2 pi, and the heading "
            f"agrees with the course over ground to {radians:.1f} deg as radians, to "
            f'{degrees:.1f} deg as degrees. If so, set angles = "rad" under [trajectory] in '
            "survey.toml.",
            [OpenPlace(("trajectory", "angles"), ("rad", "deg"), "unit of the angles")],
        )
    # the deviation of a rotated POS scatters like any other
    deviation = _folded(np.radians(heading) - course)
    scatter = np.degrees(np.median(np.abs(_folded(deviation - _middle(deviation)))))
    gon = np.degrees(median_difference(np.radians(GON * heading), course))
    # a rotated POS scatters like a car
    if degrees > SETTINGS.course_offset and gon < scatter / 2:
        raise OpenQuestion(
            f"The angles of {path} seem to be in gon: the heading agrees with the course over "
            f"ground to {gon:.1f} deg as gon, to {degrees:.1f} deg as degrees (medians). If so, "
            'set angles = "gon" under [trajectory] in survey.toml.',
            [OpenPlace(("trajectory", "angles"), ("gon", "deg"), "unit of the angles")],
        )


def check_heading(path: Path, trajectory: Trajectory) -> None:
    """Warn of a heading that deviates from the course over ground throughout.

    Vehicles reverse, so a heading may differ by half a turn from the course for part of the path.
    Boats and aircraft head into a current or wind, to opposite sides of the course on the way out
    and back, which cancels in the mean of opposite courses.

    Parameters
    ----------
    path : Path
        For messages.
    trajectory : Trajectory

    Warns
    -----
    UserWarning
        With the median difference.
    """
    angles = angles_from_attitude(trajectory.attitude)
    heading, course = heading_and_course(trajectory.gps_time, trajectory.position, angles[2])
    if len(course) < SETTINGS.course_epochs:
        return
    deviation = np.mod(heading - course + np.pi, 2 * np.pi) - np.pi
    usual, folded = np.degrees([np.median(np.abs(x)) for x in (deviation, _folded(deviation))])
    forward = np.mean(np.cos(deviation) > 0)
    reverses = folded < SETTINGS.course_tolerance and forward > SETTINGS.forward_share
    if usual >= SETTINGS.course_tolerance and not reverses:
        warnings.warn(
            f"The heading of {path} differs from the course over ground by {usual:.0f} deg "
            f"(median of {len(course)} epochs). Unless the vehicle drifts or reverses, the "
            "heading may not be clockwise from grid north, or easting and northing may be "
            "swapped.",
            stacklevel=5,
        )
        return
    offset, is_paired = _offset(_folded(deviation), course)
    limit = SETTINGS.course_offset if is_paired else SETTINGS.crab
    if np.abs(np.degrees(offset)) <= limit:
        return
    warnings.warn(
        f"The heading of {path} deviates from the course over ground by "
        f"{np.degrees(offset):+.1f} deg throughout (median of {len(course)} epochs): "
        f"{_cause(heading, course, is_paired)}. If it is wrong, correct it under [trajectory] in "
        "survey.toml or export it again; trajectory.csv keeps it otherwise.",
        stacklevel=5,
    )


def _cause(heading, course, is_paired):
    """Likely cause of a difference between heading and course (rad)."""
    gon = np.degrees(median_difference(GON * np.mod(heading, 2 * np.pi), course))
    if gon < SETTINGS.course_offset:
        return (
            f"its angles may be gon, with which it would agree to {gon:.1f} deg (angles = "
            '"gon"), or the POS is mounted rotated about its vertical axis'
        )
    cause = (
        "the POS may be mounted rotated about its vertical axis, or headings from true north "
        "lack the meridian convergence"
    )
    if is_paired:
        return cause
    return f"{cause}, or wind or current pushes the vehicle sideways"


def _folded(angle):
    """Angles (rad) folded to a quarter turn, which includes reversing vehicles."""
    return np.mod(angle + np.pi / 2, np.pi) - np.pi / 2


def _middle(folded):
    """Median (rad) of folded angles, for any location."""
    mean = np.angle(np.mean(np.exp(2j * folded))) / 2
    return mean + np.median(_folded(folded - mean))


def _offset(deviation, course):
    """Deviation of heading from course (rad), and flag if it comes from opposite courses.

    A wind or current moves the vehicle by the same amount to opposite sides of the heading on
    opposite courses.
    """
    means = []
    for direction in np.arange(0.0, np.pi, SECTOR):
        ends = []
        for towards in (direction, direction + np.pi):
            rows = np.cos(course - towards) > np.cos(SECTOR)
            if rows.sum() >= SETTINGS.course_epochs:
                ends.append(_middle(deviation[rows]))
        if len(ends) == 2:
            means.append(ends[0] + _folded(ends[1] - ends[0]) / 2)
    if means:
        return _middle(np.array(means)), True
    return _middle(deviation), False


def heading_and_course(
    gps_time: np.ndarray, position: np.ndarray, heading: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Heading as in the file, and course, at epochs with a moving vehicle.

    Parameters
    ----------
    gps_time, heading : (n,) array
        Units: s; any.
    position : (n, 3) array
        Units: m.

    Returns
    -------
    heading, course : (m,) array
        Course in rad, clockwise from north.
    """
    steps = np.diff(gps_time)
    if len(steps) == 0 or (steps <= 0).any():  # Trajectory reports the fault
        return np.empty(0), np.empty(0)
    stride = max(1, round(SETTINGS.baseline / np.median(steps)))
    start = np.arange(0, len(gps_time) - stride)
    end = np.arange(stride, len(gps_time))
    moved = position[end] - position[start]
    seconds = gps_time[end] - gps_time[start]
    distance = np.hypot(moved[:, 0], moved[:, 1])
    moving = distance > SETTINGS.moving * np.maximum(seconds, SETTINGS.baseline)
    moving &= seconds < 10 * stride * np.median(steps)  # not across a gap
    return heading[start + stride // 2][moving], np.arctan2(moved[:, 0], moved[:, 1])[moving]


def median_difference(heading: np.ndarray, course: np.ndarray) -> float:
    """Median of the absolute differences of two directions. Units: rad.

    Parameters
    ----------
    heading, course : (m,) array
        Units: rad.
    """
    return np.median(np.abs(np.mod(heading - course + np.pi, 2 * np.pi) - np.pi))
