"""The tasks of a project: which there are, and what the result of each depends on."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from mlscorr.io.identity import FileIdentity
from mlscorr.io.project_file import DriveParts, ProjectParts
from mlscorr.io.task_store import TaskStore, digest
from mlscorr.pipeline.clouds import WrittenClouds
from mlscorr.pipeline.project.file_tasks import (
    CloudInput,
    FindingInput,
    ReportInput,
    Tile,
    find,
    read_tile,
    report,
    write,
)
from mlscorr.pipeline.project.tasks import VERSION, Task
from mlscorr.survey import CloudFile, ControlPoints, Survey, Trajectory
from mlscorr.targets import search_radius


def tile_tasks(drive: DriveParts) -> list[Task]:
    """Tasks that read the headers of a drive's clouds.

    Parameters
    ----------
    drive : DriveParts
    """
    parts, whole = drive.parts, drive.trajectory
    ends = Trajectory(whole.gps_time[[0, -1]], whole.position[[0, -1]], whole.attitude[[0, -1]])
    tasks = []
    for path in parts.files.clouds:
        inputs = path, ends, parts.system, parts.settings.crs
        key, name = digest(VERSION, FileIdentity.of(path), *inputs), task_name(drive.name, path)
        tasks.append(Task("tiles", key, drive.name, name, 0, read_tile, inputs))
    return tasks


def task_name(drive: str, file: Path | CloudFile) -> str:
    """Name of a task of one file.

    Parameters
    ----------
    drive : str
    file : Path or CloudFile
    """
    return f"{drive}/{file.name}"


@dataclass(frozen=True)
class PlannedDrive:
    """A drive whose clouds are known by their headers.

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


def planned_drive(project: ProjectParts, drive: DriveParts, tiles: Sequence[Tile]) -> PlannedDrive:
    """A drive with the clouds that can be read, and with the surveyed points near them.

    Parameters
    ----------
    project : ProjectParts
    drive : DriveParts
    tiles : sequence of Tile

    Raises
    ------
    ValueError
        As SurveyParts.survey.
    """
    survey = drive.parts.survey([(tile.file, tile.note) for tile in tiles])
    boxes = {tile.file.path: tile.box for tile in tiles}
    notes = [*survey.notes, *drive.notes, *filter(None, [project.layout])]
    survey = replace(
        survey,
        control=near_boxes(survey, project.control, boxes.values()),
        check=near_boxes(survey, project.check, boxes.values()),
        notes=tuple(notes),
        inputs=(*survey.inputs, *project.inputs),
    )
    return PlannedDrive(survey, boxes, {path: FileIdentity.of(path) for path in boxes})


def near_boxes(survey: Survey, points: ControlPoints, boxes: Iterable[np.ndarray]) -> ControlPoints:
    """The surveyed points whose images may lie in boxes that headers state.

    Parameters
    ----------
    survey : Survey
        How far away they may lie.
    points : ControlPoints
    boxes : iterable of (2, 3) arrays
        Where a box can't be, all points are near it. Units: m.
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
    """Tasks that look for targets and ties in a drive's clouds.

    Surveyed points far from a file, their roles and their sigmas don't change what it holds.

    Parameters
    ----------
    store : TaskStore
        In which the drive is kept, for the tasks.
    drive : PlannedDrive
    origin : (3,) array
        Units: m.
    with_ties : bool
    """
    survey = drive.survey
    bare = replace(
        survey, control=survey.control[[]], check=survey.check[[]], notes=(), layouts=(), inputs=()
    )
    core = digest(VERSION, survey.trajectory, survey.pos, survey.search_radius)
    kept = digest(core, survey.clouds, survey.mounting, survey.scanner, survey.scanners)
    store.put("drives", kept, bare)
    tasks = []
    for file in survey.clouds:
        own, identity = survey.of(file), drive.identities[file.path]
        near = near_boxes(survey, survey.surveyed, [drive.boxes[file.path]])
        near = near[np.argsort(np.array(near.name, dtype=str), kind="stable")]
        inputs = FindingInput(store.folder, kept, file, identity, near, origin, with_ties)
        where = near.name, near.position, near.kind, near.size, near.normal
        given = identity, file.time_constant, file.point_source_ids, own.mounting, own.scanner
        key = digest(core, *given, *where, origin, with_ties)
        name = task_name(survey.name, file)
        tasks.append(Task("findings", key, survey.name, name, file.points, find, (inputs,)))
    return tasks


def cloud_tasks(
    store: TaskStore, drive: PlannedDrive, motion: str, target: Path, with_sigma: bool
) -> list[Task]:
    """Tasks that write a drive's corrected clouds.

    Parameters
    ----------
    store : TaskStore
    drive : PlannedDrive
    motion : str
        Key of the drive's DriveMotion in the store.
    target : Path
        Folder of the drive's results.
    with_sigma : bool
    """
    tasks = []
    for path in drive.survey.cloud_paths:
        own = [file for file in drive.survey.clouds if file.path == path]
        identity, name = drive.identities[path], task_name(drive.survey.name, path)
        inputs = CloudInput(store.folder, motion, path, identity, target, with_sigma)
        parts = [(file.time_constant, file.point_source_ids) for file in own]
        key = digest(VERSION, motion, parts, path.name, identity, with_sigma)
        points = sum(file.points for file in own)
        tasks.append(Task("clouds", key, drive.survey.name, name, points, write, (inputs,)))
    return tasks


def report_task(inputs: ReportInput, drive: PlannedDrive) -> Task:
    """The task that reports on a drive.

    Parameters
    ----------
    inputs : ReportInput
    drive : PlannedDrive
    """
    written: WrittenClouds = inputs.written
    key = digest(VERSION, inputs.corrected, written, inputs.page, inputs.trajectories)
    points = drive.survey.points if inputs.page else 0
    return Task("reports", key, drive.survey.name, drive.survey.name, points, report, (inputs,))
