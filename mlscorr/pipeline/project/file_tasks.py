"""Tasks on points: pure functions of one file and small values, with files as results."""

import shutil
from collections.abc import Collection, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from mlscorr.io.clouds import Additions, cloud_box, count_sources, read_layout
from mlscorr.io.store import FileIdentity, TaskStore, make_folder, publish
from mlscorr.io.surveys import cloud_file
from mlscorr.pipeline.clouds import WrittenClouds, write_counted
from mlscorr.pipeline.corrected_survey import CorrectedSurvey
from mlscorr.pipeline.file_finding import FileFinding, find_in_file
from mlscorr.pipeline.finding import silent
from mlscorr.pipeline.project.settings import SETTINGS
from mlscorr.pipeline.project.tasks import Written
from mlscorr.survey import CloudFile, ControlPoints, Survey, Trajectory


@dataclass(frozen=True)
class Tile:
    """Cloud file described by its header.

    Parameters
    ----------
    file : CloudFile
    note : str
        Note on its times.
    box : (2, 3) array
        Corners in its header. Units: m.
    """

    file: CloudFile
    note: str
    box: np.ndarray


@dataclass(frozen=True)
class TileOwner:
    """Drive with points in a cloud file.

    Parameters
    ----------
    name : str
    ends : Trajectory
        Its first and last epoch.
    system, crs, noise_classes
        See cloud_file.
    ids : tuple of int or None
        The point_source_ids of its points; None if it has all points of the file.
    """

    name: str
    ends: Trajectory
    system: str
    crs: str | None
    ids: tuple[int, ...] | None
    noise_classes: tuple[int, ...]


def read_tile(path: Path, owners: Sequence[TileOwner]) -> dict[str, Tile]:
    """Read a cloud file's header and some of its times, for each drive with points in it.

    Parameters
    ----------
    path : Path
    owners : sequence of TileOwner
        One without IDs, or several with different ones.

    Raises
    ------
    ValueError
        See cloud_file; also for points without a drive.
    """
    layout = read_layout(path)
    box = cloud_box(layout)
    counts = None
    if owners[0].ids is not None:
        counts = count_sources(layout)
        every = [number for owner in owners for number in owner.ids or ()]
        if len(other := np.setdiff1d(np.flatnonzero(counts), every)):
            raise ValueError(
                f"{counts[other].sum()} of the {layout.points} points of {path} have a "
                f"point_source_id that belongs to no drive (first: {other[0]}). Add it to the "
                "point_source_ids of the [[drive]] that measured these points."
            )
    tiles = {}
    for owner in owners:
        if counts is None:
            points = layout.points
        else:
            points = int(counts[list(owner.ids or ())].sum())
        if points:
            given = owner.ends, owner.system, owner.crs, owner.ids, owner.noise_classes
            file, note = cloud_file(path, *given)
            tiles[owner.name] = Tile(replace(file, points=points), note, box)
    return tiles


def refuse(drive: str, ids: Sequence[int], files: Sequence[CloudFile]) -> None:
    """Raise the error of a drive without points, as the task of such a drive.

    Parameters
    ----------
    drive : str
    ids : sequence of int
        The point_source_ids missing in all of its files.
    files : sequence of CloudFile
        Parts of its files that belong to other drives.

    Raises
    ------
    ValueError
    """
    there = sorted({number for file in files for number in file.point_source_ids or ()})
    own, others = (", ".join(map(str, numbers)) for numbers in (ids, there))
    raise ValueError(
        f"None of the {sum(file.points for file in files)} points in the files of drive {drive} "
        f"has its point_source_id ({own}); they have {others}. Correct the point_source_ids of "
        "its [[drive]], or remove them."
    )


@lru_cache(maxsize=SETTINGS.cached)
def _kept(folder: Path, kind: str, key: str) -> Any:
    """Result that many tasks need, cached."""
    return TaskStore(folder).get(kind, key)


