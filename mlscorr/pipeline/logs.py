"""Log of a command, written as log.txt with its result."""

import logging
import platform
import re
import shlex
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from mlscorr.pipeline.installation import OPEN3D, installed_version

LOG_FILE = "log.txt"
LIBRARIES = ("mlscorr", "numpy", "scipy", "numba", "laspy", "pyproj", OPEN3D)
SECRETS = re.compile(r"(?<=://)[^/@\s]+@|(?<=[?])\S+")  # user and password, query of a URL
_lines: ContextVar[list[str] | None] = ContextVar("lines", default=None)


class _Recorder(logging.Handler):
    """Recorder of the log at INFO and above.

    Parameters
    ----------
    lines : list of str
        Lines to extend.
    """

    def __init__(self, lines: list[str]) -> None:
        super().__init__(logging.INFO)
        self.lines = lines
        self.setFormatter(
            logging.Formatter("{asctime}.{msecs:03.0f} {levelname:7s} {message}", style="{")
        )
        self.formatter.default_msec_format = None

    def emit(self, record: logging.LogRecord) -> None:
        """Add a record."""
        self.lines.append(without_secrets(self.format(record)))


def without_secrets(text: str) -> str:
    """Remove users, passwords and queries of URLs from a text.

    Parameters
    ----------
    text : str

    >>> without_secrets("mlscorr check s3://me:key@host/a.laz https://host/b.laz?token=1")
    'mlscorr check s3://...@host/a.laz https://host/b.laz?...'
    """
    return SECRETS.sub(lambda match: "...@" if match[0].endswith("@") else "...", text)


@contextmanager
def recorded_log(command: Sequence[str]) -> Iterator[None]:
    """Record the log of a command until it ends, for the log.txt of its result.

    Warnings shown meanwhile are logged, too.

    Parameters
    ----------
    command : sequence of str
        Its name and arguments.
    """
    lines = [
        f"Command: {without_secrets(shlex.join(['mlscorr', *command]))}",
        f"Versions: {', '.join(f'{name} {installed_version(name)}' for name in LIBRARIES)}, "
        f"Python {platform.python_version()}, {platform.platform()}",
    ]
    recorder = _Recorder(lines)
    logger = logging.getLogger("mlscorr")
    level = logger.level
    show = warnings.showwarning

    def show_and_log(message, *details, **named):
        logger.warning("%s", message)
        show(message, *details, **named)

    logger.addHandler(recorder)
    logger.setLevel(min(level or logging.INFO, logging.INFO))
    warnings.showwarning = show_and_log
    token = _lines.set(lines)
    try:
        yield
    finally:
        _lines.reset(token)
        warnings.showwarning = show
        logger.setLevel(level)
        logger.removeHandler(recorder)


def write_log(folder: Path) -> None:
    """Write log.txt into the folder of a result, if the log of its command is recorded.

    Parameters
    ----------
    folder : Path
    """
    lines = _lines.get()
    if lines is not None:
        (folder / LOG_FILE).write_text("\n".join(lines) + "\n", encoding="utf-8")
