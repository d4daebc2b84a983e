"""Clouds whose points must be put into another file before they are read: how many, where to."""

import atexit
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from functools import cache
from typing import Any

from mlscorr.io.settings import SETTINGS

_limit: ContextVar[int | None] = ContextVar("limit", default=None)
_progress: ContextVar[Any] = ContextVar("progress", default=None)


@contextmanager
def _holding(variable: ContextVar, value: Any) -> Iterator[None]:
    """Give a variable a value until the block ends."""
    token = variable.set(value)
    try:
        yield
    finally:
        variable.reset(token)


def glance(points: int = SETTINGS.glanced_points) -> AbstractContextManager[None]:
    """Take the first points of large files only, for what must be done in seconds.

    Parameters
    ----------
    points : int
        How many of each file.
    """
    return _holding(_limit, points)


def announced(progress: Any) -> AbstractContextManager[None]:
    """Say which stage runs, and how far conversions and results have come.

    Parameters
    ----------
    progress : function
        progress(title, total) begins a stage, and gives a function of the number of points just
        done. Without a total the end is not known.
    """
    return _holding(_progress, progress)


def looked_points() -> int | None:
    """Number of points that do within a glance; None where there is none."""
    return _limit.get()


def progress_of(title: str, total: int | None = None) -> Callable[[int], object]:
    """Begin a stage, and give a function of the number of points just done in it.

    Parameters
    ----------
    title : str
    total : int, optional
        Number of points; None where the end is not known.
    """
    return (_progress.get() or (lambda *_: lambda _: None))(title, total)


@cache
def temporary_folder() -> str:
    """A folder that goes when the program ends."""
    folder = tempfile.mkdtemp(prefix="mlscorr-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder
