"""State of a project killed at a random moment, and the result of a resumed run.

    python benchmarks/kill_study.py [KILLS]

A project of two drives in four files each is corrected without a disturbance. Then, KILLS times (60
by default) in turn: a worker, the command itself, the scheduler of a cluster is ended by SIGKILL,
the disk is full (a file system in memory, which only root may mount), or the command is interrupted
as by Ctrl-C. Files in the folder must then be complete, and ``--resume`` must give the same bytes
without repeating finished tasks. Times don't matter, so other work may run at the same time.
"""

import argparse
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path
from time import monotonic, sleep

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))
from tests.beds import project_street as bed  # noqa: E402

TILES = 4  # of a drive
WORKERS = 2
WORKERS_START = 6.0  # s until a cluster has them
DASK = str(Path(sys.executable).with_name("dask"))
COMMAND = [sys.executable, "-m", "mlscorr", "correct"]
ENDED = re.compile(r" (tiles|findings|clouds|reports): (.+) in [\d.]+ s$")
DISK = 400_000_000  # bytes of the file system, more than the results take


class Case:
    "A run that is disturbed, and resumed"

    def __init__(self, project, out, expected):
        self.project = project
        self.out = out
        self.expected = expected
        self.process = None

    def start(self, *arguments):
        "Begin a run"
        command = [*COMMAND, str(self.project), "-o", str(self.out), "--no-report", *arguments]
        self.process = subprocess.Popen(
            command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, start_new_session=True
        )

    def wait(self, seconds):
        "Wait until a moment after the start, unless the run ends before"
        due = monotonic() + seconds
        while monotonic() < due and self.process.poll() is None:
            sleep(0.02)

    def end(self):
        "Exit code of the run, once it has ended"
        self.process.communicate()
        return self.process.returncode

    def done(self, line=0):
        "Number of finished tasks, from a line of the log on"
        log = self.out / "log.txt"
        if log.is_file():
            lines = log.read_text().splitlines()[line:]
        else:
            lines = []
        return Counter(match.groups() for match in map(ENDED.search, lines) if match)

    def resumed(self):
        "Sentences on errors after --resume"
        left = contents(self.out)
        left.pop("project.json", None)  # which counts the workers that were lost
        wrong = [f"{n} is half" for n, content in left.items() if content != self.expected.get(n)]
        before = self.done()
        log = self.out / "log.txt"
        line = len(log.read_text().splitlines()) if log.is_file() else 0
        again = ["--resume"] if (self.out / "tasks").is_dir() else []
        self.start("--workers", str(WORKERS), *again)
        if code := self.end():
            wrong.append(f"--resume ended with {code}")
        wrong += [f"{' '.join(name)} was done again" for name in before if name in self.done(line)]
        if contents(self.out) != self.expected:
            wrong.append("bytes are not the same")
        return wrong, sum(self.done(line).values())


def contents(out):
    "Bytes of all results except those with their time of creation, and of tasks"
    if out.is_dir():
        names = [path for path in out.rglob("*") if path.is_file()]
    else:
        names = []
    return {
        str(path.relative_to(out)): path.read_bytes()
        for path in names
        if path.relative_to(out).parts[0] != "tasks" and path.suffix not in (".html", ".txt")
    }


def children(number):
    "Process IDs of all descendants of a process"
    tasks = Path(f"/proc/{number}/task")
    own = [int(n) for path in tasks.glob("*/children") for n in path.read_text().split()]
    return own + [n for child in own for n in children(child)]


def lose_worker(case, moment, rng):
    "Kill one of the workers; the run goes on"
    case.start("--workers", str(WORKERS))
    case.wait(moment)
    if workers := [n for n in children(case.process.pid) if is_worker(n)]:
        os.kill(int(rng.choice(workers)), signal.SIGKILL)
    return case.end()


def is_worker(number):
    "True if a process works on tasks"
    try:
        return b"spawn_main" in Path(f"/proc/{number}/cmdline").read_bytes()
    except OSError:
        return False


