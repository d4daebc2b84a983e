"""Effect after effect into the simulator, until nothing is left."""

import json
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from mlscorr.cli import app
from mlscorr.io.surveys import read_survey
from mlscorr.pipeline import diagnose
from mlscorr.pipeline.diagnosis import DiagnosedRounds
from mlscorr.simulate import read_simulator
from tests.beds import diagnosed_street
from tests.beds.documents import undocumented
from tests.beds.made_once import copied_once

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def survey(tmp_path_factory):
    "A survey whose scanner clock is 20 ms off"
    return copied_once(tmp_path_factory, "late", diagnosed_street.write_late)


def test_one_command_finds_the_cause_and_then_none(survey, tmp_path):
    "Two rounds: the clock, then nothing; the simulator has 20 ms to 1 ms, the table both"
    out = tmp_path / "out"
    command = ["diagnose", str(survey), "-o", str(out), "--until-none", "--costs", "careful"]
    done = CliRunner().invoke(app, command)
    assert done.exit_code == 0, done.output
    told = json.loads((out / "gap.json").read_text())
    assert not undocumented(told)
    assert told["costs"]["false_alarm"] == 10.0
    rounds = told["ablation"]["rounds"]
    assert [each["label"] for each in rounds] == ["time_offset", "none"]
    assert rounds[0]["after"] < 0.1 * rounds[0]["before"]
    assert told["ablation"]["alone"][0]["effect"] == "time_offset"
    assert "nothing more was found" in told["ablation"]["ended"]
    assert "Scanner clock offset alone" in done.output and "round 2: Nothing" in done.output
    page = " ".join((out / "gap.html").read_text().split())
    assert "1. Scanner clock offset" in page and "2. Nothing" in page
    assert rounds[0]["parameters"][0]["estimate"] == pytest.approx(0.02, abs=1e-3)
    (effect,) = read_simulator(out / "simulator.toml").effects
    assert effect.magnitude == pytest.approx(0.02, abs=1e-3)


def test_what_has_no_bound_is_null(survey, tmp_path):
    "A parameter without a detectable size, as the time of a jump: the document has None, and JSON"
    first = diagnose(read_survey(survey))
    inference = first.inference
    size = replace(inference.cause.parameters[0], detectable=np.nan)
    cause = replace(inference.cause, parameters=(size,))
    inference = replace(inference, causes=(cause, *inference.causes[1:]))
    rounds = DiagnosedRounds((replace(first, inference=inference),), ())
    told = rounds.write(tmp_path / "out")
    assert told["ablation"]["rounds"][0]["parameters"][0]["detectable"] is None


def test_what_no_simulator_can_take_is_told_and_the_results_are_written(survey, tmp_path):
    "A clock 500 s off, beyond its limit: simulator.toml as it was, why, and no second round"
    first = diagnose(read_survey(survey))
    (sign, _), *_ = first.inference.cause.parts
    cause = replace(first.inference.cause, parts=((sign, np.array([500.0])),))
    inference = replace(first.inference, causes=(cause, *first.inference.causes[1:]))
    beyond = replace(first, inference=inference)
    told = beyond.write(tmp_path / "out")
    assert beyond.improved is first.simulator
    assert read_simulator(tmp_path / "out" / "simulator.toml").effects == ()
    assert "time_offset of 500 s exceeds" in told["advice"][-1]
    assert not any("It contains the cause" in sentence for sentence in told["advice"])


def test_what_no_known_effect_explains_closes_nothing(survey):
    "The gap that the nearest effect leaves is that of no round: it was not put in"
    first = diagnose(read_survey(survey))
    inference = first.inference
    closure = first.closure
    cause = replace(inference.cause, effect="unknown", parameters=())
    verdict = replace(inference.verdict, label="unknown", hint="height error")
    inference = replace(inference, verdict=verdict, causes=(cause,))
    unknown = replace(first, inference=inference)
    known, found = DiagnosedRounds((first, unknown), ()).document["ablation"]["rounds"]
    assert (known["after"], known["shrink"]) == (closure.after, closure.shrink)
    assert found["before"] == closure.before
    assert found["after"] is found["shrink"] is None
    assert known["windows"] == [] and "target" not in known


def test_another_simulator_cannot_run_here(survey, tmp_path):
    "Rounds with clouds of one's own simulator are refused: it would have to run"
    command = ["diagnose", str(survey), "--until-none", "--simulated", str(survey)]
    done = CliRunner().invoke(app, [*command, "-o", str(tmp_path / "out")])
    assert done.exit_code == 2
    assert "give one of them" in " ".join(done.output.split())
