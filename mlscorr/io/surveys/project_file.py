"""project.toml: several drives, one control list, and settings common to all of them."""

import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator
from scipy.spatial.transform import Rotation

from mlscorr.io.clouds import find_copies
from mlscorr.io.store import (
    TomlSection,
    as_path,
    input_file,
    is_folder,
    is_there,
    read_bytes,
    read_toml,
    resolved,
    sibling,
)
from mlscorr.io.surveys import survey_sections
from mlscorr.io.surveys.survey_file import (
    SurveyParts,
    read_parts,
    read_survey_file,
    read_surveyed,
    survey_toml,
)
from mlscorr.io.surveys.survey_paths import (
    SurveyPaths,
    check_distinct,
    existing,
    files_of,
    matching,
)
from mlscorr.io.surveys.survey_sections import CloudSection, SurveyFile
from mlscorr.io.tables import NOTHING_SURVEYED
from mlscorr.io.trajectories import check_crs, check_systems
from mlscorr.survey import ControlPoints, InputFile, SurveyFileError, Trajectory, choosing

FOLDER_NAME = re.compile(r"[^\\/:*?\"<>|\x00-\x1f.][^\\/:*?\"<>|\x00-\x1f]*")  # on any system
SHARED_TILES = "tiles"  # folder of corrected files shared by several drives
RESERVED = ("tasks", SHARED_TILES, "log.txt", "project.json", "project.html")  # next to the drives
FILE_NAME = "project.toml"
BELIEFS = ("pos", "matching", "ties")  # sections that apply to all drives
SHARED = ("mounting", "scanner", *BELIEFS)  # and those that apply to drives without their own


class TilesSection(TomlSection):
    """All cloud files of the project, their time system, and their noise classes."""

    files: Annotated[list[str], Field(min_length=1)] | None = None
    gps_time: Literal["auto", "week", "standard"] = "auto"
    noise_classes: survey_sections.NoiseClasses


class DriveSection(TomlSection):
    """Drive given by a survey.toml, or by files and a trajectory."""

    name: Annotated[str, Field(min_length=1)] | None = None
    survey: str | None = None
    files: Annotated[list[str], Field(min_length=1)] | None = None
    point_source_ids: Annotated[list[survey_sections.PointSource], Field(min_length=1)] | None = (
        None
    )
    trajectory: survey_sections.Trajectories | None = None
    mounting: survey_sections.CalibratedMountingSection | None = None
    scanner: survey_sections.Scanners | None = None

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        own = ("files", "trajectory", "mounting", "scanner")
        given = [name for name in own if getattr(self, name) is not None]
        if self.survey is not None and given:
            raise ValueError(
                f"a drive has either a survey.toml or its own {given[0]}, not both. Move it into "
                "survey.toml"
            )
        if self.survey is None and (self.files is None or self.trajectory is None):
            raise ValueError(
                "a drive needs survey (a survey.toml), or files and [drive.trajectory]"
            )
        return self


class ProjectFile(survey_sections.CommonSections):
    """Contents of project.toml, in its own units (deg)."""

    cloud: TilesSection = TilesSection()
    drive: Annotated[list[DriveSection], Field(min_length=1)]

    @model_validator(mode="after")
    def _names_drives(self) -> Self:
        names = [name for name, _ in self.drives]
        count = Counter(map(str.casefold, names))
        if doubled := [name for name, number in count.items() if number > 1]:
            raise ValueError(
                f"the {len(names)} [[drive]] need unique names, because each is a result folder: "
                f"{len(doubled)} names are repeated (first: {doubled[0]})"
            )
        if wrong := [n for n in names if n.casefold() in RESERVED or not FOLDER_NAME.fullmatch(n)]:
            raise ValueError(
                f"{len(wrong)} of the {len(names)} drives have a name that can't be a folder "
                f"name (first: {wrong[0]!r})"
            )
        return self

    @property
    def drives(self) -> list[tuple[str, DriveSection]]:
        """Name and section of each [[drive]]; by default the name of its folder, or its number
        from 1.
        """
        return [
            (section.name or _folder(section) or f"drive-{number}", section)
            for number, section in enumerate(self.drive, start=1)
        ]


def _folder(section):
    """Name of the folder of a drive's survey.toml."""
    path = Path(section.survey or "")
    if path.suffix:
        return path.parent.name
    return path.name


class StatedDrive(NamedTuple):
    """Drive as stated by project.toml or by its survey.toml (path); otherwise like DriveParts."""

    name: str
    path: Path
    settings: SurveyFile
    files: SurveyPaths
    notes: tuple[str, ...]
    ids: tuple[int, ...] | None


class StatedProject(NamedTuple):
    """Project as stated by its project.toml."""

    path: Path
    settings: ProjectFile
    drives: tuple[StatedDrive, ...]


