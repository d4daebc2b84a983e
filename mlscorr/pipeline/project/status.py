"""``status``: how far a project has come, from what its run keeps."""

import json
from pathlib import Path

from mlscorr.io.store import TaskStore, as_path, document, is_remote, is_there, read_bytes
from mlscorr.pipeline.project.correction import STORE
from mlscorr.pipeline.project.running import present
from mlscorr.pipeline.project.wording import TITLES, progress_sentence
from mlscorr.survey import Statement


def project_status(out: str | Path) -> dict:
    """How far a project has come, whether its run is at work or not.

    Parameters
    ----------
    out : path
        Folder of its results.

    Returns
    -------
    dict
        ``all`` and ``drives[]``: tasks and points done and planned, stage by stage; ``failures``
        of what isn't done yet, the last line of the ``log``, that on ``progress``, which says rate
        and time left, and whether a run ``is_running``: None where that can't be told.

    Raises
    ------
    ValueError
        Where no project was ever corrected into the folder, or the list of its tasks is damaged.
    """
    out = as_path(out)
    store = TaskStore(out / STORE)
    if not is_there(store.plan):
        raise ValueError(
            f"{out} has no results of a project, or its run has not started any file yet. Start "
            "it with mlscorr correct project.toml -o OUT."
        )
    stages = _planned(store)
    done = {kind: store.keys(kind) for kind in stages}
    tasks = [task | {"kind": kind} for kind in TITLES for task in stages.get(kind, ())]
    for task in tasks:
        task["is_done"] = task["key"] in done[task["kind"]] and _is_left(store, task)
    drives: dict[str, list[dict]] = {}
    for task in (task for task in tasks if task["drive"]):  # an area is of many
        drives.setdefault(task["drive"], []).append(task)
    is_running = store.is_locked()
    lines = read_bytes(out / "log.txt").decode().splitlines()
    titles = ("Estimating", *TITLES.values())
    progress = [line for line in lines if line.split(" ", 2)[-1].startswith(titles)]
    return document(
        "status",
        {
            "all": _stages(tasks),
            "drives": [{"name": name, "stages": _stages(own)} for name, own in drives.items()],
            "failures": _failures(tasks, lines),
            "progress": progress[-1] if progress else "",
            "log": lines[-1] if lines else "",
            "is_running": is_running,
        },
    )


def _planned(store):
    """The tasks of each stage, as the run has written them down."""
    try:
        return dict(json.loads(read_bytes(store.plan)))
    except (ValueError, TypeError) as error:
        raise ValueError(
            f"{store.plan} is damaged ({error}), so the progress is unknown. mlscorr correct "
            "project.toml -o OUT --resume writes it again and keeps completed work."
        ) from error


def _is_left(store, task):
    """Whether what a task wrote is there as it was written; nothing of this is asked of a store."""
    is_asked = task["kind"] in ("clouds", "reports") and not is_remote(store.folder)
    return not is_asked or present(store, task["kind"], task["key"]) is not None


def _failures(tasks, lines):
    """The last failure of each file or area of which a task isn't done; none of repaired ones."""
    left = dict.fromkeys(" ".join(task["name"].split()) for task in tasks if not task["is_done"])
    failures = []
    for name in left:
        beginning = progress_sentence(Statement("task failed", values={"task": name, "text": ""}))
        own = [line for line in lines if f" {beginning}" in line]
        failures += own[-1:]
    return failures


def _stages(tasks):
    """Tasks and points done and planned, stage by stage."""
    rows = []
    for kind, title in TITLES.items():
        own = [task for task in tasks if task["kind"] == kind]
        done = [task for task in own if task["is_done"]]
        points = sum(task["points"] for task in own)
        row = {"stage": kind, "title": title, "done": len(done), "tasks": len(own)}
        row |= {"points_done": sum(task["points"] for task in done), "points": points}
        if points:
            share = row["points_done"] / points
        else:
            share = len(done) / max(len(own), 1)
        rows += [{**row, "share": share}] if own else []
    return rows
