"""The examples of the manual run as they stand, and say no more than a reader can take in."""

import ast
import os
import shutil
import subprocess
import sys

import numpy as np
import pytest

import mlscorr
from tests.beds.made_once import made_once
from tests.beds.places import EXAMPLES, ROOT

NAMES = sorted(path.stem for path in EXAMPLES.glob("[0-9]*.py"))
FAST = ("11_own_effect",)  # under 3 s on two cores: nothing is measured in a cloud
LINES = 40  # of code: a screen
PUBLIC = {"mlscorr", "mlscorr.effects", "mlscorr.simulate", "small_surveys"}
LIBRARIES = {"numpy", "matplotlib.pyplot", "laspy", "open3d"}


@pytest.fixture(scope="module")
def copied(tmp_path_factory):
    "The examples in a folder of their own, so that their surveys are simulated by this code"
    return made_once(tmp_path_factory, "examples", lambda to: shutil.copytree(EXAMPLES, to))


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[] if n in FAST else pytest.mark.long) for n in NAMES]
)
def test_an_example_runs_and_draws(name, copied, tmp_path):
    "Into the folder that it is given, with a picture at its top"
    env = {**os.environ, "MPLBACKEND": "agg", "PYTHONPATH": str(ROOT)}
    command = [sys.executable, copied / f"{name}.py", tmp_path / "out"]
    done = subprocess.run(command, text=True, capture_output=True, cwd=tmp_path, env=env)
    assert done.returncode == 0, done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    (picture,) = (tmp_path / "out").glob("*.png")
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("name", NAMES)
def test_an_example_is_short_and_says_what_it_shows(name):
    "At most 40 lines of code below a heading and some sentences, in cells"
    text = (EXAMPLES / f"{name}.py").read_text()
    docstring = ast.parse(text).body[0]
    title, line, empty, *sentences = ast.get_docstring(ast.parse(text)).splitlines()
    assert line == "=" * len(title) and not empty and sentences
    below = text.splitlines()[docstring.end_lineno :]
    code = [one for one in below if one.strip() and not one.startswith("#")]
    assert len(code) <= LINES
    assert "# %%" in below


@pytest.mark.parametrize("name", NAMES)
def test_an_example_imports_public_names_only(name):
    "mlscorr, its simulator and effects, the libraries of users, and Python's own"
    for node in ast.walk(ast.parse((EXAMPLES / f"{name}.py").read_text())):
        if isinstance(node, ast.Import):
            modules = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            modules = [node.module]
        else:
            continue
        for module in modules:
            is_of_python = module.split(".")[0] in sys.stdlib_module_names
            assert module in PUBLIC | LIBRARIES or is_of_python, module


def test_stages_by_hand_are_correct(street):
    "Points that the stages move lie where correct puts them, to 0.1 mm"
    survey = mlscorr.read_survey(street)
    targets = mlscorr.find_targets(survey, with_ties=True)
    matches = mlscorr.match_targets(targets, survey)
    estimate = mlscorr.estimate_pos_error(survey, matches, targets.features)
    scores = mlscorr.score(estimate, matches)

    result = mlscorr.correct(survey)
    for cloud in mlscorr.read_cloud(survey.clouds[0]):
        moved = estimate.correction.apply(cloud)
        expected = result.estimate.correction.apply(cloud)
        assert np.abs(moved.xyz - expected.xyz).max() < 1e-4  # m
        assert np.abs(moved.xyz - cloud.xyz).max() > 1e-3  # m: they do move
    after = result.check["after"]["rmse"]
    np.testing.assert_allclose(scores.check.after.rmse[:3], after, atol=1e-4)
