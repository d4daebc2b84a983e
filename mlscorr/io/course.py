"""Whether a trajectory moves as a vehicle does, and heads where it goes."""

import warnings
from pathlib import Path

import numpy as np

from mlscorr.io.open_places import OpenPlace, OpenQuestion
from mlscorr.io.settings import SETTINGS
from mlscorr.io.time_systems import DAY, WEEK
from mlscorr.survey import Trajectory


def checked_motion(path: Path, trajectory: Trajectory) -> Trajectory:
    """The trajectory, where a vehicle can move so: no lone epoch far off, no leap of a distance.

    Epochs that come within a microsecond are one, as no file of ours tells them apart.

    A POS that finds its satellites again falls back at once by metres, so a single step may be
    faster than any vehicle, two in turn may not.

    Parameters
    ----------
    path : Path
        For messages.
    trajectory : Trajectory

    Raises
    ------
    ValueError
        Counts the steps that no vehicle makes, and names the fastest.

    Warns
    -----
    UserWarning
        Where epochs are taken as one.
    """
    trajectory = _distinct_epochs(path, trajectory)
    length = np.linalg.norm(np.diff(trajectory.position, axis=0), axis=1)
    speed = length / np.diff(trajectory.gps_time)
    if np.ptp(trajectory.gps_time) > WEEK and speed.max() < SETTINGS.moving:
        raise ValueError(
            f"{path} lasts {np.ptp(trajectory.gps_time) / DAY:.1f} days, and is never faster than "
            f"{speed.max():.2g} m/s: its times may be in milli- or microseconds. Give seconds."
        )
    is_fast = np.concatenate([[True], speed > SETTINGS.fastest, [True]])
    bad = is_fast[1:-1] & (is_fast[:-2] | is_fast[2:] | (length > SETTINGS.near))
    if bad.any():
        worst = int(np.argmax(np.where(bad, speed, 0.0)))
        raise ValueError(
            f"{bad.sum()} of {len(bad)} steps of {path} are faster than {SETTINGS.fastest:.0f} "
            f"m/s, which no vehicle is (fastest: {length[worst]:.1f} m at {speed[worst]:.3g} m/s, "
            f"at {trajectory.gps_time[worst]:.3f} s): an epoch is wrong, or the units are not m "
            "and s. Remove it, or export the trajectory anew."
        )
    return trajectory


def _distinct_epochs(path, trajectory):
    """The trajectory with the first of each few epochs that are one; a speed between them is noise.

    Times are compared as ``write_trajectory_csv`` writes them.
    """
    is_same = np.diff(np.round(trajectory.gps_time, 6), prepend=-np.inf) == 0
    if not is_same.any():
        return trajectory
    warnings.warn(
        f"{is_same.sum()} of {len(trajectory)} epochs of {path} come within a microsecond of the "
        f"one before (first: {trajectory.gps_time[np.argmax(is_same)]:.6f} s): they are left out.",
        stacklevel=5,
    )
    return Trajectory.concatenate([trajectory.select(~is_same)])


def check_heading(
    path: Path, gps_time: np.ndarray, position: np.ndarray, angles: np.ndarray
) -> None:
    """Compare the heading with the course over ground where the vehicle moves.

    Radians in a column of degrees are refused; a heading that fits the course neither way is
    warned of only: boats drift and vehicles reverse.

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
        For radians.

    Warns
    -----
    UserWarning
        Where heading and course differ.
    """
    heading, course = heading_and_course(gps_time, position, angles[:, 2])
    if len(course) < 10:
        return
    misfit = median_difference(np.radians(heading), course)
    tolerance = np.radians(SETTINGS.course_tolerance)
    if misfit < tolerance:
        return
    if np.abs(angles).max() <= 2 * np.pi and median_difference(heading, course) < tolerance:
        raise OpenQuestion(
            f"The angles of {path} seem to be radians where degrees belong: none exceeds 2 pi, "
            f"and the heading fits the course over ground to "
            f"{np.degrees(median_difference(heading, course)):.1f} deg when taken as radians, "
            f"to {np.degrees(misfit):.1f} deg when taken as degrees. If so, write "
            'angles = "rad" under [trajectory] in survey.toml.',
            [OpenPlace(("trajectory", "angles"), ("rad", "deg"), "unit of the angles")],
        )
    warnings.warn(
        f"The heading of {path} differs from the course over ground by {np.degrees(misfit):.0f} "
        f"deg (median of {len(course)} epochs). Unless the vehicle drifts or reverses, the heading "
        "may not be clockwise from grid north, or easting and northing may be swapped.",
        stacklevel=4,
    )


def heading_and_course(
    gps_time: np.ndarray, position: np.ndarray, heading: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Heading as it stands in the file, and course, at epochs where the vehicle moves.

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
    if len(steps) == 0 or (steps <= 0).any():  # Trajectory says what is wrong
        return np.empty(0), np.empty(0)
    stride = max(1, round(SETTINGS.baseline / np.median(steps)))
    start, end = np.arange(0, len(gps_time) - stride), np.arange(stride, len(gps_time))
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
