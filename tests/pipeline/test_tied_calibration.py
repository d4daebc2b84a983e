"""A mounting by what opposite passes both saw: files in, calibration out."""

import json
import subprocess

import numpy as np
import pytest

import mlscorr
from mlscorr.simulate import Scenario, simulate
from tests.beds.documents import undocumented
from tests.beds.places import MLSCORR

pytestmark = pytest.mark.long

LACKS = [0.03, -0.02, 0.0]  # m, of the recorded lever arm


def site(folder, boresight, control, back=True):
    "A street driven there and back with a boresight that lacks degrees: what it lacks (6,), m, rad"
    scenario = Scenario(
        drive={"duration": 14.0, "speed": 5.0, "passes": [{}, {"direction": "back"}][: 1 + back]},
        targets={"control": max(control, 1), "check": 1, "hidden": 0.0},
        scanner=[{"boresight": [90.0, 0.0, 35.0], "lines_per_second": 50, "points_per_line": 300}],
        pos={"grade": "tactical"},
        effects=[
            {"name": "boresight", "magnitude": boresight},
            {"name": "lever_arm", "magnitude": LACKS},
        ],
    )
    simulated = simulate(scenario, np.random.default_rng(3))
    simulated.write(folder)
    if control == 0:
        described = (folder / "survey.toml").read_text()
        part = described[described.index("[control]") :].split("\n\n")[0]
        (folder / "survey.toml").write_text(described.replace(part, ""))
    true = simulated.true_mountings[0]
    recorded = simulated.mounting
    turn = (true.boresight * recorded.boresight.inv()).as_rotvec()
    return np.append(true.lever_arm - recorded.lever_arm, turn)


@pytest.fixture(scope="module")
def commanded(tmp_path_factory):
    "The command on a site of half a degree with 3 control points: what it lacks, its document"
    folder = tmp_path_factory.mktemp("half")
    lacks = site(folder / "survey", [0.3, -0.3, 0.4], 3)
    options = "--json", "--with-drift"
    command = [MLSCORR, "calibrate", folder / "survey", "-o", folder / "out", *options]
    process = subprocess.run(map(str, command), capture_output=True, text=True)
    assert process.returncode == 0, process.stderr
    assert "tie features between passes were used" in process.stderr
    return lacks, json.loads((folder / "out" / "calibration.json").read_text())


@pytest.fixture(scope="module")
def uncontrolled(tmp_path_factory):
    "A site without control whose boresight lacks 2 to 3 degrees: what it lacks, CalibratedSurvey"
    folder = tmp_path_factory.mktemp("degrees")
    lacks = site(folder, [2.0, -2.5, 3.0], 0)
    with pytest.warns(UserWarning):
        return lacks, mlscorr.calibrate(mlscorr.read_survey(folder))


def test_planes_sharpen_what_few_targets_tell(commanded):
    "3 control points and planes: boresight to 0.03 deg, lever arm across to 2 cm, and 3 sigma"
    lacks, content = commanded
    assert not undocumented(content)
    lever, boresight = (content["lsc"][part] for part in ("lever_arm", "boresight"))
    error = np.degrees(lacks[3:]) - boresight["correction"]
    assert np.abs(error[:2]).max() < 0.03  # deg
    assert (np.abs(error) < 3 * np.array(boresight["sigma"])).all()
    assert np.abs(lacks[:2] - lever["correction"][:2]).max() < 0.02  # m


def test_the_document_has_the_misfit_of_each_two_passes(commanded):
    "Planes of both passes lie centimetres apart as recorded, and millimetres without the drift too"
    ties = commanded[1]["ties"]
    assert ties["used"] > 0.9 * ties["n"] > 50
    (pair,) = ties["pairs"]
    assert pair["passes"] == [1, 2]
    assert pair["before"]["median"] > 0.02  # m
    assert pair["after"]["median"] < 0.5 * pair["before"]["median"]
    (drifted,) = commanded[1]["with_drift"]["ties"]["pairs"]
    assert drifted["after"]["median"] < 0.004  # m


def test_degrees_of_boresight_are_found_without_any_control(uncontrolled):
    "A boresight off by 3 deg, planes off by half a metre: right and forward to 0.05 deg"
    lacks, result = uncontrolled
    error = result.calibration.lsc.correction - lacks
    sigma = result.calibration.lsc.sigma
    assert np.degrees(np.abs(error[3:5])).max() < 0.05
    assert np.abs(error[:2]).max() < 0.03  # m
    known = result.calibration.determined
    assert (np.abs(error) < 3 * sigma)[known].all()
    content = result.report(with_drift=True)
    assert content["ties"]["before"]["median"] > 0.1  # m
    assert content["ties"]["after"]["median"] < 0.01  # m
    assert content["with_drift"]["ties"]["after"]["median"] < 0.005  # m


def test_what_ties_alone_cannot_tell_is_named(uncontrolled):
    "Passes that agree say nothing of heights: lever arm up is not determined, in a sentence"
    _, result = uncontrolled
    assert not result.calibration.determined[2]
    assert result.calibration.determined[[0, 1, 3, 4]].all()
    sentences = result.calibration.warnings
    assert any("No control point was used" in sentence for sentence in sentences)
    assert any("does not determine lever arm up" in sentence for sentence in sentences)
    assert result.to_frame()["determined"].tolist() == result.calibration.determined.tolist()
    assert "not determined by this geometry" in result._repr_html_()


def test_one_pass_without_control_says_what_is_missing(tmp_path):
    "Nothing was seen twice and nothing surveyed: the error counts both and says what to drive"
    site(tmp_path, [0.3, 0.0, 0.0], 0, back=False)
    with pytest.raises(ValueError, match=r"0 control points were found .* in both directions"):
        mlscorr.calibrate(mlscorr.read_survey(tmp_path))
