"""Trajectories from CSV or SBET, and back to CSV."""

import warnings
from pathlib import Path

import numpy as np

from mlscorr.frames import angles_from_attitude, attitude_from_angles
from mlscorr.io.layouts import TableLayout
from mlscorr.io.output import output_file
from mlscorr.io.sbet import read_sbet
from mlscorr.io.settings import SETTINGS
from mlscorr.io.table_rows import read_numbers
from mlscorr.io.tables import find_columns, read_header
from mlscorr.io.text_files import warn_of_cut
from mlscorr.survey import Trajectory

COLUMNS = ("gps_time", "easting", "northing", "height", "roll", "pitch", "heading")
POSITION_SIGMAS = ("sigma_easting", "sigma_northing", "sigma_height")
ATTITUDE_SIGMAS = ("sigma_roll", "sigma_pitch", "sigma_heading")
SBET_SUFFIXES = (".sbet", ".out")


def read_trajectory(
    path: str | Path, crs: str | None = None, accuracy: str | Path | None = None
) -> Trajectory:
    """Trajectory of a .csv file, or of an SBET (.sbet, .out).

    Parameters
    ----------
    path : path
    crs : str, optional
        Projected CRS that an SBET is brought into; a CSV is in map coordinates already.
    accuracy : path, optional
        An SBET's smrmsg file; a CSV carries its sigmas in its own columns.

    Returns
    -------
    Trajectory
        Angles are degrees in the CSV and radians inside.

    Raises
    ------
    ValueError
        For missing columns, cells that are not numbers, times that don't increase, radians where
        degrees belong, and an unknown suffix.

    Warns
    -----
    UserWarning
        When the heading disagrees with the course over ground.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix in SBET_SUFFIXES:
        return _checked_motion(path, read_sbet(path, crs, accuracy))
    if suffix != ".csv":
        raise ValueError(
            f"{path} has the unknown suffix '{path.suffix}'; "
            f"a trajectory is .csv or SBET ({', '.join(SBET_SUFFIXES)})."
        )
    if accuracy is not None:
        raise ValueError(
            f"{path} has its accuracy in its own sigma columns; an accuracy file ({accuracy}) "
            "belongs to an SBET."
        )
    trajectory = _checked_motion(path, _read_csv(path))
    warn_of_cut(path)
    return trajectory


def write_trajectory_csv(path: str | Path, trajectory: Trajectory) -> None:
    """Write a trajectory with its sigmas, if any: 1e-6 s, 1e-5 m, 1e-7 deg, heading from 0 to 360.

    The file appears whole or not at all.

    Parameters
    ----------
    path : path
    trajectory : Trajectory

    Raises
    ------
    OSError
        When the disk refuses.
    """
    angles = np.degrees(np.column_stack(angles_from_attitude(trajectory.attitude)))
    blocks = [trajectory.gps_time[:, None], trajectory.position, angles]
    names, formats = COLUMNS, ["%.6f"] + ["%.5f"] * 3 + ["%.7f"] * 3
    if trajectory.position_sigma is not None:
        blocks.append(trajectory.position_sigma)
        names, formats = names + POSITION_SIGMAS, formats + ["%.5f"] * 3
    if trajectory.attitude_sigma is not None:
        blocks.append(np.degrees(trajectory.attitude_sigma))
        names, formats = names + ATTITUDE_SIGMAS, formats + ["%.7f"] * 3
    table, line = np.hstack(blocks), ",".join(formats) + "\n"
    with output_file(path) as part, part.open("w", encoding="utf-8", newline="\n") as file:
        file.write(",".join(names) + "\n")
        for start in range(0, len(table), 10_000):  # one format call for many rows is fast
            rows = table[start : start + 10_000]
            file.write((line * len(rows)) % tuple(rows.ravel()))


def _read_csv(path):
    header, lines = read_header(path)
    columns = find_columns(path, header, COLUMNS, (POSITION_SIGMAS, ATTITUDE_SIGMAS))
    numbers = read_numbers(TableLayout(Path(path), tuple(header), lines, columns, is_own=True))
    table = dict(zip(columns, numbers.T, strict=True))
    _check_values(path, table)
    angles = np.column_stack([table[name] for name in COLUMNS[4:]])
    position = np.column_stack([table[name] for name in COLUMNS[1:4]])
    _check_heading(path, table["gps_time"], position, angles)

    def sigmas(names):
        return np.column_stack([table[name] for name in names]) if names[0] in table else None

    attitude_sigma = sigmas(ATTITUDE_SIGMAS)
    try:
        return Trajectory(
            table["gps_time"],
            position,
            attitude_from_angles(*np.radians(angles).T),
            sigmas(POSITION_SIGMAS),
            None if attitude_sigma is None else np.radians(attitude_sigma),
        )
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def _check_values(path, table):
    """Refuse values that are not finite, or sigmas below zero."""
    for name, values in table.items():
        bad = ~np.isfinite(values)
        if bad.any():
            raise ValueError(
                f"{bad.sum()} of {len(bad)} epochs of {path} have a {name} that is not a number "
                f"(first: epoch {np.argmax(bad) + 1}). Remove these epochs."
            )
        if name.startswith("sigma") and values.min() < 0:
            raise ValueError(
                f"{(values < 0).sum()} of {len(values)} epochs of {path} have a negative {name} "
                f"(first: epoch {np.argmax(values < 0) + 1})."
            )


def _checked_motion(path, trajectory):
    """The trajectory, where a vehicle can move so: no lone epoch far off, no leap of a distance.

    A POS that finds its satellites again falls back at once by metres, so a single step may be
    faster than any vehicle, two in turn may not.
    """
    length = np.linalg.norm(np.diff(trajectory.position, axis=0), axis=1)
    speed = length / np.diff(trajectory.gps_time)
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


def _check_heading(path, gps_time, position, angles):
    """Compare the heading with the course over ground where the vehicle moves.

    Radians in a column of degrees are refused; a heading that fits the course neither way is
    warned of only: boats drift and vehicles reverse.
    """
    heading, course = _heading_and_course(gps_time, position, angles[:, 2])
    if len(course) < 10:
        return
    misfit = _median_difference(np.radians(heading), course)
    tolerance = np.radians(SETTINGS.course_tolerance)
    if misfit < tolerance:
        return
    if np.abs(angles).max() <= 2 * np.pi and _median_difference(heading, course) < tolerance:
        raise ValueError(
            f"The angles of {path} seem to be radians where degrees belong: none exceeds 2 pi, "
            f"and the heading fits the course over ground to "
            f"{np.degrees(_median_difference(heading, course)):.1f} deg when taken as radians, "
            f"to {np.degrees(misfit):.1f} deg when taken as degrees."
        )
    warnings.warn(
        f"The heading of {path} differs from the course over ground by {np.degrees(misfit):.0f} "
        f"deg (median of {len(course)} epochs). Unless the vehicle drifts or reverses, the heading "
        "may not be clockwise from grid north, or easting and northing may be swapped.",
        stacklevel=4,
    )


def _heading_and_course(gps_time, position, heading):
    """Heading as it stands in the file, and course (rad), at epochs where the vehicle moves."""
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


def _median_difference(heading, course):
    """Median of the absolute differences of two directions. Units: rad."""
    return np.median(np.abs(np.mod(heading - course + np.pi, 2 * np.pi) - np.pi))
