"""Add an effect of your own
=========================

One class says how an effect changes a survey. This vehicle rises with the square of its speed.
"""

from dataclasses import dataclass

import matplotlib.pyplot as plt
import numpy as np
from small_surveys import output_folder

from mlscorr.effects import Effect, quantity, register
from mlscorr.simulate import Scenario, simulate


@dataclass(frozen=True)
class Squat(Effect):
    name, stage, sides = "squat", "pos", ("high", "low")
    title, remedy = "Squatting vehicle", "Drive at one speed."
    meaning = "The body of the vehicle rises when it is fast."
    sentence = "At 1 m/s the body of the vehicle is {size} too {side}."
    magnitude: float = quantity("m per (m/s)^2", 0.01, "no car flies", typical=1e-4, source="guess")

    def _error(self, value, reference, rng):
        velocity = np.gradient(value.position, value.gps_time, axis=0)
        return self.magnitude * (velocity**2).sum(axis=1)[:, None] * [0.0, 0.0, 1.0]


# %%
# The same drive, with a stop, is simulated with the effect and without it.
register(Squat)
drive = {"duration": 40.0, "stops": [[15.0, 5.0]]}
squatting = Scenario(drive=drive, effects=[{"name": "squat", "magnitude": 5e-4}])
one, other = (simulate(s, np.random.default_rng(1)) for s in (squatting, Scenario(drive=drive)))
height = one.trajectory.position[:, 2] - other.trajectory.position[:, 2]
figure, panel = plt.subplots(figsize=(8, 3), layout="constrained")
panel.plot(one.trajectory.gps_time - one.trajectory.gps_time[0], 100 * height)
panel.set(xlabel="Time (s)", ylabel="Added height (cm)")
figure.savefig(output_folder() / "squat.png")
