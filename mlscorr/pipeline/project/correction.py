"""``correct`` of a project: from several drives to the corrected clouds and reports of all."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from mlscorr.io.clouds import Additions
from mlscorr.io.store import (
    FileIdentity,
    TaskStore,
    as_path,
    check_output,
    check_store_output,
    digest,
    is_folder,
    is_remote,
    output_file,
    remove_files,
    write_json,
)
from mlscorr.io.surveys import SHARED_TILES, ProjectParts, read_project
from mlscorr.io.trajectories import check_distinct, check_exports, check_target_exports
from mlscorr.pipeline.clouds import WrittenClouds
from mlscorr.pipeline.correction import TieUse, without_control
from mlscorr.pipeline.project import stages
from mlscorr.pipeline.project.city import project_drives
from mlscorr.pipeline.project.corrected import found_drive, motion_of
from mlscorr.pipeline.project.document import (
    ProjectResult,
    drive_result,
    older_clouds,
    older_results,
    project_document,
)
from mlscorr.pipeline.project.engine import engine
from mlscorr.pipeline.project.file_tasks import ReportInput
from mlscorr.pipeline.project.progress import Progress, logged
from mlscorr.pipeline.project.running import Run
from mlscorr.pipeline.project.tasks import VERSION
from mlscorr.survey import Statement

STORE = "tasks"  # name of the folder within the results


@dataclass(frozen=True)
class Options:
    """Options of a project's correction.

    Parameters
    ----------
    order, ties
        See mlscorr.correct.
    sigma, page, trajectories, targets, displacement
        See CorrectedSurvey.write.
    workers, scheduler
        See mlscorr.pipeline.project.engine.engine.
    resume : bool
        True to use existing results.
    overwrite : bool
        True to replace existing files.
    """

    order: int = 0
    ties: TieUse | None = None
    sigma: bool = False
    page: bool = True
    trajectories: tuple[str, ...] = ()
    targets: tuple[str, ...] = ()
    displacement: bool = False
    workers: int = 1
    scheduler: str | None = None
    resume: bool = False
    overwrite: bool = False

    @property
    def additions(self) -> Additions:
        """Return the additions to clouds."""
        return Additions(self.sigma, self.displacement)


def correct_project(
    path: str | Path | ProjectParts,
    out: str | Path,
    options: Options | None = None,
    notify: Callable[[Statement], object] = lambda _: None,
) -> ProjectResult:
    """Correct all drives of a project together, and write the results of each.

    Parameters
    ----------
    path : path or ProjectParts
        project.toml, its folder, or its contents.
    out : path
        Folder for the results: a folder of each drive, project.json, project.html, log.txt, and
        the results of tasks.
    options : Options, optional
    notify : function of a Statement
        Receives the progress; ``progress_sentence`` words it.

    Returns
    -------
    ProjectResult
        It lists failures.

    Raises
    ------
    ValueError
        For faults in project.toml or between its drives, if the folder contains anything without
        ``resume`` or ``overwrite``, or if no control point was found at all.
    OSError
        If writing fails.
    """
    options = options or Options()
    out = as_path(out).absolute()
    if isinstance(path, ProjectParts):
        project = path
    else:
        project = read_project(path)
    check_exports(options.trajectories, project.crs, is_read=True)
    check_target_exports(options.targets, project.crs, is_read=True)
    check_distinct([*options.trajectories, *options.targets])
    check_project_output(project, out, options)
    store = TaskStore(out / STORE)
    with store.locked(), logged(out / "log.txt", store.plan, notify) as progress:
        if options.overwrite and not options.resume:
            store.clear()
        with engine(options.workers, options.scheduler, progress.say) as chosen:
            run = Run(store, chosen, progress.ended, progress.say)
            result = _Work(project, out, options, run, progress).result()
        progress.note(result.document["statements"][0]["sentence"])
    return result


def check_project_output(project: ProjectParts, out: Path, options: Options) -> None:
    """Refuse an output folder that contains other results, or an input."""
    store = TaskStore(out / STORE)
    is_ours = is_folder(store.folder)
    if is_ours and not store.is_begun():
        raise ValueError(
            f"{store.folder} was not written by a run: it has no {store.plan.name}. Move it "
            "away, or choose another folder."
        )
    if is_ours and not (options.resume or options.overwrite):
        raise ValueError(
            f"{out} already contains results of a project. Process what is missing or changed "
            "with --resume, everything with --overwrite, or choose another folder."
        )
    check = check_store_output if is_remote(out) else check_output
    folders = [*(drive.name for drive in project.drives), SHARED_TILES]
    check(out, project.files, options.overwrite or (options.resume and is_ours), folders)
    for name in folders:
        check(out / name, [], overwrite=True)


@dataclass(frozen=True)
class _Work:
    """Run through all stages."""

    project: ProjectParts
    out: Path
    options: Options
    run: Run
    progress: Progress

    @property
    def ties(self) -> TieUse:
        """Use of ties."""
        first = self.project.drives[0].parts.settings
        return self.options.ties or ("auto" if first.ties.use == "auto" else "off")

    def result(self) -> ProjectResult:
        """Run the stages in order."""
        planned = self._planned()
        keys = self._estimated(planned, np.floor(planned[0].survey.trajectory.position[0]))
        clouds = self._clouds(planned, keys)
        reports = self._reports(planned, keys, clouds)
        store = self.run.store
        written = [*reports.values()]
        drives = [(store.get("states", keys[name]), own.value) for name, own in reports.items()]
        older = [*older_clouds(self.out, clouds), *older_results(store, written)]
        result = project_document(self.project, drives, self.run, older)
        write_json(self.out / "project.json", result.document)
        remove_files(self.out, "project.html")
        if self.options.page:
            from mlscorr.report import write_project

            with output_file(self.out / "project.html") as part:
                write_project(part, result.document, result.tracks)
        return result

    def _planned(self) -> list[stages.PlannedDrive]:
        """Drives with the readable clouds."""
        tasks = stages.tile_tasks(self.project)
        self.progress.begin("tiles", tasks)
        tiles = self.run.results(tasks)
        read = [(task.arguments[1], tiles.get(task.name)) for task in tasks]
        empty = stages.refusals(self.project, read)
        if empty:
            self.progress.begin("tiles", [*tasks, *empty])
            self.run.results(empty)
        owned = [
            (drive, [own[drive.name] for own in tiles.values() if drive.name in own])
            for drive in self.project.drives
        ]
        planned = [stages.planned_drive(self.project, drive, own) for drive, own in owned if own]
        if not planned:
            raise ValueError(
                f"None of the {len(tasks)} cloud files of {self.project.path} can be read. The "
                f"first: {self.run.faults[0].fault}"
            )
        if self.ties != "only":
            stages.check_control_near(self.project, [drive.survey for drive in planned])
        else:
            planned = [replace(d, survey=without_control(d.survey)) for d in planned]
        return planned

    def _estimated(self, planned, origin):
        """Keys of each drive's results in the store: (corrected, motion) by name."""
        with_ties = self.ties != "off"
        store = self.run.store
        tasks = {d.survey.name: stages.finding_tasks(store, d, origin, with_ties) for d in planned}
        every = [task for own in tasks.values() for task in own]
        self.progress.begin("findings", every)
        findings = self.run.results(every)
        lost = {_path(task) for task in every if task.name not in findings}
        every = [task for task in every if _path(task) not in lost]
        planned[:] = [d for drive in planned if (d := drive.without(lost)).survey.clouds]
        files = [task.key for task in every]
        surveys = [d.survey for d in planned]  # what results keep of them, paths and notes too
        kept = [(*_points(s), s.crs, s.notes, _contents(s), s.clouds) for s in surveys]
        key = digest(VERSION, files, kept, self.options.order, self.ties, self.options.sigma)
        keys = {d.survey.name: digest(key, d.survey.name) for d in planned}
        if not all(_is_there(store, own) for own in keys.values()):
            self._estimate(planned, every, findings, keys, origin)
        return keys

    def _estimate(self, planned, tasks, findings, keys, origin):
        """Store the results of each drive."""
        self.progress.say(Statement("drives estimated", values={"drives": len(planned)}))
        drives = []
        for drive in planned:
            own = [findings[task.name] for task in tasks if task.drive == drive.survey.name]
            drives.append(found_drive(drive.survey, own))
        if self.ties != "only" and not any(len(drive.control) for drive in drives):
            near = sum(len(drive.survey.control) for drive in drives)
            raise ValueError(
                f"None of the {len(self.project.control)} control points of {self.project.path} "
                f"was found in the clouds of {len(drives)} drives, although points are within a "
                f"cloud's bounds {near} times. Check CRS, kind and size of the targets, or use "
                "--ties-only."
            )
        key = digest(sorted(keys.values()))
        results = project_drives(
            drives, self.options.order, origin, self.ties != "off", partial(self._areas, key)
        )
        for corrected, state in results:
            key = keys[state.name]
            self.run.store.put("motions", key, motion_of(corrected, self.options.sigma))
            self.run.store.put("corrected", key, corrected)
            self.run.store.put("states", key, drive_result(corrected, state))

    def _areas(self, key, areas):
        """Results of each AreaInput."""
        tasks = stages.area_tasks(self.run.store, key, areas)
        self.progress.begin("areas", tasks)
        return self.run.all_results(tasks)

    def _clouds(self, planned, keys):
        """WrittenClouds of each drive by name."""
        tasks = stages.cloud_tasks(self.run.store, planned, keys, self.out, self.options.additions)
        every = [task for task, _ in tasks]
        self.progress.begin("clouds", every)
        written = self.run.results(every)
        clouds: dict[str, list[WrittenClouds]] = {drive.survey.name: [] for drive in planned}
        for task, names in tasks:
            if task.name in written:
                for name, own in zip(names, written[task.name].value, strict=True):
                    clouds[name].append(own if len(names) == 1 else own.below(f"../{task.drive}"))
        return {name: WrittenClouds.join(own) for name, own in clouds.items()}

    def _reports(self, planned, keys, clouds):
        """Output of each drive's report, by name of the drive."""
        store = self.run.store.folder
        page = self.options.page
        exports = self.options.trajectories, self.options.targets
        tasks = []
        for drive in planned:
            name = drive.survey.name
            inputs = ReportInput(store, keys[name], clouds[name], self.out / name, page, *exports)
            tasks.append(stages.report_task(inputs, drive))
        self.progress.begin("reports", tasks)
        return self.run.results(tasks)


def _path(task):
    """Path of the cloud of a task."""
    return task.arguments[0].path


def _points(survey):
    """Surveyed points by their use, with excluded or included ones if there are any."""
    points = survey.control, survey.check
    chosen = survey.excluded, survey.included
    if any(map(len, chosen)):
        return (*points, *chosen)
    return points


def _contents(survey):
    """Identity and contents of a survey's files; for clouds the keys of their tasks."""
    pairs = [(file.what, file.path) for file in survey.inputs]
    return pairs, [FileIdentity.of(path).content for what, path in pairs if what != "cloud"]


def _is_there(store, key):
    """True if all of a drive's results are in the store, undamaged."""
    try:
        for kind in ("states", "motions", "corrected"):
            store.get(kind, key)
    except KeyError:
        return False
    return True
