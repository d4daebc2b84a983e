"""Trajectories from CSV or SBET, and back to CSV."""

import os
import warnings
from pathlib import Path

import numpy as np

from mlscorr.io.sbet import read_sbet
from mlscorr.io.tables import ENCODING, find_columns, read_header
from mlscorr.survey import Trajectory, angles_from_attitude, attitude_from_angles

COLUMNS = ("gps_time", "easting", "northing", "height", "roll", "pitch", "heading")
POSITION_SIGMAS = ("sigma_easting", "sigma_northing", "sigma_height")
ATTITUDE_SIGMAS = ("sigma_roll", "sigma_pitch", "sigma_heading")
SBET_SUFFIXES = (".sbet", ".out")

MOVING = 1.0  # m/s, below which the course over ground says nothing of the heading
BASELINE = 0.5  # s, over which the course is taken, long against the noise of positions
COURSE_AGREES = np.radians(10.0)  # a vehicle's crab angle and sideslip stay below
COURSE_DISAGREES = np.radians(30.0)  # beyond the drift of a boat or the crab of an aircraft


def read_trajectory(path, crs=None, accuracy=None):
    """Trajectory of a .csv file, or of an SBET (.sbet, .out).

    Parameters
    ----------
    path : path
    crs : str, optional
        Projected CRS that an SBET is brought into; a CSV is in map coordinates already.
    accuracy : path, optional
        An SBET's smrmsg file; a CSV carries its sigmas in its own columns.

    Angles are degrees in the CSV and radians inside. Raises ValueError for missing columns, cells
    that are not numbers, times that don't increase, radians where degrees belong, and an unknown
    suffix. Warns when the heading disagrees with the course over ground.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix in SBET_SUFFIXES:
        return read_sbet(path, crs, accuracy)
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
    return _read_csv(path)


def write_trajectory_csv(path, trajectory):
    """Write a trajectory with its sigmas, if any: 1e-6 s, 1e-5 m, 1e-7 deg, heading from 0 to 360.

    The file appears whole or not at all.
    """
    path = Path(path)
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
    part = path.with_name(path.name + ".part")
    try:
        with part.open("w", encoding="utf-8", newline="\n") as file:
            file.write(",".join(names) + "\n")
            for start in range(0, len(table), 10_000):  # one format call for many rows is fast
                rows = table[start : start + 10_000]
                file.write((line * len(rows)) % tuple(rows.ravel()))
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)


def _read_csv(path):
    header, skip = read_header(path)
    columns = find_columns(path, header, COLUMNS, (POSITION_SIGMAS, ATTITUDE_SIGMAS))
    table = dict(zip(columns, _load(path, skip, len(header), columns.values()).T, strict=True))
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


def _load(path, skip, width, columns):
    """The wanted columns of a table of numbers: (n, k)."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*input contained no data")
        try:
            table = np.loadtxt(
                path,
                delimiter=",",
                skiprows=skip,
                usecols=tuple(columns),
                encoding=ENCODING,
                ndmin=2,
            )
        except ValueError:
            raise ValueError(_first_bad_line(path, skip, width, columns)) from None
    if not len(table):
        raise ValueError(f"{path} has a header but no epochs.")
    return table


def _first_bad_line(path, skip, width, columns):
    """A sentence on the first line that is not a row of numbers."""
    with path.open(encoding=ENCODING, errors="replace") as file:
        for number, line in enumerate(file, start=1):
            cells = line.split("#")[0].strip().split(",")
            if number <= skip or cells == [""]:
                continue
            if len(cells) <= max(columns):
                return (
                    f"Line {number} of {path} has {len(cells)} columns where the header has "
                    f"{width}: the file may have been cut off there."
                )
            for column in columns:
                try:
                    float(cells[column])
                except ValueError:
                    return (
                        f"Line {number} of {path} has '{cells[column].strip()}' "
                        f"where a number belongs (column {column + 1})."
                    )
    return f"{path} is not a table of numbers."


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


def _check_heading(path, gps_time, position, angles):
    """Compare the heading with the course over ground where the vehicle moves.

    Radians in a column of degrees are refused; a heading that fits the course neither way is
    warned of only: boats drift and vehicles reverse.
    """
    heading, course = _heading_and_course(gps_time, position, angles[:, 2])
    if len(course) < 10:
        return
    misfit = _median_difference(np.radians(heading), course)
    if misfit < COURSE_DISAGREES:
        return
    if np.abs(angles).max() <= 2 * np.pi and _median_difference(heading, course) < COURSE_AGREES:
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
    stride = max(1, round(BASELINE / np.median(steps)))
    start, end = np.arange(0, len(gps_time) - stride), np.arange(stride, len(gps_time))
    moved = position[end] - position[start]
    seconds = gps_time[end] - gps_time[start]
    moving = np.hypot(moved[:, 0], moved[:, 1]) > MOVING * np.maximum(seconds, BASELINE)
    moving &= seconds < 10 * stride * np.median(steps)  # not across a gap
    return heading[start + stride // 2][moving], np.arctan2(moved[:, 0], moved[:, 1])[moving]


def _median_difference(heading, course):
    """Median of the absolute differences of two directions. Units: rad."""
    return np.median(np.abs(np.mod(heading - course + np.pi, 2 * np.pi) - np.pi))