def find(
    file: CloudFile,
    folder: Path,
    drive: str,
    identity: FileIdentity,
    surveyed: ControlPoints,
    origin: np.ndarray,
    with_ties: bool,
) -> FileFinding:
    """Find targets and ties in a cloud file.

    Parameters
    ----------
    file : CloudFile
    folder : Path
        Folder of the store.
    drive : str
        Key of the drive's Survey in the store, without surveyed points.
    identity : FileIdentity
        Identity of the file when its task was planned.
    surveyed : ControlPoints
        Points near the file.
    origin : (3,) array
        See find_in_file. Units: m.
    with_ties : bool
    """
    survey: Survey = _kept(folder, "drives", drive)
    survey = replace(survey.of(file), clouds=(file,), control=surveyed)
    contents = find_in_file(survey, origin, with_ties)
    _check_same(file.path, identity)
    return contents


def _check_same(path, identity):
    """Refuse a file that changed after its task was planned."""
    if FileIdentity.of(path) != identity:
        raise OSError(
            f"{path} changed while it was read; another program may still be writing. Run again "
            "with --resume when it is complete."
        )


def write(
    folder: Path,
    motions: tuple[str, ...],
    path: Path,
    identity: FileIdentity,
    target: Path,
    additions: Additions,
) -> Written:
    """Write the corrected copy of a file atomically.

    Parameters
    ----------
    folder : Path
        Folder of the store.
    motions : tuple of str
        Keys of the MovedClouds of each drive with points in the file.
    path : Path
    identity : FileIdentity
        Identity of the file when its task was planned.
    target : Path
        Folder of the results.
    additions : Additions
        Additions to the files.
    """
    kept = [_kept(folder, "motions", key) for key in motions]
    drives = [replace(each, survey=_of_file(each.survey, path)) for each in kept]
    with _moved_into(folder, target) as (part, outputs):
        written = write_counted(drives, part, silent("", 0), additions)
        _check_same(path, identity)
    return Written(written, tuple(outputs))


def with_clouds(survey: Survey, clouds: Collection[CloudFile]) -> Survey:
    """Return a survey with only some of its clouds.

    Parameters
    ----------
    survey : Survey
    clouds : collection of CloudFile
    """
    scanners = tuple(
        replace(scanner, clouds=tuple(file for file in scanner.clouds if file in clouds))
        for scanner in survey.scanners
    )
    return replace(survey, clouds=tuple(clouds), scanners=scanners)


def _of_file(survey, path):
    """Survey of one of its files."""
    survey = with_clouds(survey, [file for file in survey.clouds if file.path == path])
    return replace(survey, scanners=tuple(m for m in survey.scanners if m.clouds))


@contextmanager
def _moved_into(store, target):
    """Temporary folder whose files are moved into another one when complete, and their fate."""
    outputs: list[tuple[str, FileIdentity]] = []
    with TaskStore(store).part() as part:
        part.mkdir()
        try:
            yield part, outputs
            for path in sorted(path for path in part.rglob("*") if path.is_file()):
                there = target / path.relative_to(part)
                make_folder(there.parent)
                publish(path, there)
                name = there.relative_to(store.parent).as_posix()
                outputs.append((name, FileIdentity.of(there)))
        finally:
            shutil.rmtree(part, ignore_errors=True)


@dataclass(frozen=True)
class ReportInput:
    """Input of a drive's report.

    Parameters
    ----------
    folder : Path
        Folder of the store.
    corrected : str
        Key of the CorrectedSurvey in the store.
    written : WrittenClouds
        Clouds of all its files.
    target : Path
        Folder of the drive's results.
    page : bool
    trajectories, targets : tuple of str
        See CorrectedSurvey.write.
    """

    folder: Path
    corrected: str
    written: WrittenClouds
    target: Path
    page: bool
    trajectories: tuple[str, ...]
    targets: tuple[str, ...] = ()


def report(inputs: ReportInput) -> Written:
    """Write all results of a drive except its clouds.

    Parameters
    ----------
    inputs : ReportInput
    """
    corrected: CorrectedSurvey = TaskStore(inputs.folder).get("corrected", inputs.corrected)
    with _moved_into(inputs.folder, inputs.target) as (part, outputs):
        document = corrected.write_beside(
            part,
            inputs.written,
            page=inputs.page,
            trajectories=inputs.trajectories,
            targets=inputs.targets,
        )
    return Written(document, tuple(outputs))
