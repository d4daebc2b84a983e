"""Names of errors of meters and degrees, compared with those of centimeters.

python benchmarks/large_errors.py [--seeds 3] [--errors position_step lever_arm ...]

A street is driven there and back, 40 s each way, and simulated with one large error, with its
surfaces as a reference and without. Patches are then compared with wrong surfaces. For each: the
label by diagnose, its probability, and its sizes.
"""

import argparse
import tempfile
import warnings
from pathlib import Path

import numpy as np

import mlscorr
from mlscorr.simulate import Scenario, simulate

ERRORS = {
    "position_step": {"magnitude": (1.2, -1.6, 0.0), "time": 15.0},  # m, s
    "position_step up": {"magnitude": (0.0, 0.5, 2.0), "time": 15.0},
    "position_bump": {"magnitude": (3.0, 0.0, 0.0), "time": 15.0, "width": 5.0},
    "lever_arm": {"magnitude": (0.8, 0.5, 0.0)},
    "time_offset": {"magnitude": 0.1},  # s: 0.8 m of the way
    "vertical_datum": {"magnitude": 1.0},
    "boresight": {"magnitude": (0.6, 0.0, 1.0)},  # deg
    "nothing": None,
}


def survey_with(folder, error, seed, reference):
    """Folder of a simulated survey with one error, or none."""
    if ERRORS[error] is None:
        effects = []
    else:
        effects = [{"name": error.split()[0], **ERRORS[error]}]
    scenario = Scenario(
        scene={"reference": reference},
        drive={"duration": 40.0, "passes": [{}, {"direction": "back"}]},
        targets={"control": 12, "check": 4},
        scanner=[{"lines_per_second": 75, "points_per_line": 400}],
        effects=effects,
    )
    simulate(scenario, np.random.default_rng(seed)).write(folder)
    return mlscorr.read_survey(folder)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--errors", nargs="*", default=list(ERRORS), choices=list(ERRORS))
    arguments = parser.parse_args()
    right = total = 0
    for error in arguments.errors:
        for seed in range(1, arguments.seeds + 1):
            for reference in (True, False):
                with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    survey = survey_with(Path(folder) / "survey", error, seed, reference)
                    answer = mlscorr.diagnose(survey).document["verdict"]
                name = "none" if error == "nothing" else error.split()[0]
                right = right + (answer["label"] == name)
                total = total + 1
                where = "with reference" if reference else "without"
                print(f"{error:18s}{seed:3d} {where:15s}{answer['sentence']}", flush=True)
    print(f"{right} of {total} named")


if __name__ == "__main__":
    main()
