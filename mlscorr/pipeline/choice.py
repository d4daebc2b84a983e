"""Which trajectory, control and CRS are meant in a folder: one is taken, two are named."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from mlscorr.io.control import ControlList, holds_points, read_control_list
from mlscorr.io.folder_roles import FileRole
from mlscorr.io.las import spread_times
from mlscorr.io.las_crs import cloud_box, crs_code, crs_conflict, crs_name, stated_crs
from mlscorr.io.las_layout import LasLayout
from mlscorr.io.nearness import check_together, far_cloud
from mlscorr.io.poses import utm_zone
from mlscorr.io.projection import check_area, check_crs
from mlscorr.io.survey_sections import ControlSection, TrajectorySection
from mlscorr.io.time_systems import TimeMatch, match_times
from mlscorr.io.trajectory import TrajectoryFile, read_trajectory_file
from mlscorr.survey import Trajectory

WORLD = ("EPSG:3857", "EPSG:6933")  # project all places: latitudes come out in two ways


@dataclass(frozen=True)
class Cloud:
    """A cloud file by its header.

    Parameters
    ----------
    layout : LasLayout
    """

    layout: LasLayout

    @property
    def name(self) -> str:
        """Of the file."""
        return self.layout.path.name

    @cached_property
    def times(self) -> np.ndarray:
        """Times spread over the file, as they stand in it. Units: s."""
        return spread_times(self.layout)[1]

    def match(self, trajectory: Trajectory, setting: str = "auto") -> TimeMatch:
        """How its times become those of a trajectory; as match_times."""
        return match_times(self.name, self.times, self.layout.is_standard, trajectory, setting)


@dataclass(frozen=True)
class Drive:
    """A trajectory that covers the clouds of a folder.

    Parameters
    ----------
    path : Path
    section : TrajectorySection
    recorded : TrajectoryFile
        In the first of WORLD where it needs a CRS.
    lack : str
        The sentence of its reader where it needs a CRS.
    is_geographic : bool
    """

    path: Path
    section: TrajectorySection
    recorded: TrajectoryFile
    lack: str = ""
    is_geographic: bool = False

    def read(self, crs: str | None, accuracy: Path | None = None) -> Trajectory:
        """The trajectory in a CRS."""
        if not self.lack:
            return self.recorded.trajectory
        return read_trajectory_file(self.path, crs, accuracy, self.section).trajectory

    @property
    def zone(self) -> str:
        """EPSG code of the UTM zone of a geographic one."""
        from pyproj import Transformer

        place = np.median(self.recorded.trajectory.position[:, :2], axis=0)
        to_degrees = Transformer.from_crs(WORLD[0], "EPSG:4326", always_xy=True)
        longitude, latitude = to_degrees.transform(*place)
        return utm_zone(latitude, longitude)


def choose_trajectory(
    roles: list[FileRole], clouds: list[Cloud], given: Mapping
) -> tuple[Drive, dict[Path, str]]:
    """The trajectory that covers the clouds in time, and why others are not taken.

    Parameters
    ----------
    roles : list of FileRole
        Of files that may be trajectories, and of tables that are nothing else.
    clouds : list of Cloud
    given : mapping
        What is said under [trajectory].

    Raises
    ------
    ValueError
        Where none can be read and covers the clouds, and where several do.
    """
    drives, refusals = {}, {}
    for path in [role.path for role in roles if role.role == "trajectory"]:
        try:
            with warnings.catch_warnings(action="ignore"):  # said when the survey is read
                drive = _read_drive(path, given)
                for cloud in clouds:
                    cloud.match(drive.recorded.trajectory)
            drives[path] = drive
        except ValueError as error:
            refusals[path] = str(error)
    if len(drives) == 1:
        return next(iter(drives.values())), refusals
    if drives:
        raise ValueError(_ambiguous("trajectory", dict.fromkeys(drives, ""), clouds))
    raise ValueError(" ".join(refusals.values()) or _no_trajectory(roles))


def _no_trajectory(roles):
    """A sentence on what would be a trajectory, and on the tables that might."""
    tables = [f"{role.path.name} ({role.reason})" for role in roles if role.role == "table"]
    hint = (
        f" If it is {' or '.join(tables)}, say so, as --set 'trajectory.file = ...' and "
        "--set 'trajectory.columns.gps_time = ...' with the other columns."
    )
    return (
        "No file looks like a trajectory: add an SBET, or a table with the columns gps_time (s), "
        f"easting, northing, height, roll, pitch, heading.{hint if tables else ''}"
    )


def _read_drive(path, given):
    """Drive of a file. Raises ValueError as its reader."""
    section = TrajectorySection.model_validate({**given, "file": path.name})
    try:
        return Drive(path, section, read_trajectory_file(path, None, None, section))
    except ValueError as first:
        lack = str(first)
    if "crs" not in lack:
        raise ValueError(lack)
    files = [read_trajectory_file(path, crs, None, section) for crs in WORLD]
    places = [file.trajectory.position[:, :2] for file in files]
    return Drive(path, section, files[0], lack, not np.array_equal(*places))


def _ambiguous(what, candidates, clouds=()):
    """A sentence on several files of one role."""
    fit = f", which cover the {len(clouds)} cloud files alike" if clouds else ""
    listed = "; ".join(f"{path.name}{': ' * bool(why)}{why}" for path, why in candidates.items())
    first, key = next(iter(candidates)).name, what if "." in what else f"{what}.file"
    return (
        f"{len(candidates)} files may be the {what}{fit} ({listed.rstrip('.')}). Say which, as "
        f"--set '{key} = \"{first}\"', or move the others out of the folder."
    )


def choose_accuracy(roles: Iterable[FileRole], drive: Drive, crs: str | None) -> Path | None:
    """The accuracy file of an SBET or a POF, None without one.

    Parameters
    ----------
    roles : iterable of FileRole
        Of files that may be one.
    drive : Drive
    crs : str or None

    Raises
    ------
    ValueError
        Where several fit.
    """
    fitting = {}
    for role in roles if drive.lack and not drive.section.accuracy else ():
        try:
            drive.read(crs, role.path)
            fitting[role.path] = ""
        except ValueError:
            continue
    if len(fitting) > 1:
        raise ValueError(_ambiguous("trajectory.accuracy", fitting))
    return next(iter(fitting), None)


def choose_control(
    roles: list[FileRole], trajectory: Trajectory, given: Mapping
) -> tuple[Path | None, ControlList | None, dict[Path, str]]:
    """The control list near the trajectory, if there is one, and why others are not taken.

    Parameters
    ----------
    roles : list of FileRole
        Of lists of points, and of tables that are nothing else.
    trajectory : Trajectory
    given : mapping
        What is said under [control].

    Raises
    ------
    ValueError
        Where several may be meant, or the one can't be used as it is, or none is known to be one.
    """
    points, problems, apart = {}, {}, {}
    for path in [role.path for role in roles if role.role == "control" and holds_points(role.path)]:
        section = ControlSection.model_validate({**given, "file": path.name})
        try:
            with warnings.catch_warnings(action="ignore"):
                read = read_control_list(path, section, trajectory)
        except ValueError as error:
            problems[path] = str(error)
            continue
        try:
            check_together(path, read.control + read.check, trajectory)
            points[path] = read
        except ValueError as error:
            apart[path] = str(error)
    if len(points) + len(problems) > 1:
        raise ValueError(_ambiguous("control", dict.fromkeys(points, "can be used") | problems))
    if points:
        path, read = next(iter(points.items()))
        return path, read, apart
    if problems or apart:
        raise ValueError(" ".join((*problems.values(), *apart.values())))
    tables = [role for role in roles if role.role == "table"]
    if tables:
        raise ValueError(
            f"{tables[0].path.name} is neither a trajectory nor a list of control points: "
            f"{tables[0].reason}. Name its columns name, easting, northing, height, or move it out "
            "of the folder, if there is no control."
        )
    return None, None, {}


def choose_crs(clouds: list[Cloud], drive: Drive, given: str | None) -> tuple[str | None, str]:
    """The CRS of a folder and where it is from; None where nothing says it and nothing needs it.

    Parameters
    ----------
    clouds : list of Cloud
    drive : Drive
    given : str or None

    Raises
    ------
    ValueError
        Where clouds and trajectory disagree, or their CRS can't be used.
    """
    stated = [(cloud, stated_crs(cloud.layout)) for cloud in clouds]
    stated = [(cloud, crs) for cloud, crs in stated if crs is not None]
    if given is not None:
        crs, reason = given, "as given"
    elif stated:
        cloud, own = stated[0]
        crs, reason = crs_code(own) or own.to_wkt(), f"by the VLRs of {cloud.name}"
    elif drive.is_geographic:
        crs, reason = drive.zone, f"UTM zone of {drive.path.name}; no cloud states a CRS"
    elif drive.lack:
        raise ValueError(drive.lack)
    else:
        _check_clouds(clouds, drive.recorded.trajectory, "map coordinates", "no file states a CRS")
        return None, "no file states it"
    projected = check_crs(crs)
    for conflict in filter(None, (crs_conflict(cloud.layout, crs) for cloud in clouds)):
        raise ValueError(conflict.replace("crs of survey.toml", f"the crs {reason}"))
    trajectory = drive.read(crs)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            check_area(projected, trajectory)
        except UserWarning as warning:
            raise ValueError(
                f"The crs {crs_name(projected)} ({reason}) and the trajectory {drive.path.name} "
                f"disagree. {warning} Say which is right, as --set 'crs = \"EPSG:...\"'."
            ) from None
    _check_clouds(clouds, trajectory, crs, reason)
    return crs, f"{projected.name}, {reason}"


def _check_clouds(clouds, trajectory, crs, reason):
    """Refuse clouds far from the trajectory."""
    for cloud in clouds:
        sentence, _ = far_cloud(cloud.name, cloud_box(cloud.layout)[:, :2], trajectory)
        if sentence:
            raise ValueError(
                f"{sentence} The trajectory is taken in {crs} ({reason}); if it is not, say so, as "
                "--set 'crs = \"EPSG:...\"'."
            )
