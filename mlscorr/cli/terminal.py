"""What all commands share: options, exit codes, and sentences on stderr."""

import signal
import sys
from contextlib import contextmanager
from enum import IntEnum
from pathlib import Path
from typing import Annotated

import typer

_voice = {"quiet": False}  # of this process's stderr


def be_quiet(quiet):
    """Say nothing more than errors and warnings, if so."""
    _voice["quiet"] = quiet
    return quiet


def is_quiet():
    """Whether only errors and warnings are said."""
    return _voice["quiet"]


SurveyFile = Annotated[Path, typer.Argument(help="survey.toml, or the folder that holds it.")]
Out = Annotated[Path, typer.Option("-o", "--out", help="Folder for the results.")]
Overwrite = Annotated[bool, typer.Option(help="Replace files of the same name in the folder.")]
Quiet = Annotated[
    bool, typer.Option("--quiet", "-q", callback=be_quiet, help="Print errors and warnings only.")
]
Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON on stdout.")]


class Exit(IntEnum):
    """Exit codes of the commands."""

    DONE = 0
    USAGE = 2
    BAD_DATA = 3
    IN_PART = 4
    READ_OR_WRITE = 5
    QUALITY_GATE = 6
    LIBRARY_MISSING = 7
    INTERRUPTED = 130


def interrupt(number, frame):
    """Raise KeyboardInterrupt, and again after a second where a library swallowed it."""
    signal.setitimer(signal.ITIMER_REAL, 1.0)
    raise KeyboardInterrupt


@contextmanager
def exit_code(code):
    """End with one sentence and an exit code where the user's input or the system is at fault."""
    try:
        yield
    except KeyboardInterrupt:
        stop()
    except OSError as error:
        if isinstance(error, FileNotFoundError) and error.errno is None:  # survey.toml names it
            fail(error, Exit.USAGE)
        fail(f"Reading or writing failed: {error}", Exit.READ_OR_WRITE)
    except ImportError as error:
        if signal.getitimer(signal.ITIMER_REAL)[0]:  # it was the import that was interrupted
            stop()
        fail(f"{error}. Run mlscorr doctor to see what is missing.", Exit.LIBRARY_MISSING)
    except ValueError as error:
        fail(error, code)


def fail(message, code):
    warn(f"Error: {message}")
    raise typer.Exit(code) from None


def stop():
    signal.setitimer(signal.ITIMER_REAL, 0.0)
    warn("Interrupted; nothing was written.")
    raise typer.Exit(Exit.INTERRUPTED) from None


def say(text):
    """A sentence on stderr, unless it should be quiet."""
    if not is_quiet():
        warn(text)


def warn(text):
    """A sentence on stderr in any case."""
    print(text, file=sys.stderr)
