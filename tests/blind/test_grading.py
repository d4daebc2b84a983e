"""What grades the diagnosis is opened by nothing that sets it."""

import ast

import pytest

from mlscorr.blind.grading import grading_mechanisms
from mlscorr.simulate.mechanisms import mechanisms, training_mechanisms
from tests.beds.places import ROOT

SETTERS = sorted(
    path
    for folder in ("benchmarks", "mlscorr/gap", "mlscorr/effects", "tests/beds", "tests/gap")
    for path in (ROOT / folder).rglob("*.py")
)


def test_no_pair_of_direction_and_covariate_is_in_both_halves():
    "The halves share no error in one direction by one thing, and are all that there is"
    halves = training_mechanisms(), grading_mechanisms()
    training, grading = ({(each.direction, each.covariate) for each in half} for half in halves)
    assert not training & grading
    assert set(halves[0]) | set(halves[1]) == set(mechanisms())
    assert min(map(len, halves)) > 500


@pytest.mark.parametrize("path", SETTERS, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_study_opens_the_grading_half(path):
    "Neither a benchmark nor the gap imports the blind check's mechanisms or asks for the half"
    for node in ast.walk(ast.parse(path.read_text())):
        names = [alias.name for alias in getattr(node, "names", ()) if hasattr(alias, "name")]
        names += [getattr(node, key, None) for key in ("module", "attr", "id")]
        words = {str(name) for name in names if name is not None}
        assert not any("grading" in word or "is_for_training" in word for word in words), words
        assert "mlscorr.blind.grading" not in words
        assert "mechanisms" not in words or "simulate" not in str(getattr(node, "module", ""))