@dataclass(frozen=True)
class DriveParts:
    """All parts of a drive except its clouds.

    Parameters
    ----------
    name : str
    parts : SurveyParts
    notes : tuple of str
    ids : tuple of int, optional
        The point_source_ids of its points, if files also contain those of other drives.
    """

    name: str
    parts: SurveyParts
    notes: tuple[str, ...] = ()
    ids: tuple[int, ...] | None = None

    @property
    def trajectory(self) -> Trajectory:
        """Recorded trajectory."""
        return self.parts.recorded.trajectory


@dataclass(frozen=True)
class ProjectParts:
    """All parts of a project except the clouds.

    Parameters
    ----------
    name : str
    path : Path
        Path of project.toml.
    crs : str or None
    drives : tuple of DriveParts
    control, check : ControlPoints
        Points of all drives.
    layout : str or None
        Note on how their list was interpreted.
    inputs : tuple of InputFile
        project.toml and the control list.
    excluded : ControlPoints
        Control points that the user keeps out of the estimate.
    included : tuple of str
        Names of those that are used though matching or the other points contradict them.
    """

    name: str
    path: Path
    crs: str | None
    drives: tuple[DriveParts, ...]
    control: ControlPoints
    check: ControlPoints
    layout: str | None
    inputs: tuple[InputFile, ...]
    excluded: ControlPoints = NOTHING_SURVEYED.control[[]]
    included: tuple[str, ...] = ()

    @property
    def files(self) -> list[Path]:
        """All files that are read."""
        named = [*self.inputs, *(file for drive in self.drives for file in drive.parts.inputs)]
        return list(dict.fromkeys(file.path for file in named))


def is_project(path: str | Path) -> bool:
    """True for the path of a TOML file with drives, or of a folder with only project.toml.

    Parameters
    ----------
    path : path
    """
    path = as_path(path)
    if is_folder(path):
        return is_there(path / FILE_NAME) and not is_there(path / "survey.toml")
    is_named = path.name == FILE_NAME or path.name.endswith(f".{FILE_NAME}")
    is_table = path.suffix == ".toml" and is_there(path)
    return is_named or (is_table and b"[[drive" in read_bytes(path))


def read_project(project: str | Path | StatedProject) -> ProjectParts:
    """Read all of a project except its clouds.

    Parameters
    ----------
    project : path or StatedProject
        project.toml, its folder, or its contents.

    Raises
    ------
    ValueError
        For any fault in project.toml, in the files it names, or between drives.
    FileNotFoundError
        For files that aren't there.
    """
    if isinstance(project, StatedProject):
        stated = project
    else:
        stated = stated_project(project)
    path = stated.path
    settings = stated.settings
    drives = tuple(
        DriveParts(name, read_parts(toml, own, files), notes, ids)
        for name, toml, own, files, notes, ids in stated.drives
    )
    check_systems([drive.name for drive in drives], [drive.trajectory for drive in drives])
    crs = settings.crs or drives[0].parts.settings.crs
    inputs = [input_file("project", path)]
    surveyed = NOTHING_SURVEYED
    if settings.control is not None:
        file = existing(path, "control.file", settings.control.file)
        inputs.append(input_file("control", file))
        try:
            surveyed = read_surveyed(file, settings.control, _everywhere(drives), crs)
        except ValueError as error:  # the message names the section [control] of a survey
            error.args = (str(error).replace("survey.toml", path.name),)
            raise
    name = settings.name or path.parent.name
    project = ProjectParts(name, path, crs, drives, *surveyed, tuple(inputs))
    if settings.control is None:
        return project
    try:
        return choosing(project, settings.control.exclude, settings.control.include)
    except SurveyFileError as error:
        raise SurveyFileError(f"{path}: {error}") from None


def stated_project(path: str | Path) -> StatedProject:
    """Read project.toml and the survey.toml of its drives, without any data.

    Parameters
    ----------
    path : path

    Raises
    ------
    ValueError
        For any fault in these, or between them.
    FileNotFoundError
        For files that aren't there.
    """
    path = as_path(path).absolute()
    path = path / FILE_NAME if is_folder(path) else path
    settings = read_toml(path, ProjectFile, "a project")
    if settings.crs is not None:
        check_crs(settings.crs)
    drives = [_stated(path, settings, name, section) for name, section in settings.drives]
    _check_tiles(path, settings, drives)
    _check_crs_alike(path, settings, drives)
    return StatedProject(path, settings, tuple(_with_beliefs(path, drives)))


def _stated(path, settings, name, section):
    """StatedDrive of a [[drive]]."""
    toml = path
    key = f"files of [[drive]] {name}"
    notes = ()
    names = SHARED if section.survey is None else BELIEFS
    given = {n: getattr(settings, n) for n in names if n in settings.model_fields_set}
    if section.survey is None:
        own = {n: getattr(section, n) for n in ("mounting", "scanner") if getattr(section, n)}
        stated = settings.cloud.model_dump(include={"gps_time", "noise_classes"})
        files = CloudSection(files=section.files, **stated)
        given = {"name": name, "crs": settings.crs, "cloud": files} | given | own
        whole = SurveyFile(trajectory=section.trajectory, **given)
    else:
        toml = survey_toml(sibling(path, section.survey))
        key = "cloud.files"
        whole = read_survey_file(toml)
        if whole.control is not None:
            own = whole.control.file
            if settings.control is None:
                raise ValueError(
                    f"{toml} has its own [control] ({own}), and {path} has none. A project has "
                    "one list for all drives: add it to the project file."
                )
            notes = (f"Control points are those of the project, not {own}.",)
        given |= {"control": None, "name": name, "crs": whole.crs or settings.crs}
        whole = whole.model_copy(update=given)
    ids = _ids(path, name, section, whole)
    return StatedDrive(name, toml, whole, files_of(toml, whole, key), notes, ids)


