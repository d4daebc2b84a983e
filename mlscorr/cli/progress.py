"""Bars or lines on stderr, for work that takes longer than a person likes to wait unsure."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic

from mlscorr.cli.terminal import is_quiet, say
from mlscorr.wording import percent

COMPILING = "Compiling loops: the first run of an installation takes minutes longer; they are kept."
PATIENCE = 2.0  # s; quicker work shows nothing
INTERVAL = 10.0  # s between the lines where stderr is no terminal

Progress = Callable[[str, int], Callable[[int], object]]


@contextmanager
def progress_bars() -> Iterator[Progress]:
    """Bars on a terminal, lines elsewhere, nothing for quick work or when asked to be quiet.

    Yields
    ------
    progress : function
        progress(title, total) gives a function of the number of points just done.
    """
    with _compilation_said():
        if is_quiet():
            yield lambda *_: lambda _: None
        elif sys.stderr.isatty():
            with _bars() as progress:
                yield progress
        else:
            yield _lines


@contextmanager
def _compilation_said():
    """Say once why work takes longer, when loops have been compiled for a while."""
    from numba.core.event import Listener, install_listener

    class Compilation(Listener):
        due = float("inf")
        is_said = False

        def on_start(self, _event):
            self.due = min(self.due, monotonic() + PATIENCE)
            if monotonic() >= self.due and not self.is_said:
                self.is_said = True
                say(COMPILING)

        def on_end(self, _event):
            pass

    with install_listener("numba:compile", Compilation()):
        yield


@contextmanager
def _bars():
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True)) as bars:

        def progress(title, total):
            task = bars.add_task(title, total=total, visible=False)
            start = monotonic()
            return lambda points: bars.update(
                task, advance=points, visible=monotonic() - start > PATIENCE
            )

        yield progress


def _lines(title, total):
    done = 0
    due = monotonic() + PATIENCE

    def advance(points):
        nonlocal done, due
        done += points
        if monotonic() > due:
            due = monotonic() + INTERVAL
            say(f"{title}: {percent(done / max(total, 1))}")

    return advance
