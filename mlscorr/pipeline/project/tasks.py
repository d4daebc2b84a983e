"""Tasks, their execution, and their outcomes."""

import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from mlscorr.io.store import FileIdentity, TaskStore, telling_space

VERSION = version("mlscorr")  # results of another version are made again


@dataclass(frozen=True)
class Task:
    """Function and its arguments, identified by the hash of its dependencies.

    Parameters
    ----------
    kind : str
        Kind of the stage.
    key : str
    drive : str
    name : str
        Name of its input.
    points : int
        Number of its points.
    function : function
    arguments : tuple
        Paths and small values.
    near_points : float
        Expected number near surveyed points, counted for each of these, because they are processed
        again.
    """

    kind: str
    key: str
    drive: str
    name: str
    points: int
    function: Callable
    arguments: tuple
    near_points: float = 0.0


@dataclass(frozen=True)
class Outcome:
    """Outcome of a task.

    Parameters
    ----------
    task : Task
    fault : str
        Reason for a missing result; empty with a result.
    warnings : tuple of str
    seconds : float
        Duration; zero for an existing result.
    """

    task: Task
    fault: str = ""
    warnings: tuple[str, ...] = ()
    seconds: float = 0.0


def carry_out(task: Task, folder: Path) -> tuple[str, tuple[str, ...], float]:
    """Carry out a task with one thread, and store its result.

    Parameters
    ----------
    task : Task
    folder : Path
        Folder of the store.

    Returns
    -------
    fault, warnings, seconds
        See Outcome. The task itself is not returned, so that no worker sends trajectories back.
    """
    start = time.perf_counter()
    store = TaskStore(folder)
    fault = ""
    texts = []
    recorded = warnings.catch_warnings(record=True, action="always")
    with recorded as caught, threadpool_limits(limits=1):
        try:
            with telling_space(folder):
                result = task.function(*task.arguments)
                spoken = [w for w in caught if issubclass(w.category, UserWarning)]
                texts = list(dict.fromkeys(str(warning.message) for warning in spoken))
                store.put(task.kind, task.key, (result, tuple(texts)))
        except (ValueError, OSError) as error:
            fault = str(error) or type(error).__name__
        except Exception as error:  # an unexpected error must not end a night's work
            fault = f"{type(error).__name__}: {error}. Please report this."
    return fault, tuple(texts), time.perf_counter() - start


@dataclass(frozen=True)
class Written:
    """Record of the files written by a task.

    Parameters
    ----------
    value : list of WrittenClouds, or dict
    outputs : tuple of (str, FileIdentity)
        By name within a folder.
    """

    value: Any
    outputs: tuple[tuple[str, FileIdentity], ...]

    def is_whole(self, folder: Path) -> bool:
        """Return True if the files are unchanged.

        Parameters
        ----------
        folder : Path
        """
        try:
            return all(FileIdentity.of(folder / name) == known for name, known in self.outputs)
        except OSError:
            return False
