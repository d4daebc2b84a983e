"""Fog about the targets that a filter flagged: results are those of the cloud without it."""

import json
import re
import shutil
import subprocess
import sys

import laspy
import numpy as np
import pytest

import mlscorr
from mlscorr.io.surveys import read_project, stated_project
from mlscorr.pipeline.project import Options, correct_project
from tests.beds import project_street
from tests.beds.noise import EACH, add_noise

MLSCORR = [sys.executable, "-m", "mlscorr"]
CAPTURED = {"capture_output": True, "text": True, "check": False}
TARGETS = 5  # of the street
FLAGGED = TARGETS * EACH


@pytest.fixture(scope="module")
def foggy(street, tmp_path_factory):
    "The street with 800 flagged bright points about each target: (folder, which points they are)"
    folder = shutil.copytree(street, tmp_path_factory.mktemp("foggy") / "survey")
    return folder, add_noise(folder)


def test_flagged_points_change_nothing_that_is_estimated(foggy, street, tmp_path):
    "Targets and the correction are those without the noise, to 1e-9 m; it is moved and counted"
    folder, is_noise = foggy
    command = [*MLSCORR, "correct", folder, "-o", tmp_path / "foggy", "--no-report"]
    result = subprocess.run(command, **CAPTURED)
    assert result.returncode == 0, result.stderr
    clear = mlscorr.correct(mlscorr.read_survey(street))
    clear.write(tmp_path / "clear", page=False)
    reports = [
        json.loads((tmp_path / name / "report.json").read_text()) for name in ("foggy", "clear")
    ]
    places = [[target["before"] for target in report["targets"]] for report in reports]
    assert len(places[0]) == len(places[1]) >= TARGETS
    assert np.allclose(*places, rtol=0, atol=1e-9)
    assert reports[0]["coverage"]["points_noise"] == FLAGGED
    assert reports[1]["coverage"]["points_noise"] == 0
    points = len(is_noise)
    assert f"{FLAGGED} of {points} points read are flagged as noise" in result.stderr

    before = laspy.read(folder / "pass-1.laz")
    after = laspy.read(tmp_path / "foggy/pass-1.laz")
    without = laspy.read(tmp_path / "clear" / "pass-1.laz")
    assert np.array_equal(after.points.array[~is_noise], without.points.array)
    for name in before.point_format.dimension_names:
        if name not in "XYZ":
            assert np.array_equal(before[name], after[name]), name
    moved = after.xyz - before.xyz
    near = np.interp(before.gps_time[is_noise], before.gps_time[~is_noise], moved[~is_noise][:, 0])
    assert np.abs(moved[is_noise][:, 0] - near).max() < 0.002  # m, two steps of the file


def test_the_same_points_without_flags_spoil_the_result(foggy, street, tmp_path):
    "Unless noise counts, targets are lost or shifted: with noise_classes = [] class 7 is measured"
    folder = shutil.copytree(foggy[0], tmp_path / "survey")
    clear = mlscorr.correct(mlscorr.read_survey(street))
    toml = folder / "survey.toml"
    toml.write_text(toml.read_text().replace("[cloud]\n", "[cloud]\nnoise_classes = []\n"))
    survey = mlscorr.read_survey(folder)
    assert survey.clouds[0].noise_classes == ()
    try:
        control = mlscorr.correct(survey).control
    except ValueError:
        return  # no target is left
    is_lost = control["n"] < clear.control["n"]
    assert is_lost or control["after"]["rmse_3d"] > 2 * clear.control["after"]["rmse_3d"]


def test_a_check_counts_flagged_points(foggy):
    "check names what is flagged among the points that it reads, and finds no fault"
    checked = mlscorr.check(foggy[0])
    assert not checked.faults
    (note,) = [note for note in checked.notes if "flagged as noise" in note]
    flagged, points = map(int, re.match(r"(\d+) of (\d+) points read", note).groups())
    assert 0 < flagged <= 2 * FLAGGED
    assert flagged < points


@pytest.mark.parametrize(
    "command",
    [
        "extract",
        "ties",
        pytest.param("calibrate", marks=pytest.mark.long),
        pytest.param("compare", marks=pytest.mark.long),
    ],
)
def test_each_command_counts_flagged_points_and_measures_none(command, foggy, street, tmp_path):
    "The screen has their number, and the result's numbers are those of the cloud without them"
    folder, is_noise = foggy
    results = [
        subprocess.run([*MLSCORR, command, path, "-o", tmp_path / name, "--json"], **CAPTURED)
        for name, path in (("foggy", folder), ("clear", street))
    ]
    sentence = f"{FLAGGED} of {len(is_noise)} points read are flagged as noise"
    assert sentence in results[0].stderr
    assert "flagged as noise" not in results[1].stderr
    documents = [numbers(result.stdout) for result in results]
    assert documents[0] == documents[1]


def numbers(text):
    "A document without what differs between clouds of other bytes, and runs of other seconds"
    document = json.loads(text)
    for key in ("clouds", "inputs", "files"):
        document.pop(key, None)
    for method in document.get("methods", ()):
        del method["seconds"]
    return document


@pytest.mark.long
def test_drives_of_a_project_measure_no_flagged_points(tmp_path):
    "project.json counts the noise of all drives; project.toml has the classes of its own files"
    project = project_street.write_project(tmp_path, duration=6.0)
    project.write_text(project.read_text() + "\n[cloud]\nnoise_classes = [7, 18, 64]\n")
    drives = {drive.name: drive.settings.cloud for drive in stated_project(project).drives}
    assert drives["second"].noise_classes == [7, 18, 64]
    assert drives["first"].noise_classes == [7, 18]
    for tile in (tmp_path / "first").glob("*.laz"):
        flag(tile, 64)
    for tile in (tmp_path / "second").glob("*.laz"):
        flag(tile, 64)
    result = correct_project(read_project(project), tmp_path / "out", Options(page=False))
    counts = {name: own["coverage"]["points_noise"] for name, own in result.reports.items()}
    assert counts == {"first": 0, "second": 500}
    (noise,) = [row for row in result.document["statements"] if row["what"] == "Noise"]
    assert noise["sentence"].startswith("500 of ")


def flag(path, number):
    "Give the first 500 points of a cloud a class"
    las = laspy.read(path)
    las.classification[:500] = number
    las.write(path)
