"""Cost of drawing 2 M points at 1920 x 1080 by both engines, and memory for 50 M points.

    python benchmarks/bench_render.py
    python benchmarks/bench_render.py --report [SURVEY]

With --report, what the report and pictures of a correction take: of a survey.toml, or of the
simulated drive of examples/scenarios/car.toml, 11 M points.

Absolute times mean little on a busy machine; the goals apply to two idle cores.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter, process_time

import numpy as np
from rich.console import Console
from rich.table import Table

import mlscorr
from mlscorr.frames import attitude_from_angles as attitude
from mlscorr.io import SETTINGS
from mlscorr.report.render import draw
from mlscorr.report.render._sheet import Sheet
from mlscorr.report.render._views import PictureOptions, View
from mlscorr.report.render.view import Camera
from mlscorr.survey import ControlPoints, PointCloud, Survey, Trajectory

CORNER = np.array([532_000.0, 3_374_000.0, 40.0])  # UTM
START = 357_900.0  # s of week
LENGTH = 200.0  # m, of the street
MOVE = np.array([0.3, 0.2, -0.1])  # m
SIZE = (1920, 1080)
PANEL = (936, 847)  # of a page of that size


class Moved:
    """Correction by a constant shift."""

    def apply(self, cloud):
        return PointCloud(cloud.xyz + MOVE, cloud.gps_time, cloud.intensity)


def street(points, seed=1):
    """Chunks of a street with two walls, in random order."""
    rng = np.random.default_rng(seed)
    for first in range(0, points, SETTINGS.chunk_points):
        n = min(SETTINGS.chunk_points, points - first)
        across = rng.uniform(-14, 14, n)
        along = rng.uniform(0, LENGTH, n)
        up = np.maximum(np.abs(across) - 8, 0) * 2
        xyz = CORNER + np.column_stack([np.clip(across, -8, 8), along, up])
        time = START + (first + np.arange(n)) / points * 20.0
        yield PointCloud(xyz, time, 1000 * up + 5000)


def survey():
    """A survey of that street without targets."""
    time = START + np.arange(0.0, 20.1, 0.1)
    position = CORNER + np.outer(time - START, [0.0, LENGTH / 20, 0.0])
    none = ControlPoints((), np.empty((0, 3)), np.empty((0, 3)), (), np.empty(0), np.empty((0, 3)))
    trajectory = Trajectory(time, position, attitude(*np.zeros((3, len(time)))))
    return Survey("street", Path(), None, (), trajectory, None, none, none)


def one_picture(points, by_open3d):
    """Seconds for one picture of 1920 x 1080: half the time of a pair, before and after."""
    clouds = list(street(points))
    focus = CORNER + np.array([0.0, LENGTH / 2, 0.0])
    camera = Camera.towards(focus, -60.0, 35.0, 9.5, SIZE)
    start = perf_counter()
    sheet = Sheet.blank(View("overview", "", "", camera, "height"))
    for cloud in clouds:
        sheet.add(Both(cloud), (cloud.xyz[:, 2], cloud.xyz[:, 2]))
    for data in sheet.finished(by_open3d).panels(decorated=True):
        assert data.startswith(b"\x89PNG")
    return (perf_counter() - start) / 2


class Both:
    """A chunk that is the same before and after."""

    def __init__(self, cloud):
        self.before = self.after = cloud


def peak_memory():
    """Peak memory of this process alone. Units: MB."""
    return int(Path("/proc/self/status").read_text().split("VmHWM:")[1].split()[0]) // 1024


def pictures(points):
    """Draw the overview and a cross-section of streamed points."""
    list(draw(survey(), Moved(), [], PictureOptions(PANEL), chunks=lambda: street(points)))


class Stages:
    """Processor time of each stage of a command. Units: s."""

    def __init__(self):
        self.seconds = {}
        self.title = None
        self.start = process_time()

    def __call__(self, title, _total=None):
        now = process_time()
        if self.title is not None:
            self.seconds[self.title] = self.seconds.get(self.title, 0.0) + now - self.start
        self.title = title
        self.start = now
        return lambda _number: None


def report_table(survey):
    """Processor time of writing a correction without and with its report."""
    corrected = mlscorr.correct(mlscorr.read_survey(survey))
    table = Table("processor time, measured in this run", "", "goal")
    with tempfile.TemporaryDirectory() as folder:
        totals = []
        for is_drawn in (False, True):
            stages = Stages()
            start = process_time()
            corrected.write(Path(folder) / f"{is_drawn}", progress=stages, page=is_drawn)
            totals.append(process_time() - start)
            stages("")
        for title, seconds in stages.seconds.items():
            if title.startswith("Drawing"):
                table.add_row(title, f"{seconds:.1f} s", "")
    points = corrected.survey.points / 1e6
    table.add_row(f"{points:.1f} M points: written without a report", f"{totals[0]:.1f} s", "")
    table.add_row("report and pictures more", f"{totals[1] - totals[0]:.1f} s", "<= 10 s")
    return table


def simulated(folder):
    """The survey.toml of the car's drive, simulated in a folder."""
    scenario = Path(__file__).parents[1] / "examples/scenarios/car.toml"
    command = [sys.executable, "-m", "mlscorr", "simulate", scenario, "-o", folder]
    subprocess.run(command, check=True)
    return Path(folder) / "survey.toml"


def memory(millions):
    """Seconds, and peak memory in MB above that of the imports, of a child that draws."""
    command = [sys.executable, __file__, "--task", str(millions)]
    start = perf_counter()
    peak = int(subprocess.run(command, check=True, capture_output=True).stdout)
    return perf_counter() - start, peak


def main(is_report=False, survey=None):
    if is_report:
        with tempfile.TemporaryDirectory() as folder:
            Console().print(report_table(survey or simulated(folder)))
        return
    table = Table("measured in this run", "", "goal")
    one_picture(1000, False)  # compiles
    for by_open3d, name, goal in ((False, "z-buffer", "<= 3 s"), (True, "Open3D", "<= 6 s")):
        seconds = one_picture(2_000_000, by_open3d)
        table.add_row(f"2 M points, 1920 x 1080, half of a pair: {name}", f"{seconds:.2f} s", goal)
    peaks = []
    for millions in (5, 50):
        seconds, peak = memory(millions)
        peaks.append(peak)
        text = f"{peak} MB, {seconds:.0f} s (both pictures, two passes, points made anew)"
        table.add_row(f"{millions} M points streamed: peak memory over imports", text, "")
    table.add_row("peak memory, 50 M / 5 M points", f"{peaks[1] / peaks[0]:.2f}", "about 1")
    Console().print(table)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--task"]:  # the child whose memory is measured
        before = peak_memory()
        pictures(int(sys.argv[2]) * 1_000_000)
        print(peak_memory() - before)
    else:
        parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
        parser.add_argument("--report", dest="is_report", action="store_true")
        parser.add_argument("survey", nargs="?", type=Path, help="survey.toml, with --report")
        main(**vars(parser.parse_args()))
