"""Nothing that sets the diagnosis opens the data that grade it."""

import ast
import re

import pytest

from mlscorr.blind._grading import grading_mechanisms
from mlscorr.simulate import mechanisms, training_mechanisms
from tests.beds.places import ROOT

FOLDERS = (
    "benchmarks",
    "mlscorr/gap",
    "mlscorr/effects",
    "tests/beds",
    "tests/gap",
    "tests/gap_training",
)
SETTERS = sorted(
    path
    for folder in FOLDERS
    for path in (ROOT / folder).rglob("*.py")
    if path.name != "grade_decision.py"  # which grades and sets nothing
)

PATHS = re.compile(  # the blind check, whose cases take that half; the module of the whole grammar
    r"mlscorr\.(pipeline\.)?blind\b|grading|outside_mechanisms|\._?mechanisms(\.mechanisms)?$"
)
MARKS = re.compile("grading|outside_mechanisms|is_for_training")


def test_no_pair_of_direction_and_covariate_is_in_both_halves():
    "The halves share no error in one direction by one thing, and are all that there is"
    halves = training_mechanisms(), grading_mechanisms()
    training, grading = ({(each.direction, each.covariate) for each in half} for half in halves)
    assert not training & grading
    assert set(halves[0]) | set(halves[1]) == set(mechanisms())
    assert min(map(len, halves)) > 500


def opened(text):
    "By what a Python text could reach the half that grades"
    paths = []
    names = []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            paths += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            paths += [f"{node.module}.{alias.name}" for alias in node.names]
        elif isinstance(node, ast.Attribute):
            names.append(node.attr)
        elif isinstance(node, ast.Name):
            names.append(node.id)
        elif isinstance(node, ast.Constant) and re.fullmatch(r"[\w.]+", str(node.value)):
            paths.append(str(node.value))
            names.append(str(node.value))
    return {path for path in paths if PATHS.search(path)} | set(filter(MARKS.search, names))


def test_no_study_opens_the_grading_half():
    "Neither a benchmark nor the gap imports the blind check, whose cases take that half, or asks"
    offenders = [
        f"{path.relative_to(ROOT)}: {name}"
        for path in SETTERS
        for name in sorted(opened(path.read_text()))
    ]
    assert not offenders, "\n".join(offenders)


@pytest.mark.parametrize(
    "text",
    [
        "from mlscorr.blind._grading import grading_mechanisms",
        "from mlscorr.blind.cases import outside_mechanisms",
        "from mlscorr.blind import cases",
        "from mlscorr import blind",
        "import mlscorr.blind.cases as cases",
        "from mlscorr.pipeline.blind import make_cases",
        "from mlscorr.simulate._mechanisms import mechanisms",
        "from mlscorr.simulate import mechanisms as every",
        "import mlscorr.simulate._mechanisms as all_of_them",
        "half = [each for each in known if not each.is_for_training]",
        "half = getattr(each, 'is_for_training')",
        "importlib.import_module('mlscorr.blind._grading')",
    ],
)
def test_every_way_to_the_grading_half_is_seen(text):
    "By its own name, through cases of the blind check, by the whole grammar, or by a text"
    assert opened(text)


def test_the_training_half_is_open_to_all():
    "Training mechanisms may be imported by name, and texts may mention a command"
    assert not opened("from mlscorr.simulate import training_mechanisms, described")
    assert not opened("'as `mlscorr blind score` has written'")
