"""Runs of commands in which a system call fails or a signal comes, seen from outside.

A process loads the libraries once and forks a run for each fault, so that a run costs what it does
itself. Results of ``correct`` may be computed before the fork too: what fails then is the writing.
"""

import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
from dataclasses import dataclass

from tests.beds.places import ROOT

# Forks a run for each line of JSON on stdin: prints its number, and its exit code when it ends
SERVER = """
import json, os, signal, sys, warnings
import mlscorr, mlscorr.cli, mlscorr.cli.terminal, mlscorr.pipeline.simulation
import mlscorr.pipeline.calibration, mlscorr.pipeline.extraction, mlscorr.pipeline.correction
with warnings.catch_warnings(action="ignore"):
    survey = mlscorr.read_survey(sys.argv[1])
    result = mlscorr.correct(survey)
kept = mlscorr.read_survey, mlscorr.correct
for line in sys.stdin:
    task = json.loads(line)
    child = os.fork()
    if child:
        print(child, flush=True)
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
        continue
    mlscorr.cli.terminal.listen()
    for number, name in enumerate(("out", "err"), 1):
        os.dup2(os.open(task[name], os.O_WRONLY | os.O_CREAT | os.O_TRUNC), number)
    if task["is_computed"]:
        mlscorr.read_survey, mlscorr.correct = lambda *_: survey, lambda *_, **__: result
    os.environ.update(task["env"])
    sys.argv = ["mlscorr", *task["command"]]
    mlscorr.cli.main()
    sys.exit()
"""


@dataclass(frozen=True)
class Ended:
    """End of a run: exit code (negative for a signal), stderr, and the remaining files."""

    code: int
    stderr: str
    left: dict

    @property
    def is_told(self):
        "True if an error was reported in one sentence with its cause"
        lines = [line for line in self.stderr.splitlines() if line.startswith("Error: ")]
        return len(lines) == 1 and "Traceback" not in self.stderr


class Stage:
    """A process that forks runs, and the folder into whose folder runs/ they write."""

    def __init__(self, shim, survey, folder):
        self.survey = survey
        self.folder = folder
        self.runs = folder / "runs"
        self.runs.mkdir()
        self.input = content(survey)
        self.process = subprocess.Popen(
            [sys.executable, "-c", SERVER, str(survey)],
            env={**os.environ, "LD_PRELOAD": str(shim)},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            cwd=ROOT,
        )

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.communicate()

    def run(self, *command, is_computed=False, meanwhile=None, **fault):
        """Run a command with -o runs/out; meanwhile(pid) may send it a signal.

        fault: call, number, errno (or a signal below zero); the log of calls with log=path.
        """
        files = {name: str(self.folder / name) for name in ("out", "err")}
        env = {f"FAULT_{name.upper()}": str(value) for name, value in fault.items()}
        env["FAULT_FOLDER"] = f"{self.runs}/"
        command = [*map(str, command), "-o", str(self.runs / "out")]
        task = {"command": command, "env": env, "is_computed": is_computed, **files}
        print(json.dumps(task), file=self.process.stdin, flush=True)
        child = int(self.process.stdout.readline())
        if meanwhile is not None:
            meanwhile(child)
        code = int(self.process.stdout.readline())
        assert content(self.survey) == self.input
        return Ended(code, (self.folder / "err").read_text(), content(self.runs))

    def clear(self, before=None):
        "Put runs/ back to what it was: empty, or a copy of a folder under runs/out"
        shutil.rmtree(self.runs)
        self.runs.mkdir()
        if before is not None:
            shutil.copytree(before, self.runs / "out")

    def calls(self, *command, **how):
        "Name of each call below runs/ in an undisturbed run, and what it writes"
        log = self.folder / "log"
        log.unlink(missing_ok=True)
        ended = self.run(*command, log=log, **how)
        assert ended.code == 0, ended.stderr
        return log.read_text().split(), ended.left


def content(folder):
    "Hash of each file below a folder; None for a folder"
    return {
        str(path.relative_to(folder)): None
        if path.is_dir()
        else hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
    }


def send(process, number):
    "Send a signal to a run, which may have ended"
    try:
        os.kill(process, number)
    except ProcessLookupError:
        assert number in signal.valid_signals()
