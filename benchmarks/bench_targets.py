"""Speed and memory of the target search, compared with the decoding of its clouds.

    python benchmarks/bench_targets.py [millions of points ...]

By default 2 and 20 million points: a simulated street, repeated file after file for more than 20.
Absolute times mean nothing on a busy machine, so each extraction runs between two bare decodings by
laspy in separate processes, and the ratios are reported; that of processor time is steadier.
"""

import argparse
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from time import perf_counter, process_time

import laspy
import numpy as np
from rich.console import Console
from rich.table import Table

import mlscorr
from mlscorr.io.tables.control import NO_POINTS
from mlscorr.simulate import Scenario, simulate

CHUNK = 1_000_000  # points
RUNS = "decode", "extract", "decode", "extract without control", "decode"


def make_street(folder, points):
    """Write a drive of a third of a million points per second with a target every 25 m."""
    seconds = points / 333_000
    scenario = Scenario(
        drive={"duration": seconds},
        targets={"control": max(1, round(seconds * 16 / 60)), "check": round(seconds * 8 / 60)},
        scanner=[{"lines_per_second": 200, "points_per_line": 1667}],
    )
    simulate(scenario, np.random.default_rng(1)).write(folder)


def decode(folder):
    """Decode the clouds by laspy alone, and return the number of points."""
    points = 0
    for path in sorted(Path(folder).glob("*.laz")):
        with laspy.open(path) as reader:
            points += sum(len(chunk) for chunk in reader.chunk_iterator(CHUNK))
    return points


def extract(folder, with_control):
    """Extract without writing: number of surveyed points found, and of other objects."""
    survey = mlscorr.read_survey(folder)
    surveyed = survey.surveyed
    if not with_control:
        survey = replace(survey, control=NO_POINTS, check=NO_POINTS)
    rows = mlscorr.extract(survey).targets
    place = np.array([row["observed"] for row in rows]).reshape(-1, 3)
    apart = np.linalg.norm(place[None] - surveyed.position[:, None], axis=2)
    near = apart < 0.3
    return near.any(axis=1).sum(), len(surveyed), (~near.any(axis=0)).sum()


def measure(task, folder):
    """Run one task in this process: wall and processor seconds, MB above the imports, result."""
    imported = memory("VmRSS")
    if task != "decode":
        extract(WARM_UP, task == "extract")  # compiled kernels are loaded once
    start = perf_counter()
    used = process_time()
    if task == "decode":
        result = decode(folder)
    else:
        result = extract(folder, task == "extract")
    seconds = perf_counter() - start, process_time() - used
    return *seconds, memory("VmHWM") - imported, result


def memory(name):
    """Memory of this process: VmRSS is the current, VmHWM the largest value. Units: MB."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) / 1024 for line in lines if line.startswith(name))


def in_own_process(task, folder, warm_up):
    command = [sys.executable, "-W", "ignore", __file__, "--task", task, str(folder), str(warm_up)]
    out = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    return [float(word) for word in out]


def speed_table(millions, folder):
    """Print rates and peak memory for several sizes."""
    table = Table(
        "points",
        "task",
        "s",
        "processor s",
        "of decoding: wall",
        "processor",
        "MB over imports",
        "surveyed found, others",
        title="Extraction, beside laspy's decoding in the same run",
    )
    warm_up = folder / "warm up"
    make_street(warm_up, 1_500_000)
    for million in millions:
        survey = folder / f"{million:g}"
        make_street(survey, min(million, 20) * 1e6)
        if million > 20:
            repeat(survey, round(million / 20))
        points = decode(survey)
        results = [in_own_process(task, survey, warm_up) for task in RUNS]
        decoding = np.median(
            [r[:2] for r, task in zip(results, RUNS, strict=True) if task == "decode"], axis=0
        )
        for task, (wall, used, peak, *rest) in zip(RUNS, results, strict=True):
            if rest[1:]:
                found = f"{rest[0]:.0f} of {rest[1]:.0f}, {rest[2]:.0f}"
            else:
                found = ""
            table.add_row(
                f"{points:,}",
                task,
                f"{wall:.1f}",
                f"{used:.1f}",
                f"{decoding[0] / wall:.2f}",
                f"{decoding[1] / used:.2f}",
                f"{peak:.0f}",
                found,
            )
    return table


def repeat(folder, times):
    """List the clouds several times, as if they were other files."""
    settings = (folder / "survey.toml").read_text()
    names = [f"again-{i}.laz" for i in range(times)]
    for name in names:
        (folder / name).symlink_to(folder / "pass-1.laz")
    quoted = ", ".join(f'"{name}"' for name in names)
    (folder / "survey.toml").write_text(settings.replace('"pass-1.laz"', quoted))


def main(millions):
    console = Console(width=110)
    with tempfile.TemporaryDirectory() as folder:
        console.print(speed_table(millions, Path(folder)))


if __name__ == "__main__":
    if sys.argv[1:2] == ["--task"]:
        task, survey, WARM_UP = sys.argv[2:]
        *numbers, result = measure(task, survey)
        print(*numbers, *np.atleast_1d(result))
    else:
        parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
        parser.add_argument("millions", nargs="*", type=float, default=[2.0, 20.0], help="points")
        main(parser.parse_args().millions)