def lose_command(case, moment, rng):
    "Kill the command itself"
    case.start("--workers", str(WORKERS))
    case.wait(moment)
    case.process.kill()
    return case.end()


def lose_scheduler(case, moment, rng):
    "Kill the scheduler of a cluster of two workers"
    silent = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "scheduler.json"
        shared = ["--scheduler-file", str(file)]
        alone = [DASK, "scheduler", *shared, "--port", "0", "--dashboard-address", ":0"]
        scheduler = subprocess.Popen(alone, **silent)
        while not file.is_file():
            sleep(0.1)
        several = ["--nworkers", str(WORKERS), "--nthreads", "1", "--death-timeout", "20"]
        workers = subprocess.Popen(
            [DASK, "worker", *shared, *several, "--no-dashboard"], **silent, start_new_session=True
        )
        try:
            sleep(WORKERS_START)
            case.start("--scheduler", json.loads(file.read_text())["address"])
            case.wait(moment)
            scheduler.kill()
            return case.end()
        finally:
            scheduler.kill()
            os.killpg(workers.pid, signal.SIGKILL)


def fill_disk(case, moment, rng):
    "Fill the disk at a given moment"
    case.out.mkdir(parents=True)
    mount = ["mount", "-t", "tmpfs", "-o", f"size={DISK}", "tmpfs", str(case.out)]
    subprocess.run(mount, check=True)
    case.start("--workers", str(WORKERS))
    case.wait(moment)
    filler = case.out / "filler.txt"
    try:
        with open(filler, "wb", buffering=0) as file:
            while file.write(bytes(1 << 20)):
                pass
    except OSError:
        pass
    code = case.end()
    filler.unlink()
    return code


def interrupt_command(case, moment, rng):
    "Interrupt the command by Ctrl-C"
    case.start("--workers", str(WORKERS))
    case.wait(moment)
    case.process.send_signal(signal.SIGINT)
    return case.end()


DISTURBANCES = (lose_worker, lose_command, lose_scheduler, fill_disk, interrupt_command)


def tell(rows, wrong, seconds):
    "Print a row for each disturbance, and the errors found"
    table = Table("disturbed", "runs", "moments, s", "exit codes", "tasks when resumed", "wrong")
    for name, cases in rows.items():
        moments, codes, tasks, faults = zip(*cases, strict=True)
        table.add_row(
            name,
            str(len(cases)),
            f"{min(moments):.1f} to {max(moments):.1f}",
            ", ".join(f"{code} ({n} x)" for code, n in sorted(Counter(codes).items())),
            f"{min(tasks)} to {max(tasks)}",
            str(sum(map(bool, faults))),
        )
    console = Console(width=110)
    console.print(table)
    console.print(f"Undisturbed: {seconds:.1f} s.")
    for sentence in wrong:
        console.print(sentence)


def main(kills=60):
    rng = np.random.default_rng(0)
    rows = {}
    wrong = []
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        project = bed.write_project(folder / "city", duration=6.0, tiles=TILES)
        whole = Case(project, folder / "whole", {})
        begin = monotonic()
        whole.start("--workers", str(WORKERS))
        if code := whole.end():
            sys.exit(f"The run that nothing disturbs ended with {code}.")
        seconds = monotonic() - begin
        expected = contents(whole.out)
        for number in track(range(kills)):
            disturb = DISTURBANCES[number % len(DISTURBANCES)]
            case = Case(project, folder / f"out-{number}", expected)
            moment = float(rng.uniform(0.5, seconds))
            name = disturb.__name__.replace("_", " ")
            code = disturb(case, moment, rng)
            faults, tasks = case.resumed()
            rows.setdefault(name, []).append((moment, code, tasks, faults))
            wrong += [f"{name} at {moment:.1f} s: {fault}" for fault in faults]
            if os.path.ismount(case.out):
                subprocess.run(["umount", str(case.out)], check=True)
            shutil.rmtree(case.out)
    tell(rows, wrong, seconds)
    if wrong:
        return 1
    return 0


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("kills", nargs="?", type=int, default=60)
    sys.exit(main(parser.parse_args().kills))
