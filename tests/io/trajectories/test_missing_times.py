"""Points whose gps_time is 0 or -1 in real files: said to be what they are, and nothing else."""

import warnings

import laspy
import numpy as np
import pytest

import mlscorr
from mlscorr.correction import Correction
from mlscorr.frames import attitude_from_angles
from mlscorr.io.clouds import read_intervals
from mlscorr.survey import CloudFile, Trajectory
from tests.beds.copies import write_corrected
from tests.beds.missing_times import CORNER, POINTS, START, write_survey


@pytest.mark.parametrize("value", [-1.0, 0.0])
def test_a_check_names_points_without_a_time(value, tmp_path):
    "check says how many have which value, and nothing of another time system or a short trajectory"
    write_survey(tmp_path, value)
    checked = mlscorr.check(tmp_path)
    told = [text for text in checked.warnings if "time" in text or "trajectory" in text]
    assert len(told) == 1
    assert f"points sampled from pass.las have gps_time {value:g}," in told[0]
    assert any("GPS seconds of week, as in the trajectory" in note for note in checked.notes)


def test_a_ply_with_placeholders_keeps_its_time_system(tmp_path):
    "A PLY in seconds of week with a few times of -1 is read as seconds of week"
    write_survey(tmp_path, -1.0, "pass.ply")
    with pytest.warns(UserWarning, match=r"points sampled from pass\.ply have gps_time -1"):
        survey = mlscorr.read_survey(tmp_path)
    assert survey.clouds[0].time_constant == 0.0
    assert survey.clouds[0].time_system == "week"


def test_a_correction_counts_points_without_a_time(tmp_path):
    "All 20 points with -1 are counted, and stay; all others are moved"
    times = write_survey(tmp_path, -1.0)
    epochs = START + np.arange(0.0, 20.0, 0.1)
    level = attitude_from_angles(np.zeros(len(epochs)), 0.0, 0.0)
    way = np.array(CORNER) + np.outer(epochs - START, [1.0, 0.0, 0.0])
    shift = [0.2, -0.1, 0.05]  # m
    correction = Correction(Trajectory(epochs, way, level), Trajectory(epochs, way + shift, level))
    file = CloudFile(tmp_path / "pass.las", POINTS, 0.0, "week")
    with pytest.warns(UserWarning, match="20 of 2000 points of .* have a gps_time of -1 s"):
        assert write_corrected(file, tmp_path / "out.las", correction) == 20
    moved = laspy.read(tmp_path / "out.las").xyz - laspy.read(file.path).xyz
    assert np.abs(moved[times == -1.0]).max() == 0.0
    assert np.abs(moved[times != -1.0] - shift).max() < 0.0011  # m, a step of the file


def test_windows_pass_over_points_without_a_time(tmp_path):
    "Points about a time are found by bisection although some have -1 between them"
    write_survey(tmp_path, -1.0, step=97)
    file = CloudFile(tmp_path / "pass.las", POINTS, 0.0, "week")
    span = START + np.array([[10.0, 11.0]])
    with warnings.catch_warnings(action="error"):
        chunks = list(read_intervals(file, span, limit=500))
    times = np.concatenate([chunk.gps_time for chunk in chunks])
    inside = (times >= span[0, 0]) & (times <= span[0, 1])
    assert inside.sum() >= 100
