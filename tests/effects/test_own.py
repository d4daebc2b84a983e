"""Effects of one's own from a file."""

import json

import numpy as np
import pytest
from gap_training.features import geometry
from typer.testing import CliRunner

from mlscorr.cli import app
from mlscorr.effects import catalogue, effect_class, register_file
from mlscorr.gap.signatures import expected, signatures

CLASS = """
from dataclasses import dataclass
from typing import ClassVar
import numpy as np
from mlscorr.effects import Effect, quantity, register

@register
@dataclass(frozen=True)
class Own(Effect):
    name: ClassVar = "{name}"
    stage: ClassVar = "pos"
    title: ClassVar = "Own"
    meaning: ClassVar = "The height is off."
    sentence: ClassVar = "The height is off by {{size}}."
    remedy: ClassVar = "Mend it."
    magnitude: float = quantity("m", 1e6, "nothing is as far", typical=0.1, source="a test")

    def _error(self, value, reference, rng):
        return self.magnitude * {body}
"""


@pytest.fixture(autouse=True)
def forgotten(monkeypatch):
    "Remove the effects that a test registered, after it"
    monkeypatch.setattr(catalogue, "_registered", {})


def written(path, name, body):
    file = path / f"{name}.py"
    file.write_text(CLASS.format(name=name, body=body))
    return file


def test_a_file_registers_its_effects(tmp_path):
    "The class is known by its name from then on"
    (kind,) = register_file(written(tmp_path, "lift", "np.array([0, 0, 1])"))
    assert effect_class("lift") is kind


@pytest.mark.long
def test_simulate_and_plan_take_the_file_of_an_effect(tmp_path):
    "Recorded heights are 0.1 m off, the plan says what size shows; without the file all is unknown"
    file = written(tmp_path, "lift", "np.array([0, 0, 1])")
    scenario = tmp_path / "s.toml"
    out = tmp_path
    short = (
        "[drive]\nduration = 6.0\n[targets]\ncontrol = 4\ncheck = 1\n"
        "[[scanner]]\nlines_per_second = 40\npoints_per_line = 200\n"
    )
    scenario.write_text(short + '[[effects]]\nname = "lift"\nmagnitude = 0.1\n')
    command = ["simulate", str(scenario), "-o", str(out / "survey")]
    unknown = CliRunner().invoke(app, command)
    assert unknown.exit_code == 2 and "--effects FILE" in unknown.output
    made = CliRunner().invoke(app, [*command, "--effects", str(file)])
    assert made.exit_code == 0, made.output
    recorded = np.loadtxt(out / "survey" / "trajectory.csv", delimiter=",", skiprows=1)[:, 3]
    scenario.write_text(short)
    CliRunner().invoke(app, ["simulate", str(scenario), "-o", str(out / "clean")])
    clean = np.loadtxt(out / "clean" / "trajectory.csv", delimiter=",", skiprows=1)[:, 3]
    np.testing.assert_allclose(recorded - clean, 0.1, atol=2e-5)
    plan = ["plan", str(out / "survey"), "--effects", str(file), "-o", str(out / "plan")]
    assert CliRunner().invoke(app, plan).exit_code == 0
    (size,) = json.loads((out / "plan" / "plan.json").read_text())["detectable"]["lift"]
    assert 0.0 < size["detectable"] < 1.0


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("x = (", "line 1"),
        ("1 / 0", "ZeroDivisionError: division by zero"),
        ("x = 1", "registers no effect"),
        ("raise SystemExit(0)", "SystemExit: 0"),
        (CLASS.format(name="a+b", body="0.0"), r"'a\+b' can't be the name of an effect"),
        (CLASS.format(name="none", body="0.0"), "not none, noise or unknown"),
    ],
)
def test_a_file_that_cannot_be_used_is_refused(tmp_path, text, said):
    "With the line or the error that it raises, and no traceback"
    file = tmp_path / "bad.py"
    file.write_text(text)
    with pytest.raises(ValueError, match=said):
        register_file(file)


def test_a_file_that_is_not_there_is_named(tmp_path):
    "The path stands in the sentence"
    with pytest.raises(FileNotFoundError, match=r"none\.py does not exist"):
        register_file(tmp_path / "none.py")


def test_a_file_may_postpone_its_annotations(tmp_path):
    "Dataclasses look for the module of a ClassVar that is written as a string"
    file = written(tmp_path, "late", "np.array([0, 0, 1])")
    file.write_text("from __future__ import annotations\n" + file.read_text())
    (kind,) = register_file(file)
    assert [*kind.quantities()] == ["magnitude"]


def test_a_simulator_whose_effect_moves_everything_is_refused(tmp_path):
    "By 10 km up, whatever eastings, northings and walls don't see of it"
    (kind,) = register_file(written(tmp_path, "everything", "np.array([0.0, 0.0, 1e5])"))
    g = geometry(3, targets=6, patches=60)
    with pytest.raises(ValueError, match=r"everything of 0\.1 moves points by 1e\+04 m"):
        expected(g.rows, g.survey, [kind(0.1)])
    (why,) = signatures(g.rows, g.survey, [kind])[1].values()
    assert why.key == "not usable" and "Check its unit" in why.values["why"]


@pytest.mark.parametrize(
    ("name", "body", "said"),
    [
        ("everything", "np.array([0.0, 0.0, 1e5])", "Check its unit"),
        ("nan", "np.array([0.0, 0.0, np.nan])", "not a number"),
        ("raises", "value.speed", "AttributeError"),
        ("leaves", "exit(0)", "SystemExit"),
    ],
)
def test_an_effect_that_cannot_be_applied_is_left_out(tmp_path, name, body, said):
    "It changes everything, into no numbers, or raises: the reason is said"
    file = written(tmp_path, name, body)
    kinds = register_file(file)
    g = geometry(3, targets=6, patches=10)
    with np.errstate(invalid="ignore"):
        signs, left_out = signatures(g.rows, g.survey, kinds)
    assert signs == ()
    assert left_out[name].key == "not usable" and said in left_out[name].values["why"]


def test_an_effect_that_changes_nothing_is_left_out(tmp_path):
    "No row of a survey depends on it"
    kinds = register_file(written(tmp_path, "nothing", "np.zeros(3)"))
    g = geometry(3, targets=6, patches=10)
    signs, left_out = signatures(g.rows, g.survey, kinds)
    assert signs == () and left_out["nothing"].key == "no row"
