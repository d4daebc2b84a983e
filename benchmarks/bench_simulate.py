"""Speed of the simulator against bare ray casting, and its memory, all measured in this run.

    python benchmarks/bench_simulate.py

Absolute times mean nothing on a busy machine, so competitors run in turn and medians are compared.
Both cast the same rays in blocks of the same size; the simulator also generates them, measures the
hits, georeferences these with the recorded poses, and applies the effects.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median
from time import perf_counter

import numpy as np
from bench import peak_memory
from rich.console import Console
from rich.table import Table

from mlscorr.simulate import DEMO, simulate
from mlscorr.simulate.scan import Surfaces
from mlscorr.simulate.scenario import (
    DriveScenario,
    EffectScenario,
    ScannerScenario,
    TargetScenario,
)

LINE = ScannerScenario(lines_per_second=150.0, points_per_line=1000)
SPINNING = ScannerScenario(
    kind="spinning", lines_per_second=10.0, points_per_line=1000, rings=tuple(range(-15, 17, 2))
)
SOME = (  # one for each stage of a pulse
    EffectScenario(name="time_offset", magnitude=0.001),
    EffectScenario(name="range_bias", magnitude=0.01),
    EffectScenario(name="angle_scale", magnitude=1e-4),
    EffectScenario(name="dropout", magnitude=0.05),
)
RANDOM = (
    EffectScenario(name="time_jitter", magnitude=1e-4),
    EffectScenario(name="range_noise", magnitude=0.005),
    EffectScenario(name="angle_noise", magnitude=0.002),
)
SETTINGS = {
    "line scanner": (LINE, ()),
    "spinning, 16 rings": (SPINNING, ()),
    "line scanner, 0.35 mrad": (LINE.model_copy(update={"beam_divergence": 0.35}), ()),
    "line scanner, 4 effects": (LINE, SOME),
    "line scanner, 4 + 3 random effects": (LINE, SOME + RANDOM),
}


def survey(seconds, scanner, effects=()):
    """A drive of some seconds through the demo's street."""
    changes = {
        "drive": DriveScenario(duration=seconds),
        "targets": TargetScenario(control=4, check=2),
        "scanner": (scanner,),
        "effects": effects,
        "pos": DEMO.pos.model_copy(update={"outages": (), "canyons": ()}),
    }
    return simulate(DEMO.model_copy(update=changes), np.random.default_rng(1))


class Recorder(Surfaces):
    """Surfaces that record the rays that were cast."""

    def __init__(self, mesh):
        super().__init__(mesh)
        object.__setattr__(self, "rays", [])

    def cast(self, rays):
        self.rays.append(rays.copy())
        return super().cast(rays)


def speed_rows(repeats=5):
    for title, (scanner, effects) in SETTINGS.items():
        made = survey(10.0 if scanner.beam_divergence == 0 else 5.0, scanner, effects)
        recorder = Recorder(made.scene.mesh)
        made.__dict__["surfaces"] = recorder  # the survey's cached property
        points = sum(len(block.cloud) for block in made.blocks())
        made.__dict__["surfaces"] = Surfaces(made.scene.mesh)
        rays = sum(map(len, recorder.rays))
        times = []
        for _ in range(repeats + 1):
            start = perf_counter()
            for block in recorder.rays:
                made.scene.mesh.caster.cast_rays(block)
            middle = perf_counter()
            for _ in made.blocks():
                pass
            times.append((middle - start, perf_counter() - middle))
        bare, whole = (median(column) for column in zip(*times[1:], strict=True))
        yield f"{title}: bare casting", f"{rays / bare / 1e6:.1f} M rays/s", ""
        yield (
            f"{title}: simulated ({points / whole / 1e6:.1f} M points/s) / bare",
            f"{bare / whole:.2f}",
            ">= 0.5",
        )


def memory_rows():
    peaks = []
    for points in (1_000, 10_000):
        with tempfile.TemporaryDirectory() as folder:
            command = [sys.executable, __file__, str(points), folder]
            answer = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        pulses, peak = map(int, answer.split())
        peaks.append(peak)
        yield f"peak memory over imports, {pulses / 1e6:.1f} M pulses written", f"{peak} MB", ""
    yield "ten times the pulses take", f"{peaks[1] - peaks[0]} MB more", "<= 50 MB"


def main():
    table = Table("measured in this run", "", "goal")
    for rows in (speed_rows(), memory_rows()):
        for row in rows:
            table.add_row(*row)
    Console().print(table)


if __name__ == "__main__":
    if len(sys.argv) == 3:  # the child whose memory is measured
        survey(5.0, LINE).write(Path(sys.argv[2]) / "first")  # all that is loaded when used
        before = peak_memory()
        line = LINE.model_copy(update={"points_per_line": int(sys.argv[1])})
        made = survey(10.0, line)
        made.write(Path(sys.argv[2]) / "survey")
        print(made.fired, peak_memory() - before)
    else:
        argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
        main()
