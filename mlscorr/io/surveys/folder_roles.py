"""Roles of the files in a folder, from their contents: clouds, trajectories, control, meshes."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from mlscorr.io.clouds import announced_faces, read_layout
from mlscorr.io.settings import SETTINGS
from mlscorr.io.store import folders_below, listed
from mlscorr.io.tables import (
    CONTROL_NAMES,
    NUMBER,
    TRAJECTORY_NAMES,
    find_layout,
    find_meanings,
    lacking,
    likely_header,
    unnamed_columns,
)
from mlscorr.io.trajectories import (
    COLUMNS,
    POF_SUFFIX,
    POQ_SUFFIX,
    POSITION_SUFFIX,
    QUATERNION,
    SBET_FIELDS,
    SMRMSG_FIELDS,
    count_on,
    position_file,
    tum_columns,
)

Role = Literal["cloud", "trajectory", "accuracy", "control", "reference", "table", "none"]
CLOUDS = (".las", ".laz", ".e57")
MESHES = (".ply",)
TABLES = (".csv", ".txt", ".xlsx", ".asc", ".dat", ".tsv")
OTHER_WORKBOOKS = (".xls", ".ods")
TRAJECTORIES = (".sbet", ".trj", ".tum", POF_SUFFIX, ".pofx", POSITION_SUFFIX)
RECORDS = (".out", ".smrmsg", ".bin")
RESULTS = ("report.json", "calibration.json", "targets.json", "ties.json")
SIMULATED = "a simulated survey of its own"
LEFT_OUT = {"truth.json": SIMULATED, **dict.fromkeys(RESULTS, "results of a run")}


@dataclass(frozen=True)
class FileRole:
    """Role of a file in a survey, and the reason.

    Parameters
    ----------
    path : Path
    role : str
        Role suggested by its contents; ``table`` for any other table.
    reason : str
    """

    path: Path
    role: Role
    reason: str


def sort_files(folder: Path) -> list[FileRole]:
    """Find the roles of files in a folder and in subfolders without results or another survey.

    Parameters
    ----------
    folder : Path

    Returns
    -------
    list of FileRole
    """
    left_out: list[FileRole] = []

    def is_wanted(place):
        reasons = [reason for name, reason in LEFT_OUT.items() if (place / name).exists()]
        left_out.extend(FileRole(place, "none", reason) for reason in reasons[:1])
        return not reasons

    places = list(folders_below(folder, SETTINGS.folder_depth, is_wanted))
    files = [path for place in places for path in sorted(place.iterdir()) if path.is_file()]
    roles = [_role(path) for path in files if path.name[0] not in ".~" and path.suffix != ".toml"]
    return roles + left_out


def _role(path) -> FileRole:
    """Role of one file from its suffix and its first bytes."""
    suffix = path.suffix.lower()
    if suffix in CLOUDS:
        return _cloud(path)
    if suffix in MESHES:
        if announced_faces(path):
            return FileRole(path, "reference", "a mesh")
        return _cloud(path)
    if suffix in TRAJECTORIES:
        return FileRole(path, "trajectory", f"its suffix is {path.suffix}")
    if suffix == POQ_SUFFIX:
        return FileRole(path, "accuracy", f"its suffix is {path.suffix}")
    if suffix in TABLES:
        return FileRole(path, *_table(path))
    if suffix in RECORDS:
        return next(_records(path), FileRole(path, "none", "no whole records of SBET or smrmsg"))
    if suffix in OTHER_WORKBOOKS:
        return FileRole(path, "table", "a workbook, readable once saved as .xlsx")
    return FileRole(path, "none", "not a file that survey.toml uses")


def _cloud(path):
    """Role of a cloud, or none with the fault in it."""
    try:
        layout = read_layout(path)
    except ValueError as error:
        return FileRole(path, "none", str(error))
    return FileRole(path, "cloud", f"{layout.points} points in format {layout.point_format}")


def _records(path) -> Iterator[FileRole]:
    """Yield possible roles of a headerless file of float64, complete or truncated, from its
    values.
    """
    size = path.stat().st_size
    sbet = 8 * len(SBET_FIELDS)
    if not size % sbet and _is_timed(path, SBET_FIELDS, 2 * np.pi):
        yield FileRole(path, "trajectory", "whole SBET records with increasing times")
    if not size % (8 * len(SMRMSG_FIELDS)) and _is_timed(path, SMRMSG_FIELDS, np.inf):
        yield FileRole(path, "accuracy", "whole smrmsg records with increasing times")
    if size > 2 * sbet and _is_timed(path, SBET_FIELDS, 2 * np.pi):  # its reader reports the rest
        yield FileRole(path, "trajectory", "truncated SBET records with increasing times")


def _is_timed(path, fields, limit):
    """True if a file starts with records with increasing times and positions within a limit."""
    values = np.fromfile(path, "<f8", 100 * len(fields))
    table = values[: len(values) // len(fields) * len(fields)].reshape(-1, len(fields))
    if not len(table) or not np.isfinite(table).all():
        return False
    is_timed = (np.diff(count_on(table[:, 0])[0]) > 0).all()
    return bool(is_timed and np.abs(table[:, 1:3]).max() <= limit)


def _table(path) -> tuple[Role, str]:
    """Role of a table from the names of its columns, or from numbers without names."""
    header = likely_header(path, TRAJECTORY_NAMES)
    driven = set(find_meanings(header, TRAJECTORY_NAMES))
    is_oriented = len(driven & {"roll", "pitch", "heading"}) > 1 or set(QUATERNION) <= driven
    if is_oriented or ("gps_time" in driven and position_file(path)):  # its reader names the gap
        return "trajectory", f"columns {', '.join(sorted(driven))}"
    if find_layout(path, {}, lambda _: ["gps_time"], {}, tum_columns) is not None:
        return "trajectory", "rows of eight numbers, such as time, position and quaternion"
    if find_layout(path, {}, lambda _: ["gps_time"], {}, _unnamed_epoch) is not None:
        return "table", "rows of numbers without column names, as in a trajectory"
    header = likely_header(path, CONTROL_NAMES)
    surveyed = set(find_meanings(header, CONTROL_NAMES))
    if "name" in surveyed and ({"easting", "northing"} <= surveyed or {"x", "y"} <= surveyed):
        return "control", f"columns {', '.join(sorted(surveyed))}"
    try:  # in other encodings, or without names
        if find_layout(path, CONTROL_NAMES, lacking, {}, unnamed_columns) is not None:
            return "control", "rows of a name and three coordinates"
    except ValueError as error:  # has the columns, but is ambiguous
        return "control", str(error)
    if len(header) > 1 and (len(driven | surveyed) > 1 or path.suffix.lower() == ".csv"):
        return "table", f"its columns are {listed(header, SETTINGS.named_columns)}"
    return "none", "not a table of coordinates"


def _unnamed_epoch(cells):
    """Column of times in a row of only numbers, as many as an epoch has, with fractions of s."""
    is_epoch = len(cells) >= len(COLUMNS) and all(map(NUMBER.fullmatch, cells))
    if is_epoch and not cells[0].isdecimal():
        return {"gps_time": 0}
    return {}
