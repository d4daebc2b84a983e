"""Status of a run from its stored results: lasting failures, and whether it still works."""

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from mlscorr.cli import app
from mlscorr.io.store import TaskStore
from mlscorr.pipeline.project import project_status
from mlscorr.pipeline.project.progress import logged
from mlscorr.pipeline.project.tasks import Outcome, Task, carry_out
from mlscorr.pipeline.project.wording import PROGRESS, progress_sentence
from mlscorr.survey import Statement


def tiles(folder, *names):
    "A task of each file, which reads it"
    return [
        Task("tiles", f"key of {name}", "first", name, 1, Path.read_bytes, (folder / name,))
        for name in names
    ]


def run(out, tasks):
    "Work on tasks, and status of their run while it is at work"
    store = TaskStore(out / "tasks")
    with store.locked(), logged(out / "log.txt", store.plan, str) as progress:
        progress.begin("tiles", tasks)
        for task in tasks:
            progress.ended(Outcome(task, *carry_out(task, store.folder)))
        return project_status(out)


def test_a_failure_that_was_repaired_is_none(tmp_path):
    "Of two files that failed twice, the one that a third run reads is shown no more"
    tasks = tiles(tmp_path, "a  tile.laz", "b.laz")
    run(tmp_path, tasks)
    failures = run(tmp_path, tasks)["failures"]
    assert [line.split(" Failed: ")[1].split(": ")[0] for line in failures] == [
        "a tile.laz",
        "b.laz",
    ]
    (tmp_path / "a  tile.laz").write_bytes(b"whole")
    (failure,) = run(tmp_path, tasks)["failures"]
    assert " Failed: b.laz: " in failure


def test_time_left_is_told_by_what_is_worked_on(tmp_path):
    "Of 100 files 90 were there: a second for each of the next five leaves five, not half of one"
    (tmp_path / "tasks").mkdir()
    tasks = tiles(tmp_path, *(f"{number}.laz" for number in range(100)))
    told = []
    with logged(tmp_path / "log.txt", TaskStore(tmp_path / "tasks").plan, told.append) as progress:
        progress.begin("tiles", tasks)
        for task in tasks[:90]:
            progress.ended(Outcome(task))
        progress.counts["start"] -= 5.0
        for task in tasks[90:94]:
            progress.ended(Outcome(task, seconds=1.0))
        progress.due = 0.0
        progress.ended(Outcome(tasks[94], seconds=1.0))
    (progress,) = told
    assert progress.key == "stage progress"
    counts = {"stage": "tiles", "done": 95, "tasks": 100, "drives": 1, "failures": 0}
    assert counts.items() <= progress.values.items()
    assert progress.values["share"] == 0.95
    assert progress.values["rate"] == pytest.approx(1.0, rel=0.05)  # points/s
    assert progress.values["left"] == pytest.approx(5.0, rel=0.05)  # s


SAID = {
    "stage": "tiles",
    "done": 95,
    "tasks": 100,
    "drives": 1,
    "share": 0.95,
    "rate": 1.0,
    "left": 5.0,
    "failures": 0,
}


def test_all_that_a_run_says_has_its_sentence():
    "With titles, plurals and times; nothing is said of the time left before it is known"
    values = {"task": "a.laz", "text": "It is empty.", "drives": 2}
    values |= {"scheduler": "tcp://a:1", "patience": "30s"}
    for key in PROGRESS.keys() - {"stage progress"}:
        assert progress_sentence(Statement(key, values=values)).endswith((".", "It is empty."))
    rate = "95 %, 1e-06 M points/s"
    whole = (
        f"Reading headers: 95 of 100 files of 1 drive, {rate}, 5 s left in this stage, 0 failures"
    )
    assert progress_sentence(Statement("stage progress", values=SAID)) == f"{whole} so far"
    unknown = Statement("stage progress", values=SAID | {"left": None})
    assert "left" not in progress_sentence(unknown)


def test_progress_is_told_beside_the_last_line(tmp_path):
    "Rate, time left and the failures of all stages, while tasks follow them in the log"
    tasks = tiles(tmp_path, *(f"{number}.laz" for number in range(4)))
    store = TaskStore(tmp_path / "tasks")
    with store.locked(), logged(tmp_path / "log.txt", store.plan, str) as progress:
        progress.begin("tiles", tasks)
        progress.ended(Outcome(tasks[0], "no such file"))
        progress.begin("findings", tasks)
        assert project_status(tmp_path)["progress"].endswith(
            "Reading the clouds: 4 tasks, 4 points."
        )
        for progress.due, task in zip((0.0, np.inf, np.inf), tasks, strict=False):
            progress.ended(Outcome(task, seconds=1.0))
        content = project_status(tmp_path)
        assert " left in this stage, 1 failure so far" in content["progress"]
        assert content["log"].endswith("tiles: 2.laz in 1.0 s")
        said = CliRunner().invoke(app, ["status", str(tmp_path)]).stderr
        assert "Running: " in said
    assert "Running" not in CliRunner().invoke(app, ["status", str(tmp_path)]).stderr


def test_a_run_that_is_no_more_is_said(tmp_path):
    "Its lock tells one at work from one that was killed, which --resume goes on with"
    (tmp_path / "a.laz").write_bytes(b"whole")
    assert run(tmp_path, tiles(tmp_path, "a.laz"))["is_running"] is True
    assert project_status(tmp_path)["is_running"] is False
    said = CliRunner().invoke(app, ["status", str(tmp_path)]).stderr
    assert "Not running: continue with the same command and --resume." in said
    with TaskStore(tmp_path / "tasks").locked():
        assert "Not running" not in CliRunner().invoke(app, ["status", str(tmp_path)]).stderr


def test_a_full_disk_is_named_with_what_it_has_left(tmp_path):
    "By a task that writes, and where the log takes no line any more"
    full = Path("/dev/full")
    task = Task("tiles", "key", "first", "a.laz", 1, full.write_text, ("half",))
    words = f"No space left on device: the disk of {tmp_path}"
    fault, _, _ = carry_out(task, tmp_path)
    assert fault.startswith(words) and " MB free" in fault
    (tmp_path / "log.txt").symlink_to(full)
    with pytest.raises(OSError, match=words), logged(tmp_path / "log.txt", tmp_path, str) as log:
        log.note("x")


@pytest.mark.parametrize("text", ["", "{", "[]x", "[1]", "3"])
def test_a_damaged_list_of_tasks_is_named(tmp_path, text):
    "Cut off or of another kind: the file and the way out, no words of a parser alone"
    (tmp_path / "a.laz").write_bytes(b"whole")
    run(tmp_path, tiles(tmp_path, "a.laz"))
    plan = TaskStore(tmp_path / "tasks").plan
    plan.write_text(text)
    with pytest.raises(ValueError, match=f"{plan.name} is damaged .*--resume"):
        project_status(tmp_path)
    assert CliRunner().invoke(app, ["status", str(tmp_path)]).exit_code == 2
