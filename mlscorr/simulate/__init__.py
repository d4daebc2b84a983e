"""Simulated surveys: a street, a drive, scanners, a POS, and their errors.

>>> import numpy as np
>>> from mlscorr.simulate import Scenario, simulate
>>> short = Scenario(drive={"duration": 8.0}, targets={"control": 4, "check": 1})
>>> len(simulate(short, np.random.default_rng(1)).targets)
5
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(
    __name__,
    submod_attrs={
        "_mechanisms": [
            "Described",
            "DisplacedSurvey",
            "Mechanism",
            "RecordedPoints",
            "described",
            "load_mechanisms",
            "mechanisms",
            "training_mechanisms",
        ],
        "_random_survey": ["random_scenario", "random_survey"],
        "scenario": ["DEMO", "Scenario", "SceneScenario", "read_scenario", "scenario_files"],
        "settings": ["SETTINGS"],
        "simulator_file": ["Simulator", "beliefs_of", "read_simulator", "write_simulator"],
        "survey": ["SimulatedSurvey", "simulate"],
    },
)
