"""Time and memory of the diagnosis of a large survey, compared with bare decoding of its clouds.

    python benchmarks/bench_gap.py [millions of points]

By default 5 million points on two passes, with a reference surface. Absolute times mean little on a
busy machine, so laspy decodes the same clouds before and after, each in a separate process.
"""

import argparse
import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter, process_time

import laspy
import numpy as np
from rich.console import Console
from rich.table import Table

import mlscorr
from mlscorr.simulate import Scenario, simulate

CHUNK = 1_000_000  # points


def make(folder, millions):
    """Two opposite passes of a street, with an effect to find."""
    scenario = Scenario(
        scene={"reference": True},
        drive={"duration": millions * 8.0, "passes": [{}, {"direction": "back"}]},
        targets={"control": 16, "check": 8},
        scanner=[{"lines_per_second": 150, "points_per_line": 560}],
        effects=[{"name": "time_offset", "magnitude": 0.005}],
    )
    simulate(scenario, np.random.default_rng(1)).write(folder)


def decode(folder):
    """Number of points of the clouds, decoded."""
    points = 0
    for path in sorted(Path(folder).glob("*.laz")):
        with laspy.open(path) as reader:
            points += sum(len(chunk) for chunk in reader.chunk_iterator(CHUNK))
    return f"{points / 1e6:.2f} million points"


def diagnose(folder):
    """Run the whole diagnosis, reading included, and return its headline."""
    told = mlscorr.diagnose(mlscorr.read_survey(folder)).document
    rows = sum(told["channels"].values())
    return f"{told['verdict']['label']} of {rows} rows"


TASKS = {"decode": decode, "diagnose": diagnose}


def measured(task, folder):
    """Run a task in a separate process: its output, wall and processor time (s), memory (MB)."""
    command = [sys.executable, __file__, "--task", task, str(folder)]
    *told, wall, used, memory = subprocess.check_output(command, text=True).strip().rsplit(" ", 3)
    return " ".join(told), float(wall), float(used), float(memory)


def child(task, folder):
    """Run one task and print the figures that `measured` reads."""
    start = perf_counter()
    told = TASKS[task](folder)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    print(told, round(perf_counter() - start, 2), round(process_time(), 2), round(peak))


def main():
    if sys.argv[1:2] == ["--task"]:
        child(*sys.argv[2:])
        return
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("millions", nargs="?", type=float, default=5.0, help="of points")
    millions = parser.parse_args().millions
    table = Table("task", "wall (s)", "processor (s)", "peak memory (MB)", "result")
    with tempfile.TemporaryDirectory() as folder:
        make(Path(folder) / "survey", millions)
        for task in ("decode", "diagnose", "decode"):
            told, wall, used, memory = measured(task, Path(folder) / "survey")
            table.add_row(task, f"{wall:.1f}", f"{used:.1f}", f"{memory:.0f}", told)
    Console().print(table)


if __name__ == "__main__":
    main()
