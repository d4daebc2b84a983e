"""``status``: progress of a project, from the records of its run."""

import json
from pathlib import Path

from mlscorr.io.store import TaskStore, as_path, document, is_remote, is_there, read_bytes
from mlscorr.pipeline.project.correction import STORE
from mlscorr.pipeline.project.running import present
from mlscorr.pipeline.project.wording import TITLES, progress_sentence
from mlscorr.survey import Statement


def project_status(out: str | Path) -> dict:
    """Progress of a project, during or after its run.

    Parameters
    ----------
    out : path
        Folder of its results.

    Returns
    -------
    dict
        ``all`` and ``drives[]``: tasks and points done and planned, stage by stage; ``failures`` of
        unfinished tasks, the last line of the ``log``, that on ``progress`` with rate and remaining
        time, and ``is_running``, which is None if unknown.

    Raises
    ------
    ValueError
        If no project was ever corrected into the folder, or the list of its tasks is damaged.
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
    for task in (task for task in tasks if task["drive"]):  # an area has many
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
    """Tasks of each stage, as recorded by the run."""
    try:
        return dict(json.loads(read_bytes(store.plan)))
    except (ValueError, TypeError) as error:
        raise ValueError(
            f"{store.plan} is damaged ({error}), so the progress is unknown. mlscorr correct "
            "project.toml -o OUT --resume writes it again and keeps completed work."
        ) from error


def _is_left(store, task):
    """True if a task's output is unchanged; stores are not checked for this."""
    is_asked = task["kind"] in ("clouds", "reports") and not is_remote(store.folder)
    return not is_asked or present(store, task["kind"], task["key"]) is not None


def _failures(tasks, lines):
    """Last failure of each file or area with unfinished tasks, without repaired ones."""
    left = dict.fromkeys(" ".join(task["name"].split()) for task in tasks if not task["is_done"])
    failures = []
    for name in left:
        beginning = progress_sentence(Statement("task failed", values={"task": name, "text": ""}))
        own = [line for line in lines if f" {beginning}" in line]
        failures += own[-1:]
    return failures


def _stages(tasks):
    """Tasks and points done and planned, by stage."""
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
