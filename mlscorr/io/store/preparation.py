"""Preparation of clouds that must be converted before reading: number of points and location."""

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
    """Set a variable to a value until the block ends."""
    token = variable.set(value)
    try:
        yield
    finally:
        variable.reset(token)


def glance(points: int = SETTINGS.glanced_points) -> AbstractContextManager[None]:
    """Use only the first points of large files, for quick tasks.

    Parameters
    ----------
    points : int
        Number of points of each file.
    """
    return _holding(_limit, points)


def announced(progress: Any) -> AbstractContextManager[None]:
    """Announce stages, and the progress of conversions and results.

    Parameters
    ----------
    progress : function
        progress(title, total) starts a stage and returns a function of the number of points just
        done. Without a total, the end is unknown.
    """
    return _holding(_progress, progress)


def looked_points() -> int | None:
    """Number of points that suffice for a quick look; None without a limit."""
    return _limit.get()


def progress_of(title: str, total: int | None = None) -> Callable[[int], object]:
    """Start a stage, and return a function of the number of points just done in it.

    Parameters
    ----------
    title : str
    total : int, optional
        Number of points; None if unknown.
    """
    return (_progress.get() or (lambda *_: lambda _: None))(title, total)


@cache
def temporary_folder() -> str:
    """Temporary folder that is removed when the program ends."""
    folder = tempfile.mkdtemp(prefix="mlscorr-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder
