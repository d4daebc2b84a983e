"""Ties of a survey in files: what the command writes, and what it says of poor surveys."""

import csv
import json
import subprocess
from dataclasses import replace

import numpy as np
import pytest

import mlscorr
from mlscorr.pipeline.ties import TiedSurvey
from mlscorr.simulate import Scenario, simulate
from mlscorr.ties import search_ties
from tests.beds import tie_streets as street
from tests.beds.documents import undocumented
from tests.beds.places import MLSCORR


@pytest.fixture(scope="module")
def tied(tmp_path_factory):
    "The command on a street there and back: (process, output folder)"
    folder = tmp_path_factory.mktemp("ties")
    scenario = Scenario(
        drive={"duration": 4.0, "passes": [{}, {"direction": "back", "pause": 20.0}]},
        targets={"control": 2, "check": 1},
        scanner=[{"lines_per_second": 75, "points_per_line": 500}],
    )
    simulate(scenario, np.random.default_rng(2)).write(folder / "survey")
    command = [MLSCORR, "ties", folder / "survey", "-o", folder / "out", "--json"]
    return subprocess.run(map(str, command), capture_output=True, text=True), folder / "out"


def table(out):
    "Rows of ties.csv as dicts"
    return csv.DictReader((out / "ties.csv").read_text().splitlines())


def of_features(features):
    "A TiedSurvey of features without files"
    survey = street.survey(int(features.pass_number.max()))
    return TiedSurvey(survey, features, search_ties(survey, features))


def test_the_command_writes_a_row_for_each_tie(tied):
    "ties.csv has as many rows as ties.json counts, and --json prints the same document"
    process, out = tied
    assert process.returncode == 0, process.stderr
    content = json.loads((out / "ties.json").read_text())
    assert content == json.loads(process.stdout)
    assert content["schema"] == "mlscorr.ties/1"
    assert not undocumented(content)
    rows = list(table(out))
    assert len(rows) == content["ties"] > 50
    assert sum(pair["n"] for pair in content["pairs"]) == content["ties"]
    assert sum(stretch["n"] for stretch in content["stretches"]) == content["ties"]


def test_a_row_holds_its_own_misclosure(tied):
    "direction . (place 2 - place 1) is the misclosure of each row, to the rounding of the file"
    for row in table(tied[1]):
        first, second = (
            np.array([float(row[f"{axis}_{view}"]) for axis in ("easting", "northing", "height")])
            for view in (1, 2)
        )
        direction = np.array([float(row[f"direction_{axis}"]) for axis in "enh"])
        assert abs(direction @ (second - first) - float(row["misclosure"])) < 3e-4
        assert float(row["gps_time_1"]) < float(row["gps_time_2"])


def test_the_misfit_of_two_passes_is_split_by_direction():
    "A second pass 0.3 m too high and 0.2 m aside shows so, and nothing else"
    wrong, _ = street.misplaced(street.features(), (0.0, 0.2, 0.3))
    misfit = of_features(wrong).pairs[0]["misfit"]
    assert misfit["up"]["median"] == pytest.approx(0.3, abs=0.005)
    assert misfit["across"]["median"] == pytest.approx(0.2, abs=0.005)
    assert misfit["along"]["median"] < 0.005


def test_a_good_survey_has_nothing_to_warn_of():
    "Two passes along a street with walls on all sides: no sentence"
    assert of_features(street.features()).warnings == ()


def test_a_single_pass_says_why_it_has_no_ties():
    "One pass: the sentence counts what was seen and says what to drive"
    features = street.features(1, 1)
    (sentence,) = of_features(features).warnings
    assert sentence.startswith(f"No tie was found: none of {len(features)} planes, poles and")
    assert "Drive the road twice" in sentence


def test_a_tunnel_is_named_with_its_direction():
    "Without walls across, the direction that nobody holds is the way's"
    features = street.features()
    features = features[(np.abs(features.direction[:, 0]) < 0.1) & (features.kind == "plane")]
    exact = features.direction * np.array([0.0, 1.0, 1.0])
    exact /= np.linalg.norm(exact, axis=1, keepdims=True)
    (sentence,) = of_features(replace(features, direction=exact)).warnings
    assert "1.00, " in sentence.replace("-", "")
    assert "unconstrained" in sentence


def test_the_library_gives_what_the_command_gives(tmp_path):
    "find_ties on a survey that was read warns of a single pass, and writes empty tables"
    short = Scenario(
        drive={"duration": 3.0},
        targets={"control": 2, "check": 1},
        scanner=[{"lines_per_second": 50, "points_per_line": 300}],
    )
    simulate(short, np.random.default_rng(1)).write(tmp_path / "survey")
    with pytest.warns(UserWarning, match="No tie was found"):
        result = mlscorr.find_ties(mlscorr.read_survey(tmp_path / "survey"))
    content = result.write(tmp_path / "out")
    assert content["ties"] == 0
    assert content["pairs"] == content["stretches"] == []
