"""A simulated survey of two passes, and what is compared of it."""

import numpy as np
import pytest

from mlscorr.gap.residuals import build_rows, find_patches
from mlscorr.io.surveys import read_survey
from mlscorr.pipeline import find_targets, match_targets
from mlscorr.simulate import Scenario, simulate
from tests.beds.gap_surveys import write_reference


@pytest.fixture(scope="session")
def simulated():
    "Two passes of eight seconds, there and back, with what a POS errs by in a street"
    scenario = Scenario(
        drive={
            "duration": 8.0,
            "speed": 6.0,
            "passes": [{}, {"direction": "back", "lateral": -3.0, "pause": 20.0}],
        },
        targets={"control": 4, "check": 2, "hidden": 0.0},
        scanner=[{"lines_per_second": 75, "points_per_line": 400}],
        pos={"outages": [[2.0, 5.0]], "processing": "filtered"},
    )
    return simulate(scenario, np.random.default_rng(3))


@pytest.fixture(scope="session")
def survey(simulated, tmp_path_factory):
    folder = tmp_path_factory.mktemp("gap") / "survey"
    simulated.write(folder)
    write_reference(simulated, folder / "reference.obj", lost=0.25)
    with (folder / "survey.toml").open("a") as file:
        file.write('\n[scene]\nreference = "reference.obj"\n')
    return read_survey(folder)


@pytest.fixture(scope="session")
def targets(survey):
    found = match_targets(find_targets(survey), survey)
    matches = found.matches
    candidates = found.candidates
    return matches.matched, candidates


@pytest.fixture(scope="session")
def patches(survey):
    return find_patches(survey)


@pytest.fixture(scope="session")
def pairing(survey, targets, patches):
    return build_rows(survey, *targets, patches)
