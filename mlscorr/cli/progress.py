"""Stages of a command on stderr: bars and spinners on a terminal, otherwise lines.

A stage runs until the next one begins. With a known end it has a bar and the remaining time,
otherwise a spinner and the elapsed time. A bar that is full before its stage ends becomes a
spinner.
"""

import logging
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic
from typing import Any

from mlscorr.cli.terminal import is_quiet, say
from mlscorr.wording import counted, percent

COMPILING = "compiling loops, once on this machine"
LOADING = "Loading libraries"
PATIENCE = 1.0  # s; guard: quicker stages are not shown, as nobody could read them
# s; guard: Python itself took its time before this stage, in which nothing was shown
LOADING_PATIENCE = 0.2
INTERVAL = 60.0  # s between lines on one stage where stderr is no terminal; guard

Progress = Callable[..., Callable[[int], object]]
LOG = logging.getLogger(__name__)


class Stages:
    """Consecutive stages of a command; this class displays nothing and only logs.

    Parameters
    ----------
    title : str
        Title of the running stage; empty before the first and after the last.
    start : float
        Start of this stage, on the monotonic clock. Units: s.
    compiled : int
        Number of loops that were compiled.
    compiling : float
        Time for compilation. Units: s.
    """

    def __init__(self) -> None:
        self.title = ""
        self.start = monotonic()
        self.compiled = 0
        self.compiling = 0.0

    def begin(self, title: str, total: int | None = None) -> Callable[[int], object]:
        """End the running stage, and begin another.

        Parameters
        ----------
        title : str
        total : int, optional
            Number of points, or other units; None if unknown.

        Returns
        -------
        function of the number just done
        """
        self.end()
        self.title = title
        self.start = monotonic()
        return self._shown(title, total)

    def end(self) -> None:
        """End the running stage."""
        if self.title:
            seconds = monotonic() - self.start
            LOG.info("%s: %.1f s", self.title, seconds)
            self._ended(seconds)
        self.title = ""

    def compile(self, is_begun: bool, seconds: float = 0.0) -> None:
        """Count a compiled loop.

        Parameters
        ----------
        is_begun : bool
            True at the beginning, False at the end.
        seconds : float
            Duration.
        """
        if not is_begun:
            self.compiled += 1
            self.compiling += seconds

    def _shown(self, _title: str, _total: int | None) -> Callable[[int], object]:
        """Display that a stage has begun."""
        return lambda _done: None

    def _ended(self, _seconds: float) -> None:
        """Display that the stage has ended."""


class Lines(Stages):
    """Line for each stage at its end; long stages also have a line every minute."""

    def _shown(self, title, total):
        done = 0
        due = monotonic() + INTERVAL

        def advance(number):
            nonlocal done, due
            done += number
            if total and monotonic() > due:
                due = monotonic() + INTERVAL
                say(f"{title}: {percent(min(done / total, 1.0))} so far")

        return advance

    def _ended(self, seconds):
        if seconds >= PATIENCE:
            say(f"{self.title}: {seconds:.1f} s")

    def compile(self, is_begun: bool, seconds: float = 0.0) -> None:
        """Report once that loops are compiled."""
        if is_begun and not self.compiled and self.compiling == 0.0:
            say(f"{COMPILING.capitalize()} ...")
        super().compile(is_begun, seconds)


class Bars(Stages):
    """Bar or spinner for each stage on a terminal, redrawn several times per second.

    Parameters
    ----------
    bars : rich.progress.Progress
    """

    def __init__(self, bars: Any) -> None:
        super().__init__()
        self.bars = bars
        self.task: Any = None

    def _shown(self, title, total):
        task = self.task = self.bars.add_task(title, total=total)
        done = 0

        def advance(number):
            nonlocal done
            done += number
            if total is None or done < total:
                self.bars.update(task, completed=done)
            else:  # work continues for an unknown time
                self._pulse(task)

        return advance

    def _pulse(self, task):
        """Turn a bar into a spinner; rich does not accept a total of None for a change."""
        for row in self.bars.tasks:
            if row.id == task:
                row.total = None

    def _ended(self, seconds):
        if seconds < PATIENCE:
            self.bars.remove_task(self.task)
        else:
            self.bars.update(self.task, description=self.title, total=1, completed=1)

    def compile(self, is_begun: bool, seconds: float = 0.0) -> None:
        """Show compilation next to the stage while it lasts."""
        super().compile(is_begun, seconds)
        if self.title:
            words = f"{self.title}, {COMPILING}" if is_begun else self.title
            self.bars.update(self.task, description=words)


@contextmanager
def progress_bars() -> Iterator[Progress]:
    """Open bars on a terminal, otherwise lines; nothing for quick work or in quiet mode.

    Yields
    ------
    progress : function
        progress(title, total) begins a stage and returns a function of the number of points, or
        other units, just done. Without a total, the end is unknown.
    """
    with _stages() as stages:
        start = monotonic()
        stages.begin(LOADING)  # which takes seconds before anything else can begin
        try:
            with _compilations(stages):
                yield stages.begin
        finally:
            stages.end()
        seconds = monotonic() - start
    if stages.compiling >= PATIENCE:
        loops = counted(stages.compiled, "loop")
        share = percent(min(stages.compiling / max(seconds, PATIENCE), 1.0))
        say(
            f"{loops} compiled in {stages.compiling:.0f} s, {share} of the time; the next run on "
            "this machine saves it."
        )


@contextmanager
def _stages() -> Iterator[Stages]:
    """Open the stages suitable for stderr."""
    if is_quiet():
        yield Stages()
    elif sys.stderr.isatty():
        with _rich_bars() as bars:
            yield Bars(bars)
    else:
        yield Lines()


@contextmanager
def _compilations(stages: Stages) -> Iterator[None]:
    """Report each compiled loop to stages; nested loops count once."""
    from numba.core.event import Listener, install_listener

    class Compilation(Listener):
        depth = 0
        begun = 0.0

        def on_start(self, _event):
            if self.depth == 0:
                self.begun = monotonic()
                stages.compile(True)
            self.depth += 1

        def on_end(self, _event):
            self.depth -= 1
            if self.depth == 0:
                stages.compile(False, monotonic() - self.begun)

    with install_listener("numba:compile", Compilation()):
        yield


def _is_shown(task: Any) -> bool:
    """True if a stage has run long enough to be shown."""
    patience = PATIENCE
    if task.description.startswith(LOADING) and not task.finished:
        patience = LOADING_PATIENCE
    return (task.elapsed or 0.0) >= patience


def _rich_bars() -> Any:
    """Make rich's bars: description, progress, elapsed and remaining time."""
    from rich import progress
    from rich.console import Console

    class Remaining(progress.ProgressColumn):
        """Remaining time, if known."""

        def render(self, task):
            seconds = task.time_remaining
            if task.total is None or task.finished or seconds is None:
                return ""
            return f"{int(seconds) // 60}:{int(seconds) % 60:02d} left"

    class Shown(progress.Progress):
        """Tasks that last long enough to be read."""

        def get_renderables(self):
            yield self.make_tasks_table([task for task in self.tasks if _is_shown(task)])

    return Shown(
        progress.SpinnerColumn(finished_text=" "),
        progress.TextColumn("{task.description}", markup=False),
        progress.BarColumn(bar_width=20),
        progress.TaskProgressColumn(),
        progress.TimeElapsedColumn(),
        Remaining(),
        console=Console(stderr=True),
    )