def _ids(path, name, section, settings):
    """The point_source_ids of a drive; None if all points of its files belong to it."""
    ids = section.point_source_ids
    if ids is None:
        return None
    if isinstance(settings.scanner, list) and any(s.point_source_ids for s in settings.scanner):
        raise ValueError(
            f"The point_source_ids of drive {name} in {path} identify its points and those of "
            "its [[scanner]] the scanner; one id can't do both. Write the points of each "
            "scanner, or of each drive, to separate files."
        )
    return tuple(sorted(set(ids)))


def _check_tiles(path, settings, drives):
    """Refuse a tile without a drive, and one of two drives whose points cannot be separated."""
    owners: dict[Path, list[StatedDrive]] = {}
    for owner, file in ((drive, file) for drive in drives for file in drive.files.clouds):
        owners.setdefault(resolved(file), []).append(owner)
    for copy, first in find_copies(owners).items():
        both = [*owners[first], *owners[copy]]
        ids = [number for drive in both for number in drive.ids or ()]
        if len(set(ids)) < len(ids) or any(drive.ids is None for drive in both):
            raise ValueError(
                f"{copy}, of drive {owners[copy][0].name}, is a copy of {first}, of drive "
                f"{owners[first][0].name}, so all its points would count twice. Remove it from "
                f"the [[drive]] of {path} whose trajectory does not cover it."
            )
    shared = {file: own for file, own in owners.items() if len(own) > 1}
    if doubtful := [file for file, own in shared.items() if any(d.ids is None for d in own)]:
        names = " and ".join(drive.name for drive in shared[doubtful[0]])
        raise ValueError(
            f"{len(doubtful)} of {len(owners)} cloud files of {path} belong to two drives "
            f"(first: {doubtful[0]}, of {names}). List each in one [[drive]], or give each drive "
            "its point_source_ids."
        )
    for file, own in shared.items():
        number, count = Counter(number for drive in own for number in drive.ids).most_common(1)[0]
        if count > 1:
            names = " and ".join(drive.name for drive in own if number in drive.ids)
            raise ValueError(
                f"point_source_id {number} of {file} is assigned to {names} in {path}. Assign it "
                "to one drive."
            )
    if shared:
        check_distinct(path, [*shared])
    named = [f for name in settings.cloud.files or () for f in matching(path, "cloud.files", name)]
    if orphans := [file for file in named if resolved(file) not in owners]:
        raise ValueError(
            f"{len(orphans)} of {len(named)} files under [cloud] in {path} belong to no drive "
            f"(first: {orphans[0]}). List them in files of the [[drive]] whose trajectory covers "
            "them."
        )


def _check_crs_alike(path, settings, drives):
    """Refuse drives with two different CRS."""
    crs = settings.crs or drives[0].settings.crs
    if other := [drive for drive in drives if drive.settings.crs != crs]:
        raise ValueError(
            f"{len(other)} of {len(drives)} drives of {path} are in another CRS than the "
            f"project, {crs} (first: {other[0].name}, {other[0].settings.crs}). Transform their "
            "clouds to one CRS and set it in their survey.toml; an SBET is projected "
            "automatically."
        )


def _with_beliefs(path, drives):
    """Apply settings stated by some drives to all; refuse conflicting ones."""
    beliefs = {}
    for what in BELIEFS:
        stated = [drive for drive in drives if what in drive.settings.model_fields_set]
        values = [getattr(drive.settings, what) for drive in stated]
        unlike = [d.name for d, own in zip(stated, values, strict=True) if own != values[0]]
        if unlike:
            raise ValueError(
                f"[{what}] differs between {unlike[0]} and {stated[0].name}, but all "
                f"{len(drives)} drives of a project share it. Set [{what}] in {path}."
            )
        if values:
            beliefs[what] = values[0]
    for drive in drives:
        yield drive._replace(settings=drive.settings.model_copy(update=beliefs))


def _everywhere(drives):
    """Trajectory with an epoch each second that covers all positions of some drives."""
    trajectories = [drive.trajectory for drive in drives]
    rows = [np.unique(np.floor(each.gps_time), return_index=True)[1] for each in trajectories]
    positions = [each.position[some] for each, some in zip(trajectories, rows, strict=True)]
    position = np.concatenate(positions)
    number = np.arange(len(position), dtype=float)
    return Trajectory(number, position, Rotation.identity(len(position)))
