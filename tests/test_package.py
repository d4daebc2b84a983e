"""Contents of ``import mlscorr``: functions that are loaded when they are used."""

import ast
import inspect
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import mlscorr
from tests.beds.places import ROOT

LOADED = [name for name in mlscorr.__all__ if hasattr(mlscorr, name)]  # a test asks for all
VERBS = [
    name
    for name in mlscorr.__all__
    if inspect.isfunction(getattr(mlscorr, name))
    and next(iter(inspect.signature(getattr(mlscorr, name)).parameters), "") == "survey"
]


def typed_names():
    "Names that type checkers and editors see"
    tree = ast.parse(Path(mlscorr.__file__).read_text())
    (branch,) = (node for node in tree.body if isinstance(node, ast.If))
    return {alias.name for node in branch.body for alias in node.names}


def test_editors_see_what_is_offered():
    "The names of __all__ are those with types, and completion lists them"
    assert typed_names() == set(mlscorr.__all__)
    assert set(mlscorr.__all__) <= set(dir(mlscorr))
    assert len(dir(mlscorr)) == len(set(dir(mlscorr)))


@pytest.mark.parametrize("name", mlscorr.__all__)
def test_what_is_offered_can_be_loaded(name):
    "Every name is a function with a docstring, or the package of the simulator"
    assert callable(getattr(mlscorr, name)) or name == "simulate"
    assert getattr(mlscorr, name).__doc__


def test_a_name_that_is_none_is_an_attribute_error():
    "As of any module"
    with pytest.raises(AttributeError, match="no attribute 'corect'"):
        _ = mlscorr.corect


@pytest.mark.parametrize("name", VERBS)
@pytest.mark.parametrize("given", ["street/survey.toml", Path("street"), None], ids=repr)
def test_a_path_where_a_survey_belongs_is_told_how_to_read_it(name, given):
    "All that take a survey say what they were given, and which function gives one"
    others = {"apply": ([],), "render": ("out",), "estimate_pos_error": (None,)}.get(name, ())
    words = re.escape(repr(str(given)))
    with pytest.raises(TypeError, match=f"{words}.*{type(given).__name__}.*mlscorr.read_survey"):
        getattr(mlscorr, name)(given, *others)


@pytest.mark.parametrize("name", LOADED)
def test_what_is_offered_has_an_example(name):
    "In its docstring, or in that of one of its methods, where doctest runs it"
    value = getattr(mlscorr, name)
    texts = [value.__doc__]
    if inspect.isclass(value):
        texts += [inspect.getdoc(getattr(value, method)) or "" for method in vars(value)]
    assert any(">>> " in text for text in texts)


def test_what_is_offered_fits_a_screen():
    "Fewer than 50 names"
    assert len(dir(mlscorr)) < 50


SCRIPT = """
import mlscorr
from tests.beds.places import ROOT

survey = mlscorr.read_survey("survey.toml")
targets = mlscorr.find_targets(survey)
good = targets[targets.score > 0.8]
matches = mlscorr.match_targets(good, survey)
ties = mlscorr.find_ties(survey)
estimate = mlscorr.estimate_pos_error(survey, matches, ties)
for cloud in mlscorr.read_cloud(survey.clouds[0]):
    moved = estimate.correction.apply(cloud)
    reveal_type(cloud)
scores = mlscorr.score(estimate, matches)
result = mlscorr.correct(survey)
written = result.write("corrected")
reveal_type(survey)
reveal_type(good)
reveal_type(matches)
reveal_type(ties)
reveal_type(estimate)
reveal_type(scores)
reveal_type(result)
"""


@pytest.mark.long
def test_a_script_with_the_stages_has_types(tmp_path):
    "mypy --strict finds no fault in a user's script, and each value is of a class of mlscorr"
    command = [sys.executable, "-m", "mypy", "--strict", "--follow-imports=silent", "-c", SCRIPT]
    command += ["--config-file=", "--ignore-missing-imports", "--cache-dir", tmp_path]
    environment = {**os.environ, "MYPYPATH": str(ROOT)}
    done = subprocess.run(command, text=True, capture_output=True, cwd=tmp_path, env=environment)
    assert done.returncode == 0, done.stdout
    types = re.findall(r'Revealed type is "([\w.]+)"', done.stdout)
    assert [name.rsplit(".", 1)[1] for name in types] == [
        "PointCloud",
        "Survey",
        "FoundTargets",
        "MatchedTargets",
        "TiedSurvey",
        "PosErrorEstimate",
        "Scores",
        "CorrectedSurvey",
    ]
