"""Shared parts of all commands: options, exit codes, and sentences on stderr."""

import logging
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from enum import IntEnum
from pathlib import Path
from time import monotonic
from typing import Annotated

import typer

HANGUP = getattr(signal, "SIGHUP", None)  # missing on Windows
SIGNALS = tuple(filter(None, (signal.SIGINT, signal.SIGTERM, HANGUP)))
REPEAT_AFTER = 1.0  # s until an interruption is repeated: libraries load faster
MARKS = {"green": "  ", "amber": "! ", "red": "!!"}  # before a statement, by its rating
_voice = {"quiet": False}  # of this process's stderr
_repeats: list[threading.Timer] = []  # of interruptions, until one takes effect


def be_quiet(context: typer.Context, quiet: bool) -> bool:
    """Print only errors and warnings until the command ends, if requested.

    Parameters
    ----------
    context : typer.Context
        Context of the command.
    quiet : bool

    Returns
    -------
    bool
        The same value.
    """
    _voice["quiet"] = quiet
    context.call_on_close(lambda: _voice.update(quiet=False))
    return quiet


def is_quiet() -> bool:
    """Return True if only errors and warnings are printed."""
    return _voice["quiet"]


class _Voice(logging.Handler):
    """Lines of the log on stderr, each with the time since the command began.

    Parameters
    ----------
    level : int
    """

    def __init__(self, level: int) -> None:
        super().__init__(level)
        self.start = monotonic()

    def emit(self, record: logging.LogRecord) -> None:
        """Print a record, unless the screen shows it anyway: warnings, times of stages."""
        if record.levelno < logging.WARNING and record.name != "mlscorr.cli.progress":
            say(f"[{monotonic() - self.start:6.1f} s] {record.getMessage()}")


def be_verbose(context: typer.Context, verbose: int) -> int:
    """Print the log on stderr until the command ends, if requested.

    Parameters
    ----------
    context : typer.Context
        Context of the command.
    verbose : int
        0: off; 1: findings and decisions, with reasons; 2: also details.

    Returns
    -------
    int
        The same value.
    """
    if verbose:
        logger = logging.getLogger("mlscorr")
        before = logger.level
        voice = _Voice(logging.INFO if verbose == 1 else logging.DEBUG)
        logger.addHandler(voice)
        logger.setLevel(voice.level)

        def end():
            logger.removeHandler(voice)
            logger.setLevel(before)

        context.call_on_close(end)
    return verbose


def know_effects(path: Path | None) -> Path | None:
    """Register the effects of a user's file, as soon as the option is read.

    Parameters
    ----------
    path : Path or None

    Returns
    -------
    Path or None
        The same path.
    """
    if path is not None:
        with exit_code(Exit.USAGE):
            from mlscorr.effects import register_file

            register_file(path)
    return path


Effects = Annotated[
    Path | None,
    typer.Option(
        callback=know_effects, help="Python file that defines your own effects; it is executed."
    ),
]
Overwrite = Annotated[bool, typer.Option(help="Replace files of the same name in the folder.")]
Quiet = Annotated[
    bool, typer.Option("--quiet", "-q", callback=be_quiet, help="Print errors and warnings only.")
]
Verbose = Annotated[
    int,
    typer.Option(
        "--verbose",
        "-v",
        count=True,
        callback=be_verbose,
        help="Print findings and decisions with their reasons; -vv adds details.",
    ),
]
Exclude = Annotated[
    list[str],
    typer.Option(
        metavar="NAME",
        help="A control point to leave out of the estimate. May be repeated. Do not choose it by "
        "the residuals of check points: these would no longer be independent.",
    ),
]
NoTies = Annotated[bool, typer.Option("--no-ties", help="Do not use tie features between passes.")]
Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON on stdout.")]


def path_or_url(name: str) -> Path:
    """Return the path of a name or URL; end with a message if it is invalid.

    Parameters
    ----------
    name : str

    Raises
    ------
    typer.Exit
    """
    from mlscorr.io.store import as_path

    with exit_code(Exit.USAGE):
        return as_path(name)


SurveyArgument = Annotated[
    Path,
    typer.Argument(
        help="survey.toml, or the folder that contains it; a path or a URL.", parser=path_or_url
    ),
]
Out = Annotated[
    Path | None,
    typer.Option(
        "-o",
        "--out",
        help="Folder for the results. Default: FOLDER-COMMAND next to the input's FOLDER.",
        parser=path_or_url,
        show_default=False,
    ),
]


def as_epilog(examples: Iterable[str]) -> str:
    """Format examples of a command for the end of its --help, one per line.

    Parameters
    ----------
    examples : iterable of str
    """
    return "\n\n".join(["Examples:", *examples])


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


def interrupt(number: int, frame: object) -> None:
    """Raise KeyboardInterrupt, and again after a second if a library swallowed it.

    Parameters
    ----------
    number : int
        Number of the signal.
    frame : object

    Raises
    ------
    KeyboardInterrupt
    """
    _repeats.append(threading.Timer(REPEAT_AFTER, _interrupt_again))
    _repeats[-1].daemon = True
    _repeats[-1].start()
    raise KeyboardInterrupt


def _interrupt_again():
    """Send this process the signal of Ctrl-C, or interrupt this thread if there is none."""
    if os.name == "posix":  # so that it wakes the main thread
        os.kill(os.getpid(), signal.SIGINT)
    else:
        signal.raise_signal(signal.SIGINT)


