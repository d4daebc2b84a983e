"""A street of half a minute with targets enough for a diagnosis."""

import numpy as np

from mlscorr.simulate import Scenario, simulate


def write(folder, *effects):
    "Write the survey with effects (dicts), without its truth"
    scenario = Scenario(
        drive={"duration": 30.0},
        targets={"control": 12, "check": 3},
        scanner=[{"lines_per_second": 75, "points_per_line": 400}],
        effects=effects,
    )
    simulate(scenario, np.random.default_rng(3)).write(folder)
    for truth in ("truth.json", "truth.npz"):
        (folder / truth).unlink()


def write_late(folder):
    "Write the survey whose scanner clock is 20 ms off"
    write(folder, {"name": "time_offset", "magnitude": 0.02})
