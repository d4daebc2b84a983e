"""A simulated survey of two passes, its rows and their beams."""

import numpy as np
import pytest

from mlscorr.effects import make_effect
from mlscorr.gap.residuals import Rows
from mlscorr.io.surveys import read_survey
from mlscorr.simulate import Scenario, simulate
from tests.beds.gap_surveys import beams_of, read_once, rows_of, write_reference
from tests.gap.closures import Bed


@pytest.fixture(scope="session")
def case(tmp_path_factory):
    "Two passes of five seconds past six targets, with a reference: Survey, Read, Rows, Beams"
    scenario = Scenario(
        drive={
            "duration": 5.0,
            "speed": 5.0,
            "passes": [{}, {"direction": "back", "lateral": -3.0, "pause": 20.0}],
        },
        targets={"control": 4, "check": 1, "hidden": 0.2},
        scanner=[{"lines_per_second": 150, "points_per_line": 400}],
    )
    simulated = simulate(scenario, np.random.default_rng(4))
    folder = tmp_path_factory.mktemp("replay") / "survey"
    simulated.write(folder)
    write_reference(simulated, folder / "reference.obj")
    with (folder / "survey.toml").open("a") as file:
        file.write('\n[scene]\nreference = "reference.obj"\n')
    survey = read_survey(folder)
    read = read_once(survey)
    pairing = rows_of(survey, read, 120)
    rows = Rows.concatenate([pairing.rows, pairing.check])
    return survey, read, rows, beams_of(survey, rows, read)


@pytest.fixture(scope="session")
def late():
    "A clock that is 6 ms off"
    return Bed(make_effect("time_offset", magnitude=0.006))


@pytest.fixture(scope="session")
def shaky():
    "Positions with 8 cm of noise from fix to fix, of which nothing is stated"
    return Bed(make_effect("position_noise", magnitude=0.08))
