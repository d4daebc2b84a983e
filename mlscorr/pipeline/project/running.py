"""Running tasks: existing results are used, tasks of lost workers are repeated."""

from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, wait
from dataclasses import dataclass, field
from typing import Any

from mlscorr.io.store import TaskStore
from mlscorr.pipeline.project.engine import Engine
from mlscorr.pipeline.project.settings import SETTINGS
from mlscorr.pipeline.project.tasks import Outcome, Task, Written, carry_out
from mlscorr.survey import Statement

LOSS = (
    "its worker was lost {} times while no other task was running, probably for lack of memory. "
    "Give workers more memory, or use fewer of them."
)
FAILED = "{} of {} required parts failed ({}): {.fault} --resume repeats only these."


def present(store: TaskStore, kind: str, key: str) -> tuple[Any, tuple[str, ...]] | None:
    """Result of a task with its warnings; None if it, or its output, is missing or damaged.

    Parameters
    ----------
    store : TaskStore
    kind, key : str
        Kind and key of the task.
    """
    try:
        result, texts = store.get(kind, key)
    except KeyError:
        return None
    if isinstance(result, Written) and not result.is_whole(store.folder.parent):
        return None
    return result, texts


@dataclass
class Run:
    """Runner of tasks that counts events.

    Parameters
    ----------
    store : TaskStore
    engine : Engine
    watch : function of an Outcome
        Receives each finished task.
    notify : function of a Statement
        Receives statements on tasks that lost their worker.
    faults : list of Outcome
        Outcomes of tasks without a result.
    """

    store: TaskStore
    engine: Engine
    watch: Callable[[Outcome], object]
    notify: Callable[[Statement], object] = str
    faults: list[Outcome] = field(default_factory=list)

    def results(self, tasks: Sequence[Task]) -> dict[str, Any]:
        """Return results by name of the task; failed ones are among the faults instead.

        Parameters
        ----------
        tasks : sequence of Task
            With distinct names.
        """
        results: dict[str, Any] = {}
        rest = []
        for task in tasks:
            if (result := present(self.store, task.kind, task.key)) is None:
                rest.append(task)
            else:
                results[task.name], texts = result
                self.watch(Outcome(task, warnings=texts))
        for outcome in self._outcomes(rest):
            task = outcome.task
            self.watch(outcome)
            if outcome.fault:
                self.faults.append(outcome)
            else:
                results[task.name] = self.store.get(task.kind, task.key)[0]
        return {task.name: results[task.name] for task in tasks if task.name in results}

    def all_results(self, tasks: Sequence[Task]) -> list[Any]:
        """Return results of tasks that are all required, in order.

        Parameters
        ----------
        tasks : sequence of Task
            With distinct names.

        Raises
        ------
        ValueError
            If some fail; the message lists them.
        """
        results = self.results(tasks)
        if left := [task.name for task in tasks if task.name not in results]:
            raise ValueError(FAILED.format(len(left), len(tasks), ", ".join(left), self.faults[-1]))
        return list(results.values())

    def _outcomes(self, tasks) -> Iterator[Outcome]:
        """Yield the Outcome of each finished task; long ones start first, so that all workers
        end at about the same time.
        """
        waiting = deque(sorted(tasks, key=lambda task: -task.points - task.near_points))
        suspects = deque()
        running = {}
        losses: Counter[tuple[str, bool]] = Counter()
        while waiting or suspects or running:
            is_single = bool(suspects)  # a suspected cause of lost workers runs alone
            source = suspects if is_single else waiting
            width = self.engine.width  # waits for a restarting cluster, in any case
            limit = 1 if is_single else SETTINGS.waiting * width
            while source and len(running) < limit:
                task = source.popleft()
                future = self.engine.submit(carry_out, task, self.store.folder)
                running[future] = task, is_single
            for future in wait(running, SETTINGS.interval, FIRST_COMPLETED).done:
                task, was_single = running.pop(future)
                try:
                    yield Outcome(task, *future.result())
                except CancelledError:  # with the connection to a scheduler: not caused by a task
                    self.notify(Statement("task lost with scheduler", values={"task": task.name}))
                    (suspects if was_single else waiting).appendleft(task)
                except self.engine.losses:
                    self.notify(Statement("task lost with worker", values={"task": task.name}))
                    losses[task.name, was_single] += 1
                    is_first = losses[task.name, False] == 1 and not was_single
                    if losses[task.name, True] >= SETTINGS.losses:
                        yield Outcome(task, LOSS.format(SETTINGS.losses))
                    else:  # all running tasks lose their workers together with the culprit
                        (waiting if is_first else suspects).append(task)
