"""Stages of a command, as a terminal and a file show them."""

import re
import time

from numba.core.event import trigger_event

from mlscorr.cli import progress
from mlscorr.cli.progress import progress_bars


def test_each_stage_has_a_line_with_its_time(monkeypatch, capsys):
    "If stderr is no terminal, a stage that takes long enough is one line at its end"
    monkeypatch.setattr(progress, "PATIENCE", 0.05)
    with progress_bars() as begin:
        begin("Reading the cloud", 100)(100)
        time.sleep(0.1)
        begin("Matching targets")
        time.sleep(0.1)
        begin("Too quick to be read")
    lines = capsys.readouterr().err.splitlines()
    assert [re.sub(r"\d+\.\d s", "T s", line) for line in lines[-2:]] == [
        "Reading the cloud: T s",
        "Matching targets: T s",
    ]


def compile_loops(number, seconds):
    "Emit the events of numba when it compiles loops"
    with progress_bars():
        for _ in range(number):
            with trigger_event("numba:compile"):
                time.sleep(seconds)


def test_compiled_loops_are_announced_once_with_their_share(monkeypatch, capsys):
    "Three loops that take all the time: one line when it begins, one with their number and share"
    monkeypatch.setattr(progress, "PATIENCE", 0.05)
    compile_loops(3, 0.05)
    lines = [line for line in capsys.readouterr().err.splitlines() if "loop" in line]
    assert lines[0] == "Compiling loops, once on this machine ..."
    assert re.match(r"3 loops compiled in \d+ s, [\d.]+ % of the time", lines[1])
    assert len(lines) == 2


def bars(monkeypatch, capsys, work):
    "Output of a terminal at the end of some work"
    monkeypatch.setattr(progress, "PATIENCE", 0.0)
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    with progress_bars() as begin:
        work(begin)
    return capsys.readouterr().err


def test_a_full_bar_does_not_stand_still(monkeypatch, capsys):
    "A stage whose count is reached before it ends has no 100 % until it does"
    shown = []

    class Watched(progress.Bars):
        def end(self):
            shown.extend((task.description, task.total) for task in self.bars.tasks)
            super().end()

    monkeypatch.setattr(progress, "Bars", Watched)
    bars(monkeypatch, capsys, lambda begin: begin("Reading the cloud", 10)(10))
    assert ("Reading the cloud", None) in shown
