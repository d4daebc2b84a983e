"""Clouds whose points must be put into another file before they are read: how many, where to."""

import atexit
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from typing import Any

from mlscorr.io.settings import SETTINGS

_limit: ContextVar[int | None] = ContextVar("limit", default=None)
_progress: ContextVar[Any] = ContextVar("progress", default=None)


@contextmanager
def glance() -> Iterator[None]:
    """Take the first points of large files only, for what must be done in seconds."""
    token = _limit.set(SETTINGS.glanced_points)
    try:
        yield
    finally:
        _limit.reset(token)


@contextmanager
def announced(progress: Any) -> Iterator[None]:
    """Say how far conversions have come.

    Parameters
    ----------
    progress : function
        progress(title, total) gives a function of the number of points just done.
    """
    token = _progress.set(progress)
    try:
        yield
    finally:
        _progress.reset(token)


def looked_points() -> int | None:
    """Number of points that do within a glance; None where there is none."""
    return _limit.get()


def progress_of(title: str, total: int) -> Callable[[int], object]:
    """A function of the number of points just done, which says how far something has come.

    Parameters
    ----------
    title : str
    total : int
        Number of points.
    """
    return (_progress.get() or (lambda *_: lambda _: None))(title, total)


@cache
def temporary_folder() -> str:
    """A folder that goes when the program ends."""
    folder = tempfile.mkdtemp(prefix="mlscorr-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder
