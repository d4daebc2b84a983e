"""Choice of clouds and trajectory in a folder: a single one is taken, several are listed."""

import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path

import numpy as np
from pyproj import Transformer

from mlscorr.io.clouds import LasLayout, spread_records
from mlscorr.io.store import PLACE_OF_CRS, OpenPlace, OpenQuestion, places_of
from mlscorr.io.surveys import FileRole
from mlscorr.io.trajectories import (
    SessionFile,
    Sessions,
    TimeMatch,
    TrajectorySection,
    across_week_end,
    check_systems,
    join_sessions,
    lacks_time,
    match_times,
    read_sessions,
    utm_zone,
)
from mlscorr.survey import CloudFile, Pos, Trajectory

WORLD = ("EPSG:3857", "EPSG:6933")  # project the whole world: latitudes differ between them


@dataclass(frozen=True)
class Cloud:
    """Cloud file described by its header.

    Parameters
    ----------
    layout : LasLayout
    """

    layout: LasLayout

    @property
    def name(self) -> str:
        """Name of the file."""
        return self.layout.cloud.name

    @cached_property
    def records(self) -> np.ndarray:
        """Points spread over the file; see spread_records."""
        return spread_records(self.layout)[1]

    @property
    def times(self) -> np.ndarray:
        """Times spread over the file, without the file's own offset. Units: s."""
        return self.records["gps_time"] + self.layout.time_offset

    @property
    def known_times(self) -> np.ndarray:
        """Times of points that have one. Units: s."""
        return self.times[~lacks_time(self.records["gps_time"])]

    @property
    def takes_turns(self) -> bool:
        """True if IDs of points alternate, instead of following each other as for strips."""
        ids = self.records["point_source_id"][np.argsort(self.times, kind="stable")]
        return bool(np.count_nonzero(np.diff(ids)) > 2 * (len(np.unique(ids)) - 1))

    def file(self, match: TimeMatch | None = None) -> CloudFile:
        """Return its CloudFile, with the conversion to the trajectory's times."""
        file = CloudFile(self.layout.cloud, self.layout.points, self.layout.time_offset, "")
        if match is None:
            return file
        constant = match.constant + self.layout.time_offset
        return replace(file, time_constant=constant, new_week=match.new_week)

    def match(self, trajectory: Trajectory, setting: str = "auto") -> TimeMatch:
        """Match its times with those of a trajectory; see match_times."""
        offset = self.layout.time_offset
        is_standard = self.layout.is_standard
        return match_times(self.name, self.times, is_standard, trajectory, setting, offset)


@dataclass(frozen=True)
class Drive:
    """Trajectory that covers the clouds of a folder, in one file or one per session.

    Parameters
    ----------
    paths : tuple of Path
    section : TrajectorySection
        Section of each.
    recorded : Sessions
        In the first of WORLD if it needs a CRS.
    lack : str
        Message of its reader if it needs a CRS.
    is_geographic : bool
    """

    paths: tuple[Path, ...]
    section: TrajectorySection
    recorded: Sessions
    lack: str = ""
    is_geographic: bool = False

    @property
    def name(self) -> str:
        """Names of its files."""
        return ", ".join(path.name for path in self.paths)

    def read(self, crs: str | None, accuracy: Mapping[Path, Path] | None = None) -> Trajectory:
        """Read the trajectory in a CRS, each file with its accuracy."""
        if not self.lack:
            return self.recorded.trajectory
        files = [SessionFile(p, (accuracy or {}).get(p), self.section) for p in self.paths]
        return read_sessions(files, crs, Pos()).trajectory

    @property
    def span(self) -> np.ndarray:
        """First and last time. Units: s."""
        return self.recorded.trajectory.gps_time[[0, -1]]

    @property
    def layout(self) -> tuple[object, ...]:
        """Common properties of the files of one export."""
        if self.lack:
            return self.recorded.is_sbet, self.is_geographic, self.paths[0].suffix.lower()
        return tuple(text.replace(self.name, "") for text in self.recorded.layouts)

    @property
    def zone(self) -> str:
        """EPSG code of the UTM zone of a geographic trajectory."""
        place = np.median(self.recorded.trajectory.position[:, :2], axis=0)
        to_degrees = Transformer.from_crs(WORLD[0], "EPSG:4326", always_xy=True)
        longitude, latitude = to_degrees.transform(*place)
        return utm_zone(latitude, longitude)


def choose_trajectory(
    roles: list[FileRole], clouds: list[Cloud], given: Mapping
) -> tuple[Drive, dict[Path, str]]:
    """Choose the trajectory that covers the clouds in time, with reasons against others.

    Parameters
    ----------
    roles : list of FileRole
        Roles of possible trajectories, and of otherwise unknown tables.
    clouds : list of Cloud
    given : mapping
        Given contents of [trajectory].

    Raises
    ------
    ValueError
        If no readable one covers the clouds, or several do.
    """
    drives = {}
    readable = {}
    refusals = {}
    places: list[OpenPlace] = []
    for path in [role.path for role in roles if role.role == "trajectory"]:
        try:
            with warnings.catch_warnings(action="ignore"):  # reported when the survey is read
                readable[path] = _read_drive(path, given)
                for cloud in clouds:
                    cloud.match(readable[path].recorded.trajectory)
            drives[path] = readable[path]
        except ValueError as error:
            refusals[path] = str(error)
            places += places_of(error)
    joined = [*join_drives(list(readable.values()), clouds)]
    if len(joined) == 1:
        return joined[0], {p: why for p, why in refusals.items() if p not in joined[0].paths}
    if len(drives) == 1:
        return next(iter(drives.values())), refusals
    if drives:
        raise ambiguous("trajectory", dict.fromkeys(drives, ""), clouds)
    overlap = _overlaps(list(readable.values()))
    sentence = " ".join((*overlap, *refusals.values())) or _no_trajectory(roles)
    raise OpenQuestion(sentence, places if len(refusals) == 1 else ())


