"""Tasks of a project, and the dependencies of their results."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from mlscorr.io.clouds import Additions
from mlscorr.io.store import FileIdentity, TaskStore, digest, resolved
from mlscorr.io.surveys import SHARED_TILES, DriveParts, ProjectParts
from mlscorr.pipeline.control_checks import check_control
from mlscorr.pipeline.project import file_tasks
from mlscorr.pipeline.project.city import AreaInput, stored_results
from mlscorr.pipeline.project.corrected import bare_survey
from mlscorr.pipeline.project.tasks import VERSION, Task
from mlscorr.survey import CloudFile, ControlPoints, Survey
from mlscorr.targets import search_radius
from mlscorr.wording import counted


def tile_tasks(project: ProjectParts) -> list[Task]:
    """Make the tasks that read the headers of all clouds, each once.

    Parameters
    ----------
    project : ProjectParts
    """
    tiles: dict[Path, tuple[Path, list[file_tasks.TileOwner]]] = {}
    for drive in project.drives:
        parts = drive.parts
        whole = drive.trajectory
        ends = whole.select([0, -1])
        given = parts.system, parts.settings.crs, drive.ids, parts.noise_classes
        owner = file_tasks.TileOwner(drive.name, ends, *given)
        for path in parts.files.clouds:
            tiles.setdefault(resolved(path), (path, []))[1].append(owner)
    tasks = []
    for path, own in tiles.values():
        try:
            identity = FileIdentity.of(path)
        except OSError:  # its task reports the reason
            identity = None
        key = digest(VERSION, identity, path, own)
        folder = _folder(own)
        name = task_name(folder, path)
        tasks.append(Task("tiles", key, folder, name, 0, file_tasks.read_tile, (path, tuple(own))))
    return tasks


def refusals(project: ProjectParts, read: Sequence[tuple]) -> list[Task]:
    """Make failing tasks for drives without points in any of their readable files.

    Parameters
    ----------
    project : ProjectParts
    read : sequence of (sequence of TileOwner, dict or None)
        Input of read_tile, and its result if it has any.
    """
    tasks = []
    for name, ids in ((drive.name, drive.ids) for drive in project.drives):
        own = [tiles for owners, tiles in read if name in [owner.name for owner in owners]]
        if None not in own and not any(name in tiles for tiles in own):
            given = name, ids, [tile.file for tiles in own for tile in tiles.values()]
            tasks.append(Task("tiles", digest(*given), name, name, 0, file_tasks.refuse, given))
    return tasks


def _folder(drives):
    """Folder for the corrected copy of a file of some drives."""
    if len(drives) == 1:
        return drives[0].name
    return SHARED_TILES


def task_name(drive: str, file: Path | CloudFile) -> str:
    """Name of a task for one file.

    Parameters
    ----------
    drive : str
    file : Path or CloudFile
    """
    return f"{drive}/{file.name}"


@dataclass(frozen=True)
class PlannedDrive:
    """Drive whose clouds are known by their headers.

    Parameters
    ----------
    survey : Survey
        With the surveyed points near its clouds.
    boxes : dict
        Corners (2, 3) of each cloud. Units: m.
    identities : dict
        FileIdentity of each cloud.
    """

    survey: Survey
    boxes: dict[Path, np.ndarray]
    identities: dict[Path, FileIdentity]

    def without(self, lost: Collection[Path]) -> PlannedDrive:
        """Return the drive without unreadable files, given by path.

        Parameters
        ----------
        lost : collection of Path
        """
        clouds = [file for file in self.survey.clouds if file.path not in lost]
        return replace(self, survey=file_tasks.with_clouds(self.survey, clouds))


def planned_drive(
    project: ProjectParts, drive: DriveParts, tiles: Sequence[file_tasks.Tile]
) -> PlannedDrive:
    """Make a drive with the readable clouds, and the surveyed points near them.

    Parameters
    ----------
    project : ProjectParts
    drive : DriveParts
    tiles : sequence of Tile

    Raises
    ------
    ValueError
        See SurveyParts.survey.
    """
    survey = drive.parts.survey([(tile.file, tile.note) for tile in tiles])
    boxes = {tile.file.path: tile.box for tile in tiles}
    notes = [*survey.notes, *drive.notes, *filter(None, [project.layout])]
    survey = replace(
        survey,
        control=near_boxes(survey, project.control, boxes.values()),
        check=near_boxes(survey, project.check, boxes.values()),
        excluded=near_boxes(survey, project.excluded, boxes.values()),
        included=project.included,
        notes=tuple(notes),
        inputs=(*survey.inputs, *project.inputs),
    )
    return PlannedDrive(survey, boxes, {path: FileIdentity.of(path) for path in boxes})


def check_control_near(project: ProjectParts, surveys: Sequence[Survey]) -> None:
    """Refuse drives without any control point near their clouds, before these are read.

    Parameters
    ----------
    project : ProjectParts
    surveys : sequence of Survey
        Surveys of planned drives.

    Raises
    ------
    ValueError
    """
    if surveys and not any(len(survey.control) for survey in surveys):
        check_control(project)
        raise ValueError(
            f"None of the {len(project.control)} control points of {project.path} (first: "
            f"{project.control.name[0]}) is near a cloud of its "
            f"{counted(len(surveys), 'drive')}, by the headers. Check that the list is complete "
            "and in the CRS of the clouds, or use --ties-only."
        )


def near_boxes(survey: Survey, points: ControlPoints, boxes: Iterable[np.ndarray]) -> ControlPoints:
    """Surveyed points whose targets may be in boxes from headers.

    Parameters
    ----------
    survey : Survey
        Its search radius is used.
    points : ControlPoints
    boxes : iterable of (2, 3) arrays
        All points are near an invalid box. Units: m.
    """
    inside = np.zeros(len(points), bool)
    margin = search_radius(survey, points)[:, None]
    for low, high in (box[:, :2] for box in boxes):
        place = points.position[:, :2]
        within = ((place >= low - margin) & (place <= high + margin)).all(axis=1)
        inside |= within if (low < high).all() else True
    return points[inside]


def finding_tasks(
    store: TaskStore, drive: PlannedDrive, origin: np.ndarray, with_ties: bool
) -> list[Task]:
    """Make the tasks that search for targets and ties in a drive's clouds.

    Distant surveyed points, and roles and sigmas of all, do not affect their keys.

    Parameters
    ----------
    store : TaskStore
        Store for the drive, for the tasks.
    drive : PlannedDrive
    origin : (3,) array
        Units: m.
    with_ties : bool
    """
    survey = drive.survey
    core = digest(VERSION, survey.trajectory, survey.pos, survey.search_radius)
    kept = digest(core, survey.clouds, survey.mounting, survey.scanner, survey.scanners)
    store.put("drives", kept, bare_survey(survey))
    tasks = []
    for file in survey.clouds:
        own = survey.of(file)
        identity = drive.identities[file.path]
        box = drive.boxes[file.path]
        near = near_boxes(survey, survey.surveyed, [box])
        near = near[np.argsort(np.array(near.name, dtype=str), kind="stable")]
        inputs = file, store.folder, kept, identity, near, origin, with_ties
        where = near.name, near.position, near.kind, near.size, near.normal
        points = file.time_constant, file.new_week, file.point_source_ids, file.noise_classes
        given = identity, *points, own.mounting, own.scanner
        key = digest(core, *given, *where, origin, with_ties)
        near_points = file.points * _share_near(survey, near, box)
        named = key, survey.name, task_name(survey.name, file)
        tasks.append(Task("findings", *named, file.points, file_tasks.find, inputs, near_points))
    return tasks


def _share_near(survey, points, box):
    """Share of a box near surveyed points, by area, summed over these."""
    low, high = box[:, :2]
    radius = search_radius(survey, points)[:, None]
    ends = np.clip([points.position[:, :2] + sign * radius for sign in (-1, 1)], low, high)
    return ((ends[1] - ends[0]) / np.maximum(high - low, 1e-9)).prod(axis=1).sum()


def cloud_tasks(
    store: TaskStore,
    drives: Sequence[PlannedDrive],
    motions: Mapping[str, str],
    out: Path,
    additions: Additions,
) -> list[tuple[Task, list[str]]]:
    """Make the tasks that write corrected clouds, each with the names of its drives.

    Parameters
    ----------
    store : TaskStore
    drives : sequence of PlannedDrive
    motions : mapping
        Keys of each drive's MovedClouds in the store.
    out : Path
        Folder of the project's results.
    additions : Additions
    """
    owners: dict[Path, list[PlannedDrive]] = {}
    for drive in drives:
        for path in drive.survey.cloud_paths:
            owners.setdefault(path, []).append(drive)
    tasks = []
    for path, own in owners.items():
        surveys = [drive.survey for drive in own]
        identity = own[0].identities[path]
        folder = _folder(surveys)
        used = tuple(motions[survey.name] for survey in surveys)
        files = [[file for file in survey.clouds if file.path == path] for survey in surveys]
        parts = [
            [
                (file.time_constant, file.new_week, file.point_source_ids, file.noise_classes)
                for file in some
            ]
            for some in files
        ]
        key = digest(VERSION, used, parts, path.name, identity, additions)
        points = sum(file.points for some in files for file in some)
        inputs = store.folder, used, path, identity, out / folder, additions
        named = key, folder, task_name(folder, path)
        task = Task("clouds", *named, points, file_tasks.write, inputs)
        tasks.append((task, [survey.name for survey in surveys]))
    return tasks


def area_tasks(store: TaskStore, key: str, areas: Iterable[AreaInput]) -> list[Task]:
    """Make the tasks that estimate areas.

    Parameters
    ----------
    store : TaskStore
        Store for the contents of each area, for the tasks.
    key : str
        Key of all dependencies.
    areas : iterable of AreaInput
    """
    tasks = []
    for number, area in enumerate(areas, start=1):
        own = digest(key, number, area.area)
        store.put("pieces", own, area)
        given = store.folder, own
        tasks.append(Task("areas", own, "", f"area {number}", area.features, stored_results, given))
    return tasks


def report_task(inputs: file_tasks.ReportInput, drive: PlannedDrive) -> Task:
    """Make the task that reports on a drive.

    Parameters
    ----------
    inputs : ReportInput
    drive : PlannedDrive
    """
    key = digest(
        VERSION, inputs.corrected, inputs.written, inputs.page, inputs.trajectories, inputs.targets
    )
    points = drive.survey.points if inputs.page else 0
    name = drive.survey.name
    return Task("reports", key, name, name, points, file_tasks.report, (inputs,))
