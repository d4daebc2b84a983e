"""Trajectories from CSV, SBET and foreign files, and back to CSV."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mlscorr.frames import angles_from_attitude, attitude_from_angles
from mlscorr.io.settings import SETTINGS
from mlscorr.io.store import as_path, open_file, output_file, warn_of_cut
from mlscorr.io.trajectories._course import check_units, checked_motion
from mlscorr.io.trajectories._trj import MARK
from mlscorr.io.trajectories.conventions import TrajectorySection
from mlscorr.io.trajectories.pof import POF_SUFFIX
from mlscorr.io.trajectories.sbet import is_sbet, read_riegl, read_sbet
from mlscorr.io.trajectories.trajectory_tables import (
    ATTITUDE_SIGMAS,
    COLUMNS,
    POSITION_SIGMAS,
    SESSION,
    read_table,
    read_terrascan,
)
from mlscorr.survey import Trajectory

SBET_SUFFIXES = (".sbet", ".out")
NAMED = {"file", "accuracy", "time_constant"}  # keys of any trajectory
NOTHING_GIVEN = TrajectorySection(file="")


@dataclass(frozen=True)
class TrajectoryFile:
    """Trajectory as read, and the interpretation of its file.

    Parameters
    ----------
    trajectory : Trajectory
    is_sbet : bool
    layout : str or None
        A sentence; None for an SBET and for our own columns, which need no interpretation.
    """

    trajectory: Trajectory
    is_sbet: bool
    layout: str | None = None


def read_trajectory(
    path: str | Path, crs: str | None = None, accuracy: str | Path | None = None
) -> Trajectory:
    """Read a trajectory from a .csv file, an SBET, or a foreign file.

    Parameters
    ----------
    path : path
    crs : str, optional
        Projected CRS for an SBET; a CSV is already in map coordinates.
    accuracy : path, optional
        An SBET's smrmsg or a POF's POQ; a CSV has sigmas in its own columns.

    Returns
    -------
    Trajectory
        Angles are degrees in the CSV and radians inside.

    Raises
    ------
    ValueError
        For missing columns, cells that are not numbers, times that do not increase, radians instead
        of degrees, and an unknown kind of file.

    Warns
    -----
    UserWarning
        If the heading disagrees with the course over ground.
    """
    return read_trajectory_file(path, crs, accuracy).trajectory


def read_trajectory_file(
    path: str | Path,
    crs: str | None = None,
    accuracy: str | Path | None = None,
    section: TrajectorySection = NOTHING_GIVEN,
) -> TrajectoryFile:
    """Read a trajectory file, whose kind follows from its contents, or from the suffix of a POF.

    Parameters
    ----------
    path, crs, accuracy
        See read_trajectory.
    section : TrajectorySection, optional
        Columns and conventions from survey.toml.

    Returns
    -------
    TrajectoryFile

    Raises
    ------
    ValueError, UserWarning
        See read_trajectory; also for ambiguous files.
    """
    path = as_path(path)
    with open_file(path) as file:
        start = file.read(SETTINGS.longest_line)
    if not start:
        raise ValueError(f"{path} is empty (0 bytes): copying was interrupted. Copy it again.")
    suffix = path.suffix.lower()
    if suffix == POF_SUFFIX or suffix in SBET_SUFFIXES or is_sbet(path):
        return _read_geographic(path, crs, accuracy, section, suffix == POF_SUFFIX)
    if accuracy is not None:
        raise ValueError(
            f"{path} has its own sigma columns; an accuracy file ({accuracy}) is only for an "
            "SBET or a POF."
        )
    if suffix == ".pofx":
        raise ValueError(
            f"{path} is a POFX of RIEGL, whose layout is not public. Export it as POF, SBET or "
            "text."
        )
    is_text = not start.startswith(MARK)
    is_wide = start[:2] in (b"\xff\xfe", b"\xfe\xff")  # UTF-16
    if is_text and b"\0" in start and not is_wide and path.suffix.lower() != ".csv":
        raise ValueError(
            f"{path} has an unknown format: it is not a table of text, an SBET (whole records of "
            "136 bytes, angles in radians) or a TerraScan trajectory. Export it as text or SBET."
        )
    if is_text:
        table, layout = read_table(path, section, crs)
    else:
        table, layout = read_terrascan(path, section, crs)
    trajectory = checked_motion(path, _trajectory_of(path, table))
    if is_text and not is_wide:
        warn_of_cut(path)
    return TrajectoryFile(trajectory, False, layout)


def _read_geographic(path, crs, accuracy, section, is_pof):
    """TrajectoryFile of an SBET or a POF, which have no columns or conventions."""
    given = sorted(section.model_fields_set & set(TrajectorySection.model_fields) - NAMED)
    if given:
        raise ValueError(
            f"{path} is {'a POF' if is_pof else 'an SBET'} with fixed columns and conventions: "
            f"remove {', '.join(given)} from [trajectory]."
        )
    if is_pof:
        trajectory, layout = read_riegl(path, crs, accuracy)
        return TrajectoryFile(checked_motion(path, trajectory), False, layout)
    return TrajectoryFile(checked_motion(path, read_sbet(path, crs, accuracy)), True)


def write_trajectory_csv(path: str | Path, trajectory: Trajectory) -> None:
    """Write a trajectory with its sigmas, if any: 1e-6 s, 1e-5 m, 1e-7 deg, heading from 0 to 360.

    A column session follows if time steps alone do not separate the sessions of the POS. Seconds of
    week restart where those of the input do. The file is written atomically.

    Parameters
    ----------
    path : path
    trajectory : Trajectory

    Raises
    ------
    OSError
        If the disk refuses.
    """
    angles = np.degrees(np.column_stack(angles_from_attitude(trajectory.attitude)))
    blocks = [trajectory.file_time[:, None], trajectory.position, angles]
    names = COLUMNS
    formats = ["%.6f"] + ["%.5f"] * 3 + ["%.7f"] * 3
    if trajectory.position_sigma is not None:
        blocks.append(trajectory.position_sigma)
        names = names + POSITION_SIGMAS
        formats = formats + ["%.5f"] * 3
    if trajectory.attitude_sigma is not None:
        blocks.append(np.degrees(trajectory.attitude_sigma))
        names = names + ATTITUDE_SIGMAS
        formats = formats + ["%.7f"] * 3
    if trajectory.session is not None:
        blocks.append(trajectory.session[:, None])
        names = names + SESSION
        formats = [*formats, "%d"]
    table = np.hstack(blocks)
    line = ",".join(formats) + "\n"
    with output_file(path) as part, part.open("w", encoding="utf-8", newline="\n") as file:
        file.write(",".join(names) + "\n")
        for start in range(0, len(table), 10_000):  # one format call for many rows is fast
            rows = table[start : start + 10_000]
            file.write((line * len(rows)) % tuple(rows.ravel()))


def _trajectory_of(path, table):
    """Trajectory of a table in our own columns and conventions."""
    _check_values(path, table)
    angles = np.column_stack([table[name] for name in COLUMNS[4:]])
    position = np.column_stack([table[name] for name in COLUMNS[1:4]])
    check_units(path, table["gps_time"], position, angles)

    def sigmas(names):
        if names[0] in table:
            return np.column_stack([table[name] for name in names])
        return None

    attitude_sigma = sigmas(ATTITUDE_SIGMAS)
    if attitude_sigma is not None:
        attitude_sigma = np.radians(attitude_sigma)
    session = None
    if SESSION[0] in table:
        session = table[SESSION[0]].astype(int)
    try:
        return Trajectory(
            table["gps_time"],
            position,
            attitude_from_angles(*np.radians(angles).T),
            sigmas(POSITION_SIGMAS),
            attitude_sigma,
            session,
            weeks=table.get("weeks"),
        )
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def _check_values(path, table):
    """Refuse values that are not finite, sigmas below zero, and positions without any error."""
    for name, values in table.items():
        bad = ~np.isfinite(values)
        if bad.any():
            raise ValueError(
                f"{bad.sum()} of {len(bad)} epochs of {path} have a {name} that is not a number "
                f"(first: epoch {np.argmax(bad) + 1}). Remove these epochs."
            )
        is_nothing = name in POSITION_SIGMAS and not values.any()
        if is_nothing or (name.startswith("sigma") and values.min() < 0):
            raise ValueError(
                f"{(values <= 0).sum()} of {len(values)} epochs of {path} have a {name} of 0 or "
                f"less (first: epoch {np.argmax(values <= 0) + 1}). Correct them, or remove the "
                "column to use [pos]."
            )