def _overlaps(drives):
    """Sentence on two incomplete trajectories that overlap in time."""
    drives = sorted(drives, key=lambda drive: drive.span[0])
    for first, second in pairwise(drives):
        if (end := min(first.span[1], second.span[1])) >= second.span[0]:
            yield (
                f"{first.name} and {second.name} overlap by {end - second.span[0]:.1f} s and may "
                "come from two vehicles. Move the files of another survey out of the folder, or "
                "list both under [[trajectory]] in survey.toml (docs/survey.md)."
            )


def join_drives(drives: list[Drive], clouds: list[Cloud]) -> Iterator[Drive]:
    """Yield trajectories of one export in sequence that cover the clouds only together.

    Parameters
    ----------
    drives : list of Drive
        Each with one file.
    clouds : list of Cloud

    Yields
    ------
    Drive
        With two files or more.
    """
    for layout in dict.fromkeys(drive.layout for drive in drives):
        group = sorted((d for d in drives if d.layout == layout), key=lambda d: d.span[0])
        if any(first.span[1] >= second.span[0] for first, second in pairwise(group)):
            continue
        try:
            recorded = _joined(group).recorded
            whole = recorded.trajectory
            time = np.concatenate([c.match(whole).placed(c.known_times) for c in clouds])
        except ValueError:  # of several time systems, or all together cover the clouds in part
            continue
        used = [
            drive
            for drive, part in zip(group, recorded.parts, strict=True)
            if ((time >= part.gps_time[0]) & (time <= part.gps_time[-1])).any()
        ]
        if len(used) > 1:
            yield _joined(used)


def _joined(drives):
    """Drive of several that do not overlap."""
    names = [drive.name for drive in drives]
    parts = [drive.recorded.trajectory for drive in drives]
    check_systems(names, parts)
    parts = across_week_end(parts)
    whole = join_sessions(names, parts, Pos())[0]
    recorded = replace(drives[0].recorded, trajectory=whole, parts=tuple(parts))
    return replace(drives[0], paths=tuple(d.paths[0] for d in drives), recorded=recorded)


def _no_trajectory(roles):
    """Sentence on requirements for a trajectory, and on candidate tables."""
    tables = [f"{role.path.name} ({role.reason})" for role in roles if role.role == "table"]
    hint = (
        f" If it is {' or '.join(tables)}, add --set 'trajectory.file = ...' and --set "
        "'trajectory.columns.gps_time = ...', also for the other columns (numbers from 1 if "
        "they have no names)."
    )
    return (
        "No trajectory was recognized. Add an SBET, or a table with the columns gps_time (s), "
        f"easting, northing, height, roll, pitch, heading.{hint if tables else ''}"
    )


def _read_drive(path, given):
    """Drive of a file. Raises ValueError like its reader."""
    section = TrajectorySection.model_validate({**given, "file": path.name})
    try:
        return Drive((path,), section, read_sessions([SessionFile(path, None, section)]))
    except OpenQuestion as question:
        if PLACE_OF_CRS not in question.places:
            raise
        lack = str(question)
    files = [read_sessions([SessionFile(path, None, section)], crs) for crs in WORLD]
    places = [file.trajectory.position[:, :2] for file in files]
    return Drive((path,), section, files[0], lack, not np.array_equal(*places))


def ambiguous(
    what: str, candidates: Mapping[Path, str], clouds: Sequence[Cloud] = ()
) -> OpenQuestion:
    """Question on which of several files is meant.

    Parameters
    ----------
    what : str
        Role of the file.
    candidates : mapping
        Files with the information on each.
    clouds : sequence of Cloud
        Clouds covered by them.
    """
    if clouds:
        fit = f", which all cover the {len(clouds)} cloud files"
    else:
        fit = ""
    listed = "; ".join(f"{path.name}{': ' * bool(why)}{why}" for path, why in candidates.items())
    keys = tuple(what.split(".")) if "." in what else (what, "file")
    return OpenQuestion(
        f"{len(candidates)} files may be the {what}{fit} ({listed.rstrip('.')}). Choose one, or "
        "move the others out of the folder.",
        [OpenPlace(keys, tuple(map(str, candidates)), "file that is meant")],
    )


def choose_accuracy(roles: Iterable[FileRole], drive: Drive, crs: str | None) -> dict[Path, Path]:
    """Choose the accuracy file of each SBET or POF that has one.

    Parameters
    ----------
    roles : iterable of FileRole
        Roles of candidates.
    drive : Drive
    crs : str or None

    Raises
    ------
    ValueError
        If several fit.
    """
    roles = [*roles]
    chosen = {}
    for path in drive.paths if drive.lack and not drive.section.accuracy else ():
        fitting = {}
        for role in roles:
            try:
                read_sessions([SessionFile(path, role.path, drive.section)], crs)
                fitting[role.path] = ""
            except ValueError:
                continue
        if len(fitting) > 1:
            raise ambiguous("trajectory.accuracy", fitting)
        chosen |= dict.fromkeys([path] if fitting else [], next(iter(fitting), None))
    return chosen
