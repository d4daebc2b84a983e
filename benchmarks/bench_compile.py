"""Processor time that the first `correct` on a machine takes to compile, by room and function.

    python benchmarks/bench_compile.py [survey.toml ...]

By default the survey of `mlscorr demo`, which is simulated first, untimed. Each survey is corrected
twice in separate processes: with an empty folder for compiled loops, and again with the folder
that the first left. The difference is the delay for a new user; seconds are processor time.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path
from time import process_time

import numpy as np
from numba.core import event
from rich.console import Console
from rich.table import Table

import mlscorr
from mlscorr.simulate import DEMO, simulate

SHOWN = 40  # functions of the table, the slowest
CONSOLE = Console(width=110)


class Seconds(event.Listener):
    """Processor time of compiling each function, excluding its callees.

    numba compiles a callee while it infers the types of its caller, so that events nest.
    """

    def __init__(self):
        self.own = Counter()
        self.count = Counter()
        self._open = []  # (begin, seconds of callees) of the functions being compiled

    def on_start(self, event):
        self._open.append([process_time(), 0.0])

    def on_end(self, event):
        begin, callees = self._open.pop()
        seconds = process_time() - begin
        function = event.data["dispatcher"].py_func
        name = f"{function.__module__}.{function.__qualname__}"
        self.own[name] += seconds - callees
        self.count[name] += 1
        if self._open:
            self._open[-1][1] += seconds


def correct(survey, result):
    """Correct one survey in this process, and write what it compiled."""
    seconds = Seconds()
    event.register("numba:compile", seconds)
    with tempfile.TemporaryDirectory() as folder:
        mlscorr.correct(mlscorr.read_survey(survey)).write(Path(folder) / "out")
    functions = [(name, own, seconds.count[name]) for name, own in seconds.own.items()]
    Path(result).write_text(json.dumps({"total": process_time(), "functions": functions}))


def run(survey, cache, folder):
    """Run the same in a separate process: processor time, and (name, s, count) of each function."""
    result = folder / "result.json"
    subprocess.run(
        [sys.executable, __file__, "--only", result, survey],
        env={**os.environ, "NUMBA_CACHE_DIR": str(cache)},
        check=True,
    )
    document = json.loads(result.read_text())
    return document["total"], document["functions"]


def room(name):
    """Room of a function, or the library that it comes from."""
    parts = name.split(".")
    return parts[1] if parts[0] == "mlscorr" else parts[0]


def show(survey, folder):
    """Print the tables of one survey."""
    with tempfile.TemporaryDirectory() as cache:
        cold, functions = run(survey, cache, folder)
        warm, again = run(survey, cache, folder)
    seconds = Counter()
    signatures = Counter()
    for name, own, count in functions:
        seconds[room(name)] += own
        signatures[room(name)] += count
    rooms = Table("room", "compiled", "s", title=str(survey))
    for name, total in seconds.most_common():
        rooms.add_row(name, str(signatures[name]), f"{total:.1f}")
    rooms.add_row("all", str(signatures.total()), f"{seconds.total():.1f}", style="bold")
    CONSOLE.print(rooms)
    table = Table("function", "compiled", "s")
    for name, own, count in sorted(functions, key=lambda row: -row[1])[:SHOWN]:
        table.add_row(name.removeprefix("mlscorr."), str(count), f"{own:.2f}")
    CONSOLE.print(table)
    CONSOLE.print(
        f"cold {cold:.1f} s, warm {warm:.1f} s, difference {cold - warm:.1f} s, of which "
        f"{seconds.total():.1f} s in functions; compiled again when warm: {len(again)}"
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("surveys", nargs="*", type=Path)
    parser.add_argument("--only", type=Path, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.only is not None:
        correct(arguments.surveys[0], arguments.only)
        return
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        surveys = arguments.surveys
        if not surveys:
            simulate(DEMO, np.random.default_rng(1)).write(folder / "survey")
            surveys = [folder / "survey"]
        for survey in surveys:
            show(survey, folder)


if __name__ == "__main__":
    main()
