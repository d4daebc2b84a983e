"""Origin of beams without a given mounting, from the cloud alone."""

import re
import shutil
import warnings
from dataclasses import replace

import numpy as np
import pytest

import mlscorr
from mlscorr.io.clouds import read_chunks
from mlscorr.pipeline.beams import beam_origin, with_beam_origin
from mlscorr.simulate import Scenario, simulate
from mlscorr.survey import PointCloud

ARM = [0.3, -0.9, 0.5]  # m: right, forward, up


def made(folder, scanner, **scenario):
    "The survey of a short simulated drive with a scanner at ARM"
    given = Scenario(drive={"duration": 8.0}, scanner=[{"lever_arm": ARM, **scanner}], **scenario)
    simulate(given, np.random.default_rng(4)).write(folder)
    return mlscorr.read_survey(folder)


def without_mounting(folder, target):
    "A copy of a survey folder whose survey.toml gives no mounting"
    shutil.copytree(folder, target)
    text = (target / "survey.toml").read_text()
    text = re.sub(r"\[mounting\]\n(\w+ = .*\n)+", "", text)
    assert "lever_arm" not in text
    (target / "survey.toml").write_text(text)
    return mlscorr.read_survey(target)


@pytest.fixture(scope="module")
def plates(tmp_path_factory):
    "A canyon of houses with plates that stand free: (folder, survey)"
    folder = tmp_path_factory.mktemp("plates") / "survey"
    scanner = {"lines_per_second": 100, "points_per_line": 700}
    targets = {"control": 4, "check": 2, "kinds": ["square"], "supports": ["post"], "hidden": 0.0}
    scene = {"house_height": [12.0, 20.0], "gaps": 0.1}
    return folder, made(folder, scanner, targets=targets, scene=scene)


def test_a_line_scanner_shows_its_lever_arm(plates):
    "To 5 mm, from the middle of the cloud"
    bare = replace(plates[1], mounting=None)
    found = with_beam_origin(bare, bare.clouds[0]).beam_origin
    assert found == pytest.approx(ARM, abs=0.005)  # m


def test_a_given_mounting_stays(plates):
    "Nothing is read then"
    assert with_beam_origin(plates[1], plates[1].clouds[0]) is plates[1]


@pytest.mark.long
def test_free_plates_are_found_alike_without_a_mounting(plates, tmp_path):
    "Beams past a plate show its edges from where they come: every target to 2 mm as with it"
    bare = without_mounting(plates[0], tmp_path / "bare")
    seen = []
    for survey in (plates[1], bare):
        with warnings.catch_warnings(record=True, action="always") as caught:
            rows = mlscorr.correct(survey, ties="off").targets
        assert not any("the scanner position" in str(warning.message) for warning in caught)
        seen.append({row.name: row.observed for row in rows if row.before is not None})
    assert len(seen[0]) == 6
    assert seen[1].keys() == seen[0].keys()
    for name, place in seen[0].items():
        assert seen[1][name] == pytest.approx(place, abs=0.002)  # m


@pytest.mark.long
def test_several_beams_at_once_show_no_origin(tmp_path):
    "Rings of a spinning scanner lie in no plane: None, and it is said where it matters"
    rings = {"kind": "spinning", "rings": [-8.0, 0.0, 8.0], "lines_per_second": 15}
    survey = made(tmp_path / "survey", rings, targets={"control": 4, "check": 1})
    chunks = list(read_chunks(survey.clouds[0]))
    assert beam_origin(PointCloud.concatenate(chunks), survey.trajectory) is None
    bare = without_mounting(tmp_path / "survey", tmp_path / "bare")
    with warnings.catch_warnings(record=True, action="always") as caught:
        result = mlscorr.correct(bare)
    sentence = "the beams of pass-1.laz do not show the scanner position"
    assert any(sentence in str(warning.message) for warning in caught)
    assert any(sentence in text for text in result.warnings)
