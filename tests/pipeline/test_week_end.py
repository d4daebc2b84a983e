"""A drive over the end of the GPS week: files in, the same correction out."""

import json
import warnings

import laspy
import numpy as np
import pytest

import mlscorr
from mlscorr.io.trajectories import write_trajectory_csv
from mlscorr.survey import Trajectory
from tests.beds.folders_of_others import bed, control_csv

pytestmark = pytest.mark.long

WEEK = 604_800.0  # s
TOML = """[cloud]
files = ["pass-*.las"]

[trajectory]
file = "trajectory.csv"

[control]
file = "control.csv"
"""


def write_folder(folder, period):
    "The small survey, whose first pass goes over the end of the week; its times start again or not"
    source = bed()
    (folder / "survey.toml").write_text(TOML)
    control_csv(folder, source)
    recorded = source.trajectory
    later = np.round(WEEK - recorded.gps_time[0] - 3.0)  # s, so that 3 s are of the old week
    pose = recorded.position, recorded.attitude, recorded.position_sigma, recorded.attitude_sigma
    counted = recorded.gps_time + later
    weeks = (counted >= period).astype(int)
    written = Trajectory(counted, *pose, weeks=weeks)
    write_trajectory_csv(folder / "trajectory.csv", written)
    for path in source.clouds:
        las = laspy.read(path)
        las.gps_time = (las.gps_time + later) % period
        las.write(folder / path.name)
    return folder


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    "Results of correct by whether times start again"
    out = {}
    for name, period in (("counted", 100 * WEEK), ("again", WEEK)):
        folder = write_folder(tmp_path_factory.mktemp(name), period)
        with warnings.catch_warnings(action="ignore"):  # so few points tell little
            corrected = mlscorr.correct(mlscorr.read_survey(folder))
            corrected.write(folder / "out", page=False)
        out[name] = folder
    return out


def test_the_correction_is_that_of_times_that_go_on(results):
    "Every corrected coordinate is that of the same drive with times beyond 604 800 s, to the bit"
    for name in ("pass-1.las", "pass-2.las"):
        again, counted = (laspy.read(results[k] / "out" / name) for k in ("again", "counted"))
        for axis in "XYZ":
            assert np.array_equal(again[axis], counted[axis])
        recorded = laspy.read(results["again"] / name)
        assert np.array_equal(again.gps_time, recorded.gps_time)
        assert not np.array_equal(again.X, recorded.X)
    assert np.ptp(laspy.read(results["again"] / "pass-1.las").gps_time) > WEEK - 20.0


def test_times_of_the_written_trajectory_are_as_they_came(results):
    "trajectory.csv starts again at 0 in the row in which the input does, and poses are the same"
    read = [
        np.loadtxt(results[k] / place / "trajectory.csv", delimiter=",", skiprows=1)
        for k, place in (("again", "."), ("again", "out"), ("counted", "out"))
    ]
    given, written, counted = read
    assert np.array_equal(written[:, 0], given[:, 0])
    assert (np.diff(written[:, 0]) < 0).sum() == 1
    assert np.array_equal(written[:, 1:], counted[:, 1:])


def test_it_is_said(results):
    "Check finds no fault, and the report names the epoch and what was added"
    checked = mlscorr.check(results["again"])
    assert checked.faults == ()
    assert any("The GPS week ends before epoch" in note for note in checked.notes)
    report = json.dumps(json.loads((results["again"] / "out" / "report.json").read_text()))
    assert "604800 s are added after the rollover" in report
