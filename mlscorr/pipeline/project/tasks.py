"""Tasks, how they are carried out, and how they end."""

import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from mlscorr.io.store import FileIdentity, TaskStore, telling_space

VERSION = version("mlscorr")  # results of another one are made again


@dataclass(frozen=True)
class Task:
    """A function and its arguments, named by the hash of what its result depends on.

    Parameters
    ----------
    kind : str
        Of the stage.
    key : str
    drive : str
    name : str
        Of what it works on.
    points : int
        That it works on.
    function : function
    arguments : tuple
        Paths and small values.
    near_points : float
        Expected near surveyed points, once for each of these: they are looked at again.
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
    """How a task ended.

    Parameters
    ----------
    task : Task
    fault : str
        Why it has no result; empty where it has.
    warnings : tuple of str
    seconds : float
        That it took; none where its result was there.
    """

    task: Task
    fault: str = ""
    warnings: tuple[str, ...] = ()
    seconds: float = 0.0


def carry_out(task: Task, folder: Path) -> tuple[str, tuple[str, ...], float]:
    """Work on a task, with one thread, and keep its result.

    Parameters
    ----------
    task : Task
    folder : Path
        Of the store.

    Returns
    -------
    fault, warnings, seconds
        As of the Outcome. Its task stays with who gave it: no worker sends trajectories back.
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
        except Exception as error:  # a night's work doesn't end by what nobody thought of
            fault = f"{type(error).__name__}: {error}. Please report this."
    return fault, tuple(texts), time.perf_counter() - start


@dataclass(frozen=True)
class Written:
    """What a task says of files that it wrote.

    Parameters
    ----------
    value : list of WrittenClouds, or dict
    outputs : tuple of (str, FileIdentity)
        By their names within a folder.
    """

    value: Any
    outputs: tuple[tuple[str, FileIdentity], ...]

    def is_whole(self, folder: Path) -> bool:
        """Whether the files are as they were written.

        Parameters
        ----------
        folder : Path
        """
        try:
            return all(FileIdentity.of(folder / name) == known for name, known in self.outputs)
        except OSError:
            return False
