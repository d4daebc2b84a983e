"""A target that a search of the whole cloud finds is found near its surveyed point too."""

from dataclasses import replace

import numpy as np
import pytest

import mlscorr
from mlscorr.pipeline.finding import find_control
from tests.beds.shared import shared

EACH_TWICE = [(name, number) for name in ("T22", "T23", "T24") for number in (1, 2)]


@pytest.fixture(scope="module")
def survey():
    "Two passes by three targets, of which T23 hangs near a wall brighter than itself"
    return mlscorr.read_survey(shared("cases/missed_target"))


@pytest.mark.parametrize("radius", [2.0, 8.0, 15.0, 25.0])
def test_targets_do_not_depend_on_the_search_radius(survey, radius):
    "Both control points and the check point are seen in both passes, scored 0.99 and more"
    finding = find_control(replace(survey, search_radius=radius))
    control, check = finding.matches.by_role(survey)
    matched = finding.matches.matched
    numbers = matched.pass_number.tolist()
    assert sorted(zip(matched.name, numbers, strict=True)) == EACH_TWICE
    assert set(control.name) == {"T22", "T23"} and set(check.name) == {"T24"}
    assert min(target.score for target in finding.fitted.values()) > 0.99
    assert finding.matches.refusals == ()


def test_targets_near_control_are_those_of_the_whole_cloud(survey):
    "Extraction of the whole cloud lists the six that are found near control, at their places"
    rows = mlscorr.extract(survey).targets
    assert sorted((row["name"], row["pass"]) for row in rows) == EACH_TWICE
    assert min(row["score"] for row in rows) > 0.99
    near = find_control(survey).matches.matched
    place = {
        key: near.position[i] for i, key in enumerate(zip(near.name, near.pass_number, strict=True))
    }
    for row in rows:
        assert np.linalg.norm(place[row["name"], row["pass"]] - row["observed"]) < 0.001  # m
