"""Gain from workers and cost of tasks: a project of tiles against a survey of the same files.

    python benchmarks/bench_scale.py [DRIVES] [KILLS] [--points MILLIONS] [--workers-alone]

A simulated street is driven DRIVES times (2 by default). In the same run are timed: the single
survey of one drive, a project of that drive, the project of all drives with one worker and with
two, and a resumed run with nothing to do, each with the memory of its largest process. Then the
client is killed at KILLS random moments (2 by default), and resumed each time: the bytes must be
the same. Absolute times mean nothing on a busy machine; ratios within one run do if nothing else is
running.
"""

import argparse
import multiprocessing
import os
import signal
import subprocess
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from time import perf_counter, process_time, sleep

import numpy as np
from rich.console import Console
from rich.table import Table

TILES = 4  # of a drive
SECONDS = 12.0  # of a drive
LINES = 250  # a second
SEEN = 0.75  # of a scanner's pulses come back
COMMAND = [sys.executable, "-m", "mlscorr", "correct"]
SINGLE = {"RAYON_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}  # as in each of more workers


def apart(function, *arguments):
    """Call a function in another process, because a child's memory starts at its parent's."""
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=context) as executor:
        return executor.submit(function, *arguments).result()


def write_drive(folder, number, points):
    """Write a survey in tiles of a number of points: the same street each time, another POS."""
    import laspy

    from mlscorr.simulate import Scenario, simulate

    pulses = round(points * TILES / (SECONDS * LINES * SEEN))
    scenario = Scenario(
        drive={"duration": SECONDS},
        targets={"control": 6, "check": 2, "hidden": 0.0},
        scanner=[{"lines_per_second": LINES, "points_per_line": pulses}],
        start_time=357_700.0 + 3600 * number,
    )
    simulate(scenario, np.random.default_rng(7)).write(folder)
    cloud = laspy.read(folder / "pass-1.laz")
    for tile, rows in enumerate(np.array_split(np.arange(len(cloud.points)), TILES), start=1):
        part = laspy.LasData(cloud.header)
        part.points = cloud.points[rows]
        part.write(folder / f"tile-{tile}.laz")
    (folder / "pass-1.laz").unlink()
    text = (folder / "survey.toml").read_text().replace('"pass-1.laz"', '"tile-*.laz"')
    (folder / "survey.toml").write_text(text)
    return len(cloud.points)


def write_project(folder, numbers, name):
    """Write a project.toml of some drives."""
    drives = "".join(f'\n[[drive]]\nsurvey = "drive-{number}"\n' for number in numbers)
    path = folder / f"{name}.project.toml"
    path.write_text(f'[control]\nfile = "drive-0/control.csv"\n{drives}')
    return path


def timed(*arguments):
    """Cost of a correction without pages: wall and total processor seconds, MB (3,).

    The memory is that of the largest of its processes.
    """
    start = perf_counter()
    command = [*COMMAND, *map(str, arguments), "--no-report", "--quiet"]
    process = subprocess.Popen(command, stderr=subprocess.DEVNULL, env=os.environ | SINGLE)
    _, status, used = os.wait4(process.pid, 0)
    if status:
        raise subprocess.CalledProcessError(os.waitstatus_to_exitcode(status), command)
    worked = used.ru_utime + used.ru_stime
    return np.array([perf_counter() - start, worked, used.ru_maxrss * 1024 / 1e6])


def outputs(out):
    """Bytes of the clouds and documents of a project's results."""
    found = [*out.glob("*/*.laz"), *out.glob("*/*.csv"), *out.glob("**/report.json")]
    return {path.relative_to(out): path.read_bytes() for path in found}


def killed(project, out, seconds, workers):
    """Kill a run after some seconds, and resume it."""
    command = [*COMMAND, str(project), "-o", str(out), "--no-report", "--workers", str(workers)]
    process = subprocess.Popen(command, stderr=subprocess.DEVNULL, start_new_session=True)
    sleep(seconds)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    again = ["--resume"] if (out / "tasks").is_dir() else []
    return timed(project, "-o", out, "--workers", workers, *again)


