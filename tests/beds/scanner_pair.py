"""A street driven there and back with a left and a right scanner."""

import numpy as np

from mlscorr.simulate import Scenario, simulate


def simulated(duration, control, points):
    "SimulatedSurvey of two passes of some seconds, with control points and points on each line"
    line = {"lines_per_second": 50, "points_per_line": points}
    scenario = Scenario(
        drive={"duration": duration, "speed": 6.0, "passes": [{}, {"direction": "back"}]},
        targets={"control": control, "check": 1, "hidden": 0.0},
        scanner=[
            {"lever_arm": [-0.3, -0.6, 0.4], "boresight": [90.0, 0.0, 35.0], **line},
            {"lever_arm": [0.3, -0.6, 0.4], "boresight": [90.0, 0.0, -35.0], **line},
        ],
        pos={"grade": "tactical"},
    )
    return simulate(scenario, np.random.default_rng(3))


def write(survey, folder):
    "The folder of a SimulatedSurvey, with targets looked for near by, for speed"
    survey.write(folder)
    with (folder / "survey.toml").open("a") as described:
        described.write("[matching]\nsearch_radius = 1.5\n")  # m
    return folder
