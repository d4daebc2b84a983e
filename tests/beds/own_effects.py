"""Effects that a user may have written, one systematic and one random."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from mlscorr.effects import Effect, quantity


@dataclass(frozen=True)
class Squat(Effect):
    "The body rises with the square of the speed: recorded = true + magnitude v^2"

    name: ClassVar = "squat"
    stage: ClassVar = "pos"
    title: ClassVar = "Squatting vehicle"
    meaning: ClassVar = "The body of the vehicle rises when it is fast."
    sentence: ClassVar = "At 1 m/s the body of the vehicle is {size} too {side}."
    remedy: ClassVar = "Drive at one speed."
    sides: ClassVar = ("high", "low")
    magnitude: float = quantity(
        "m per (m/s)^2", 0.01, "no car flies", typical=1e-4, source="estimate: 1 cm at 10 m/s"
    )

    def _error(self, value, reference, rng):
        velocity = np.gradient(value.position, value.gps_time, axis=0)
        return self.magnitude * (velocity**2).sum(axis=1)[:, None] * [0.0, 0.0, 1.0]


@dataclass(frozen=True)
class Rattle(Effect):
    "Ranges that scatter: recorded = true + magnitude n"

    name: ClassVar = "rattle"
    stage: ClassVar = "range"
    random: ClassVar = True
    title: ClassVar = "Rattling scanner"
    meaning: ClassVar = "The scanner is loose."
    sentence: ClassVar = "The scanner rattles by {size}."
    remedy: ClassVar = "Tighten its screws."
    magnitude: float = quantity("m", 0.1, "it would fall off", typical=0.01, source="estimate")

    def _error(self, value, reference, rng):
        return self.magnitude * rng.standard_normal(len(value))
