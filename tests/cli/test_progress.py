"""What is said while work goes on."""

from numba.core.event import trigger_event

from mlscorr.cli import progress
from mlscorr.cli.progress import progress_bars


def compile_loops(number):
    "What numba announces when it compiles loops"
    with progress_bars():
        for _ in range(number):
            with trigger_event("numba:compile"):
                pass


def test_that_loops_are_compiled_is_said_once(monkeypatch, capsys):
    "When it takes longer than a person likes to wait, a single sentence says why"
    monkeypatch.setattr(progress, "PATIENCE", 0.0)
    compile_loops(3)
    assert capsys.readouterr().err == progress.COMPILING + "\n"


def test_loops_that_are_compiled_quickly_are_not_spoken_of(capsys):
    "Work that compiles for less than the patience says nothing"
    compile_loops(3)
    assert capsys.readouterr().err == ""
