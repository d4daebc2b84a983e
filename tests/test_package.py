"""What ``import mlscorr`` offers: functions that are loaded when they are used."""

import ast
import inspect
import re
from pathlib import Path

import pytest

import mlscorr

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
