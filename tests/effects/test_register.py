"""A user's own effect: one class, known to simulator, diagnosis and report."""

import re
from dataclasses import replace
from html import unescape

import numpy as np
import pytest

import mlscorr
from mlscorr.effects import (
    EFFECTS,
    catalogue,
    effect_streams,
    in_order,
    known_effects,
    make_effect,
    register,
)
from mlscorr.gap.plan import planned_rows
from mlscorr.gap.signatures import signatures
from mlscorr.report.gap import diagnosis_page, plan_page
from mlscorr.simulate import Scenario, beliefs_of, read_simulator, simulate, write_simulator
from tests.beds.documents import undocumented
from tests.beds.gap_documents import gap_document, parameter
from tests.beds.own_effects import Rattle, Squat


@pytest.fixture(autouse=True)
def own_effects(monkeypatch):
    "The two are known during a test, and nobody knows them after it"
    monkeypatch.setattr(catalogue, "_registered", {})
    register(Rattle)
    register(Squat)


def drive(effects=()):
    "A simulated drive of 12 s with a stop, on which the speed is not the same all along"
    scenario = Scenario(
        drive={"duration": 12.0, "stops": [(6.0, 1.0)]},
        targets={"control": 6, "check": 1},
        scanner=[{"lines_per_second": 60.0, "points_per_line": 400}],
        effects=effects,
    )
    return simulate(scenario, np.random.default_rng(3))


def words(page):
    "The text of a page"
    return " ".join(unescape(re.sub(r"<[^>]*>", " ", page.html())).split())


def test_the_simulator_applies_it():
    "5 mm at 1 m/s lift the recorded heights by that times the speed squared, and nothing else"
    clean = drive()
    lifted = drive([{"name": "squat", "magnitude": 0.005}])
    speed = np.gradient(clean.trajectory.position, clean.trajectory.gps_time, axis=0)
    up = 0.005 * (speed**2).sum(axis=1)
    shift = lifted.trajectory.position - clean.trajectory.position
    assert np.ptp(up) > 0.1  # m
    assert shift[:, 2] == pytest.approx(up, abs=1e-9)
    assert (shift[:, :2] == 0).all()


@pytest.mark.long
def test_the_diagnosis_differentiates_it(tmp_path):
    "Its signature on a survey's planned rows is its own effect by its own size, to 1 %"
    drive().write(tmp_path / "survey")
    survey = mlscorr.read_survey(tmp_path / "survey")
    rows = planned_rows(survey)
    (sign,), left_out = signatures(rows, survey, (Squat,))
    assert not left_out and sign.parameters == ("magnitude",)
    trajectory = survey.trajectory
    velocity = np.gradient(trajectory.position, trajectory.gps_time, axis=0)
    square = np.interp(rows.gps_time, trajectory.gps_time, (velocity**2).sum(axis=1))
    up = (rows.direction[:, 2] != 0) & ~rows.two_times
    expected = square[up] * rows.direction[up, 2]
    assert sign.jacobian[up, 0] == pytest.approx(expected, abs=0.02 * square.max())

    document = mlscorr.plan(survey).document
    assert not undocumented(document)
    assert {"squat", "time_offset"} <= set(document["detectable"])
    assert document["detectable"]["squat"][0]["typical"] == 1e-4
    assert "Squatting vehicle" in words(plan_page(document, "street"))


@pytest.mark.long
def test_the_report_words_it():
    "A verdict has its sentence with size and side, its title and its meaning"
    document = gap_document()
    cause = document["causes"][0]
    cause |= {"effect": "squat", "parameters": [parameter("magnitude", "m", -0.005, 0.0004, 0.001)]}
    document["verdict"] |= {"label": "squat", "set": ["squat"]}
    text = words(diagnosis_page(document, "street"))
    assert "At 1 m/s the body of the vehicle is 5.0 mm ± 0.4 mm too low." in text
    assert "One error Squatting vehicle" in text
    assert "Squatting vehicle The body of the vehicle rises when it is fast." in text


def test_it_acts_after_the_others_of_its_stage_and_is_written_and_read(tmp_path):
    "simulator.toml keeps it, in the order in which it acts"
    squat = make_effect("squat", magnitude=1e-3)
    arm = make_effect("lever_arm", magnitude=[0, 0, 0.1])
    drift = make_effect("heading_drift", magnitude=0.1)
    effects = in_order([squat, arm, drift])
    assert effects == (drift, squat, arm)
    drive().write(tmp_path / "survey")
    simulator = beliefs_of(mlscorr.read_survey(tmp_path / "survey"))
    write_simulator(replace(simulator, effects=effects), tmp_path / "simulator.toml")
    assert read_simulator(tmp_path / "simulator.toml").effects == effects


def test_streams_of_the_library_stay_what_they_are(monkeypatch):
    "A registered random effect has a stream of its own and leaves every other, and the next, alone"
    rng = np.random.default_rng(5)
    other = np.random.default_rng(5)
    streams = effect_streams(rng)
    monkeypatch.setattr(catalogue, "_registered", {})
    without = effect_streams(other)
    assert set(streams) - set(without) == {"rattle", "squat"}
    for name, stream in without.items():
        assert streams[name].random() == stream.random(), name
    assert streams["rattle"].random() != streams["squat"].random()
    assert rng.spawn(1)[0].random() == other.spawn(1)[0].random()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"title": "", "remedy": ""}, r"^Squat does not define title, remedy; see Effect\.$"),
        ({"name": "boresight"}, "boresight is a built-in effect of mlscorr"),
        ({"stage": "clocks"}, "'clocks' is an unknown stage; known are beam, clock"),
        ({"parts": ("up", "down")}, "squat has 2 parts and sides for 1"),
        ({"sides": ()}, "Squat does not define sides"),
        ({"sides": ("high",)}, "squat has 1 parts and sides for 1"),
        (
            {"sentence": "It is {size} too {sides}."},
            "squat may contain size, where, side.* not sides",
        ),
        ({"quantities": classmethod(lambda cls: {})}, "squat has no magnitude with unit, typical"),
    ],
)
def test_what_does_not_say_all_of_itself_is_refused(changes, message):
    "Words, stage, size, source and names of the parts are asked for in a sentence"
    with pytest.raises(ValueError, match=message):
        register(type("Squat", (Squat,), changes))
    assert known_effects() == (*EFFECTS, Rattle, Squat)
