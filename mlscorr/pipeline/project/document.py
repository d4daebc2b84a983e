"""project.json: the result of each drive, and failures."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from posixpath import normpath

import numpy as np

from mlscorr.evaluate import largest_sigma
from mlscorr.io.store import TaskStore, document
from mlscorr.io.surveys import ProjectParts
from mlscorr.pipeline.clouds import WrittenClouds
from mlscorr.pipeline.corrected_survey import CorrectedSurvey
from mlscorr.pipeline.project.corrected import STATES, DriveState
from mlscorr.pipeline.project.running import Run
from mlscorr.pipeline.project.tasks import Written
from mlscorr.report import RATINGS as ORDER
from mlscorr.report import StatementRow, capped, statements_section
from mlscorr.wording import counted

COUNTS = "n_surveyed", "n_seen", "n_scored"
RATINGS = {"controlled": "green", "tied": "green", "relative": "red", "uncorrected": "red"}


@dataclass(frozen=True)
class DriveResult:
    """Data of a drive shown by a project.

    Parameters
    ----------
    state : DriveState
    position_sigma : dict
        See largest_sigma.
    track : (k, 3) array
        Easting, northing (m) and 3D sigma (m) along the drive, NaN in its gaps.
    """

    state: DriveState
    position_sigma: dict[str, float]
    track: np.ndarray


def drive_result(corrected: CorrectedSurvey, state: DriveState) -> DriveResult:
    """Make the data of a drive shown by a project.

    Parameters
    ----------
    corrected : CorrectedSurvey
    state : DriveState
    """
    trajectory = corrected.trajectory
    sigma = np.linalg.norm(trajectory.position_sigma, axis=1)
    rows = np.unique(np.floor(trajectory.gps_time), return_index=True)[1]
    parts = trajectory.segment(trajectory.gps_time[rows])
    track = np.column_stack([trajectory.position[rows, :2], sigma[rows]])
    track = np.insert(track, np.flatnonzero(np.diff(parts)) + 1, np.nan, axis=0)
    return DriveResult(state, largest_sigma(trajectory), track)


@dataclass(frozen=True)
class ProjectResult:
    """Result of a project.

    Parameters
    ----------
    document : dict
        Contents of project.json.
    tracks : dict
        Track of each drive by name; see DriveResult.
    reports : dict
        report.json of each drive by name.
    """

    document: dict
    tracks: dict[str, np.ndarray]
    reports: dict[str, dict]

    @property
    def is_whole(self) -> bool:
        """True if nothing failed, and every drive and point was corrected."""
        left = [row["state"] == "uncorrected" for row in self.document["drives"]]
        untouched = [report["coverage"]["points_untouched"] for report in self.reports.values()]
        return not any([*self.document["faults"], *left, *untouched])


def older_clouds(out: Path, clouds: Mapping[str, WrittenClouds]) -> list[str]:
    """Clouds of an earlier run among the results, for files or drives that no longer exist.

    Parameters
    ----------
    out : Path
    clouds : dict
        WrittenClouds of each drive of this run, by name.
    """
    made = {normpath(f"{name}/{file}") for name, own in clouds.items() for file, *_ in own.files}
    there = [path for path in out.glob("*/*") if path.suffix.lower() in (".las", ".laz")]
    return sorted({f"{path.parent.name}/{path.name}" for path in there} - made)


def older_results(store: TaskStore, reports: Sequence[Written]) -> list[str]:
    """Report files of an earlier run that were not replaced.

    Parameters
    ----------
    store : TaskStore
        Store with the list of their files.
    reports : sequence of Written
        Reports of this run.
    """
    made = {name for each in reports for name, _ in each.outputs}
    now = [each.value | {"outputs": ()} for each in reports]
    older = set()
    for key in store.keys("reports"):
        with suppress(KeyError):  # of another version, or damaged
            each: Written = store.get("reports", key)[0]
            if each.value | {"outputs": ()} not in now:
                left = {file[0]: Written(None, (file,)) for file in each.outputs}
                older |= {n for n in left.keys() - made if left[n].is_whole(store.folder.parent)}
    return sorted(older)


def project_document(
    project: ProjectParts,
    drives: Sequence[tuple[DriveResult, dict]],
    run: Run,
    older: Sequence[str] = (),
) -> ProjectResult:
    """Make the result of a project.

    Parameters
    ----------
    project : ProjectParts
    drives : sequence of (DriveResult, dict)
        Each with its report.json.
    run : Run
    older : sequence of str
        Files of an earlier run.
    """
    rows = [_row(result, report) for result, report in drives]
    faults = [
        {"drive": task.drive, "name": task.name, "stage": task.kind, "fault": fault.fault}
        for fault, task in ((fault, fault.task) for fault in run.faults)
    ]
    facts = [*_statements(project, rows, drives, faults), *_lost(run.engine.lost), *_left(older)]
    content = document(
        "project",
        {
            "name": project.name,
            "crs": project.crs,
            **statements_section(facts),
            "drives": rows,
            "faults": faults,
        },
    )
    return ProjectResult(
        content,
        {result.state.name: result.track for result, _ in drives},
        {result.state.name: report for result, report in drives},
    )


def _row(result, report):
    """Row of a drive in project.json."""
    state = result.state
    control = report["control"]
    check = report["check"]
    tested = {"check": (check, "after"), "left_out": (control, "leave_one_out")}
    by = next((by for by, (points, after) in tested.items() if _rmse(points, after)), None)
    points, after = tested[by] if by else (control, "after")
    return {
        **asdict(state),
        "meaning": STATES[state.state],
        "rating": max(report["rating"], RATINGS[state.state], key=ORDER.index),
        "files": len(report["files"]),
        "points": sum(file["points"] for file in report["files"]),
        **{role: {key: report[role][key] for key in COUNTS} for role in ("control", "check")},
        "tested_by": by,
        "before": _rmse(points, "before"),
        "after": _rmse(points, after),
        "position_sigma": result.position_sigma,
        "metres_extrapolated": report["coverage"]["metres_extrapolated"],
        "headline": report["headline"],
    }


def _rmse(points, key):
    return points.get(key, {}).get("rmse_3d")


def _statements(project, rows, drives, faults):
    """First rows of the page: drives, control, files."""
    count = {state: [row["name"] for row in rows if row["state"] == state] for state in STATES}
    constrained = len(count["controlled"]) + len(count["tied"])
    others = [(s, names) for s, names in count.items() if names and s != "controlled"]
    yield StatementRow(
        "Drives",
        "green" if constrained == len(project.drives) else "red",
        f"{constrained} of {counted(len(project.drives), 'drive')} are constrained by control "
        f"points, {len(count['tied'])} of them through ties with other drives.",
        tuple((", ".join(names), STATES[state]) for state, names in others),
    )
    used = {
        target["name"]
        for _, report in drives
        for target in report["targets"]
        if target["role"] == "control" and target["used"]
    }
    yield StatementRow(
        "Control points",
        "green" if len(used) == len(project.control) else "amber",
        f"{len(used)} of {len(project.control)} surveyed control points were used.",
    )
    if noise := sum(report["coverage"]["points_noise"] for _, report in drives):
        yield StatementRow(
            "Noise",
            "green",
            f"{noise} of {sum(row['points'] for row in rows)} points are flagged as noise. They "
            "are not used for measurements but corrected like all others.",
        )
    yield from _minded(rows, [report for _, report in drives])
    if faults:
        yield StatementRow(
            "Failures",
            "red",
            f"{counted(len(faults), 'failure')}: the items listed were not corrected, everything "
            "else was. Remove the cause and run again with --resume.",
            tuple((fault["name"], fault["fault"]) for fault in faults),
        )


def _minded(rows, reports):
    """Statement on drives whose own first screen is not green: the worst of each, red first."""
    doubts = [
        (row["rating"], row["name"], _reason(row, report))
        for row, report in zip(rows, reports, strict=True)
        if row["rating"] != "green"
    ]
    if doubts:
        doubts.sort(key=lambda doubt: -ORDER.index(doubt[0]))
        sentence = f"{len(doubts)} of {counted(len(rows), 'drive')} have warnings."
        items = capped(doubt[1:] for doubt in doubts)
        yield StatementRow("Doubts", doubts[0][0], sentence, items)


def _reason(row, report):
    """Reason for a drive's rating, and its first warning, which may be the cause.

    A result starts with the effect of the correction.
    """
    facts = [fact for fact in report["statements"] if fact["rating"] == row["rating"]]
    if not facts:
        return row["meaning"]
    first = facts[0]
    texts = [item["text"] for item in facts[0]["items"]]
    # that only counts them
    if first["what"] == "Warnings":
        reason = ""
    else:
        reason = first["sentence"]
    if first["what"] == "Result" and texts:
        _, *worse = texts  # after the numbers
        reason = worse[0] if worse else facts[1]["sentence"]  # check points: none, or some missing
    warned = [fact["items"][0] for fact in report["statements"] if fact["what"] == "Warnings"]
    return " ".join([reason, *(item["text"] for item in warned)]).strip()


def _lost(number):
    """Statement on lost workers and schedulers, if there were any."""
    if number:
        sentence = f"Lost workers or schedulers: {number}; their tasks were repeated."
        yield StatementRow("Workers", "amber", sentence)


def _left(older):
    """Statement on files of an earlier run, if there are any."""
    if older:
        sentence = (
            f"{len(older)} file{'s are' if len(older) > 1 else ' is'} from an earlier run: from "
            "clouds or drives that were removed or have failed now, or from reports not "
            "requested again. Delete what is outdated."
        )
        items = capped((name, "not from this run") for name in older)
        yield StatementRow("Older results", "amber", sentence, items)
