"""Tasks to their ends: those whose results are there are left, lost workers' are tried again."""

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
    """The result of a task with its warnings; None where it, or what it wrote, lacks or is damaged.

    Parameters
    ----------
    store : TaskStore
    kind, key : str
        Of the task.
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
    """Works on tasks and counts what happens.

    Parameters
    ----------
    store : TaskStore
    engine : Engine
    watch : function of an Outcome
        Is told of each task that ended.
    tell : function of a Statement
        Is told of tasks that lost their worker.
    faults : list of Outcome
        Of tasks without a result.
    """

    store: TaskStore
    engine: Engine
    watch: Callable[[Outcome], object]
    tell: Callable[[Statement], object] = str
    faults: list[Outcome] = field(default_factory=list)

    def results(self, tasks: Sequence[Task]) -> dict[str, Any]:
        """Results by the names of their tasks; those that fail are among the faults, not here.

        Parameters
        ----------
        tasks : sequence of Task
            Of distinct names.
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
        """Results of tasks of which none can be spared, in their order.

        Parameters
        ----------
        tasks : sequence of Task
            Of distinct names.

        Raises
        ------
        ValueError
            Where some fail; says which.
        """
        results = self.results(tasks)
        if left := [task.name for task in tasks if task.name not in results]:
            raise ValueError(FAILED.format(len(left), len(tasks), ", ".join(left), self.faults[-1]))
        return list(results.values())

    def _outcomes(self, tasks) -> Iterator[Outcome]:
        """The Outcome of each task, as they end; long ones are begun first, so that all workers
        end at about the same time.
        """
        waiting = deque(sorted(tasks, key=lambda task: -task.points - task.near_points))
        suspects = deque()
        running = {}
        losses: Counter[tuple[str, bool]] = Counter()
        while waiting or suspects or running:
            is_single = bool(suspects)  # what loses workers is tried by itself: it may be to blame
            source = suspects if is_single else waiting
            width = self.engine.width  # a cluster that restarts is waited for here, in any case
            limit = 1 if is_single else SETTINGS.waiting * width
            while source and len(running) < limit:
                task = source.popleft()
                future = self.engine.submit(carry_out, task, self.store.folder)
                running[future] = task, is_single
            for future in wait(running, SETTINGS.interval, FIRST_COMPLETED).done:
                task, was_single = running.pop(future)
                try:
                    yield Outcome(task, *future.result())
                except CancelledError:  # with the connection to a scheduler: no task is to blame
                    self.tell(Statement("task lost with scheduler", values={"task": task.name}))
                    (suspects if was_single else waiting).appendleft(task)
                except self.engine.losses:
                    self.tell(Statement("task lost with worker", values={"task": task.name}))
                    losses[task.name, was_single] += 1
                    is_first = losses[task.name, False] == 1 and not was_single
                    if losses[task.name, True] >= SETTINGS.losses:
                        yield Outcome(task, LOSS.format(SETTINGS.losses))
                    else:  # all that were at work lose theirs with the one that is to blame
                        (waiting if is_first else suspects).append(task)