def stage_costs(project, out, points):
    """Processor seconds of each stage of a project for 1e9 points, all in this process."""
    from mlscorr.pipeline.project import correct_project
    from mlscorr.pipeline.project.progress import Progress

    costs = {}
    begun = {"stage": "headers", "at": process_time()}

    def count(stage):
        now = process_time()
        costs[begun["stage"]] = costs.get(begun["stage"], 0.0) + now - begun["at"]
        begun.update(stage=stage, at=now)

    begin = Progress.begin

    def watched(self, kind, tasks):
        names = {"findings": "targets and ties", "clouds": "copies", "reports": "reports"}
        count(names.get(kind, "headers"))
        begin(self, kind, tasks)

    Progress.begin = watched
    try:
        correct_project(
            project, out, notify=lambda text: text.startswith("Estim") and count("estimate")
        )
    finally:
        Progress.begin = begin
    count("")
    return {stage: seconds * 1e9 / points for stage, seconds in costs.items()}


def main(drives, kills, million_points, workers_alone):
    """Print the table and the stages; return True if all bytes are the same."""
    rng = np.random.default_rng(0)
    table = Table("run", "s", "processor s", "MB", "against")
    costs = {}

    def row(name, cost, other=None, words=""):
        """Add a row, and the ratios of both times to those of another one."""
        ratio = other is not None and "{:.2f}, {:.2f} x {}".format(*(cost / other)[:2], words)
        table.add_row(name, *(f"{value:.1f}" for value in cost), ratio or "")
        return cost

    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        folders = [folder / f"drive-{number}" for number in range(drives)]
        points = sum(
            apart(write_drive, path, number, 1e6 * million_points)
            for number, path in enumerate(folders)
        )
        whole = write_project(folder, range(drives), "whole")
        if not workers_alone:
            single = write_project(folder, [0], "single")
            timed(folder / "drive-0", "-o", folder / "warm")  # compiles what is compiled once
            alone = row("survey", timed(folder / "drive-0", "-o", folder / "alone"))
            row("project of it", timed(single, "-o", folder / "single"), alone, "the survey")
        first = row(f"{drives} drives, 1 worker", timed(whole, "-o", folder / "first"))
        second = timed(whole, "-o", folder / "second", "--workers", 2)
        row("2 workers", second, first, "one worker")
        nothing = timed(whole, "-o", folder / "second", "--workers", 2, "--resume")
        row("resumed, nothing to do", nothing, second, "two workers")
        expected = outputs(folder / "first")
        same = outputs(folder / "second") == expected
        for number in range(kills):
            out = folder / f"kill-{number}"
            moment = rng.uniform(2.0, second[0])
            row(f"killed after {moment:.1f} s, resumed", killed(whole, out, moment, 2))
            same &= outputs(out) == expected
        if not workers_alone:
            costs = apart(stage_costs, whole, folder / "costs", points)
    console = Console()
    console.print(table)
    if costs:
        console.print("Processor time for 1e9 points, one core, by the stages of these few points:")
    for stage, seconds in costs.items():
        console.print(f"  {stage}: {seconds / 60:.0f} min")
    console.print(f"{points} points in {drives * TILES} tiles; bytes the same: {same}")
    if same:
        return 0
    return 1


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("drives", type=int, nargs="?", default=2)
    parser.add_argument("kills", type=int, nargs="?", default=2)
    parser.add_argument("--points", type=float, default=0.7, help="Of a tile. Units: million.")
    parser.add_argument(
        "--workers-alone", action="store_true", help="No survey by itself, and no stages."
    )
    given = parser.parse_args()
    sys.exit(main(given.drives, given.kills, given.points, given.workers_alone))
