"""Progress of a project: sentences at intervals, a log, and data for status."""

import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from time import monotonic
from typing import TextIO

from mlscorr.io.store import appended, output_file, telling_space
from mlscorr.pipeline.project.settings import SETTINGS
from mlscorr.pipeline.project.tasks import Outcome, Task
from mlscorr.pipeline.project.wording import TITLES, progress_sentence
from mlscorr.survey import Statement


@dataclass
class Progress:
    """Counter of tasks that reports progress.

    Parameters
    ----------
    log : text stream
    plan : Path
        List of the tasks of each stage, for status.
    notify : function of a Statement
    """

    log: TextIO
    plan: Path
    notify: Callable[[Statement], object]
    stages: dict[str, list[dict]] = field(default_factory=dict)
    counts: dict[str, float] = field(default_factory=lambda: {"faults": 0})  # of all stages
    due: float = 0.0

    def note(self, text: str) -> None:
        """Write a line into the log.

        Parameters
        ----------
        text : str
        """
        now = datetime.now(UTC).strftime("%Y-%m-%d %H:%M:%S")
        print(now, " ".join(text.split()), file=self.log, flush=True)

    def say(self, statement: Statement) -> None:
        """Report a statement, and write its sentence into the log.

        Parameters
        ----------
        statement : Statement
            With a key of PROGRESS.
        """
        self.note(progress_sentence(statement))
        self.notify(statement)

    def begin(self, kind: str, tasks: Sequence[Task]) -> None:
        """Begin a stage.

        Parameters
        ----------
        kind : str
        tasks : sequence of Task
        """
        self.stages[kind] = [
            {"key": task.key, "drive": task.drive, "name": task.name, "points": task.points}
            for task in tasks
        ]
        with output_file(self.plan) as part:
            part.write_text(json.dumps(self.stages), encoding="utf-8")
        self.note(f"{TITLES[kind]}: {len(tasks)} tasks, {sum(t.points for t in tasks)} points.")
        self.counts |= {"done": 0, "points": 0, "worked": 0, "start": monotonic()}
        self.due = monotonic() + SETTINGS.interval

    def ended(self, outcome: Outcome) -> None:
        """Count a finished task, and report its warnings and fault.

        Parameters
        ----------
        outcome : Outcome
        """
        counts = self.counts
        task = outcome.task
        is_new = outcome.seconds > 0
        counts["done"] += 1
        counts["points"] += max(task.points, 1)
        counts["worked"] += max(task.points, 1) * is_new
        counts["faults"] += bool(outcome.fault)
        for text in outcome.warnings:
            self.say(Statement("task warning", "warning", {"task": task.name, "text": text}))
        if outcome.fault:
            values = {"task": task.name, "text": outcome.fault}
            self.say(Statement("task failed", "fault", values))
        elif is_new:
            self.note(f"{task.kind}: {task.name} in {outcome.seconds:.1f} s")
        if monotonic() >= self.due:
            self.due = monotonic() + SETTINGS.interval
            self.say(self._stage_progress(task.kind))

    def _stage_progress(self, kind):
        """Progress of a stage, its rate, and the remaining time."""
        counts = self.counts
        tasks = self.stages[kind]
        total = sum(max(task["points"], 1) for task in tasks)
        rate = counts["worked"] / (monotonic() - counts["start"])  # existing results took no time
        left = None
        if rate:
            left = (total - counts["points"]) / rate
        values = {
            "stage": kind,
            "done": counts["done"],
            "tasks": len(tasks),
            "drives": len({task["drive"] for task in tasks} - {""}),
            "share": counts["points"] / total,
            "rate": rate,
            "left": left,
            "failures": counts["faults"],
        }
        return Statement("stage progress", values=values)


@contextmanager
def logged(log: Path, plan: Path, notify: Callable[[Statement], object]) -> Iterator[Progress]:
    """Open Progress with its log, which also records an early end of the run.

    Parameters
    ----------
    log : Path
    plan, tell
        See Progress.
    """
    with telling_space(log.parent), appended(log) as stream:
        progress = Progress(stream, plan, notify)
        try:
            yield progress
        except BaseException as error:
            progress.note(f"Ended early: {type(error).__name__} {error}")
            raise