def listen() -> None:
    """End cleanly if the user, a scheduler or a closed terminal interrupts."""
    for number in SIGNALS:
        if signal.getsignal(number) != signal.SIG_IGN or number != HANGUP:  # nohup
            signal.signal(number, interrupt)


def deafen() -> None:
    """Ignore interruptions from here on, if they were handled, as nothing needs undoing."""
    for number in SIGNALS:
        if signal.getsignal(number) is interrupt:
            signal.signal(number, signal.SIG_IGN)
    while _repeats:
        _repeats.pop().cancel()


@contextmanager
def exit_code(code: Exit, has_results: Callable[[], bool | str] = lambda: False) -> Iterator[None]:
    """End with one sentence and an exit code for faults of the user's input or the system.

    Parameters
    ----------
    code : Exit
        For a ValueError.
    has_results : function
        Returns True or a remark if there are results; called at an interruption.

    Raises
    ------
    typer.Exit
    """
    try:
        yield
    except KeyboardInterrupt:
        _stop(has_results())
    except (OSError, ImportError, ValueError, SystemError, MemoryError) as error:
        if _repeats:  # a library made it from an interruption
            _stop(has_results())
        _report_error(error, code)


def _report_error(error, code):
    """Print the error, and end with its exit code; that of a ValueError is given."""
    if isinstance(error, SystemError):
        raise error
    if isinstance(error, MemoryError):
        _fail(f"{error or 'Out of memory'}. Ask for less: shorter, coarser or in parts.", code)
    if isinstance(error, ImportError):
        _fail(f"{error}. Run mlscorr doctor to see what is missing.", Exit.LIBRARY_MISSING)
    from mlscorr.survey import SurveyFileError

    if isinstance(error, OSError):
        if isinstance(error, FileNotFoundError) and error.errno is None:  # survey.toml names it
            _fail(error, Exit.USAGE)
        _fail(f"Reading or writing failed: {error}", Exit.READ_OR_WRITE)
    _fail(error, Exit.USAGE if isinstance(error, SurveyFileError) else code)


def _fail(message, code):
    """Print a message and end with an exit code."""
    warn(f"Error: {message}")
    raise typer.Exit(code) from None


def _stop(has_results):
    """End as interrupted."""
    deafen()
    if has_results:
        done = "all results were already written"
    else:
        done = "nothing was written"
    warn(f"Interrupted; {has_results if isinstance(has_results, str) else done}.")
    raise typer.Exit(Exit.INTERRUPTED) from None


def say(text: object) -> None:
    """Print a sentence on stderr, unless in quiet mode.

    Parameters
    ----------
    text : str
    """
    if not is_quiet():
        warn(text)


def warn(text: object) -> None:
    """Print a sentence on stderr even in quiet mode.

    Parameters
    ----------
    text : str
    """
    shown = "".join(c if c.isprintable() or c == "\n" else repr(c)[1:-1] for c in str(text))
    print(shown, file=sys.stderr)  # names of files and points may contain control characters


def end(failed: list[str], is_whole: bool) -> None:
    """List failed quality gates, and exit unless there are none and everything was corrected.

    Parameters
    ----------
    failed : list of str
        Sentences.
    is_whole : bool
        True if every point was corrected.

    Raises
    ------
    typer.Exit
        With the code of failed gates, or of partial results.
    """
    for sentence in failed:
        warn(f"Quality gate failed: {sentence}")
    if failed or not is_whole:
        raise typer.Exit(Exit.QUALITY_GATE if failed else Exit.IN_PART)


def say_statements(statements: list[dict]) -> None:
    """Print the first screen of a document; red rows even in quiet mode.

    Parameters
    ----------
    statements : list of dict
        Warnings among them are omitted, because they were printed when they arose.
    """
    for row in statements:
        if row["what"] == "Warnings":
            continue
        speak = warn if row["rating"] == "red" else say
        speak(f"{MARKS[row['rating']]} {row['what']}: {row['sentence']}")
        for item in row["items"]:
            speak("    " + ": ".join(filter(None, (item["name"], item["text"]))))


def say_results(results: Iterable[tuple[str, object]]) -> None:
    """Print the locations of a command's results, or its actions, one per line.

    Parameters
    ----------
    results : iterable of (title, path or text)
    """
    rows = list(results)
    width = max((len(title) for title, _ in rows), default=0) + 1
    for title, text in rows:
        say(f"{title + ':':{width}s} {text}")


def say_rmse(rows: Iterable[tuple[str, dict, str]], width: int, decimals: int) -> None:
    """Print a table of the RMSE of misclosures on stderr.

    Parameters
    ----------
    rows : iterable of (title, group, after)
        A group of points as in documents, and the state to show after ``before``.
    width : int
        Width of the titles.
    decimals : int
    """
    heads = "".join(f"{f'E {when}':>11s}{'N':>8s}{'H':>8s}" for when in ("before", "after"))
    say(f"{'RMSE of misclosures (m)':{width}s}{'n':>4s}{heads}")
    for title, group, after in rows:
        before = group["before"]["rmse"]
        left = group[after]["rmse"]
        numbers = enumerate([*before, *left] if before and left else [])
        text = "".join(f"{v:{8 if i % 3 else 11}.{decimals}f}" for i, v in numbers)
        say(f"{title:{width}s}{group['n']:4d}{text or '  none'}")
