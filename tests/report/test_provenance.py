"""Inputs and outputs of a correction."""

from dataclasses import replace

import numpy as np

from mlscorr.report import FileRow
from mlscorr.report.correction_page import coverage, files, systems
from mlscorr.survey import MountedScanner, Mounting, Scanner
from tests.beds.reports import START, drive, fabricate


def test_the_systems_and_beliefs_are_named():
    "Reference system, frames, times and the sigma that was taken"
    survey, _, _ = fabricate(drive())
    pairs = dict(systems(survey))
    assert pairs["Coordinate reference system"] == "EPSG:32650"
    assert pairs["Time of pass-1.laz"] == "GPS week seconds, as in the trajectory"
    assert pairs["Epochs of the trajectory"] == "3 000 at 50 Hz"
    assert "not stated" in dict(systems(replace(survey, crs=None)))["Coordinate reference system"]


def test_times_counted_over_the_end_of_the_week_are_named():
    "Of the trajectory, and of a cloud whose times start again: with the seconds that are added"
    trajectory = drive()
    trajectory = replace(trajectory, weeks=np.zeros(len(trajectory), int))
    survey, _, _ = fabricate(trajectory)
    late = replace(survey.clouds[0], time_system="week", new_week=100.0)
    pairs = dict(systems(replace(survey, clouds=(late,))))
    assert pairs["Time of the trajectory"].endswith("continued past the end of the GPS week")
    assert "continued where they restart (+604800 s)" in pairs["Time of pass-1.laz"]


def test_each_scanner_has_its_lever_arm():
    "A row for each of two scanners"
    survey, _, _ = fabricate(drive())
    arms = {"1": [-0.33, -0.58, 0.4], "2": [0.32, -0.6, 0.4]}  # m
    scanners = tuple(
        MountedScanner(name, Scanner(), Mounting(np.array(arm), np.eye(3)), survey.clouds)
        for name, arm in arms.items()
    )
    pairs = dict(systems(replace(survey, scanners=scanners)))
    assert pairs["Lever arm of scanner 1"] == "right, forward, up -0.33, -0.58, 0.4 m"
    assert pairs["Lever arm of scanner 2"] == "right, forward, up 0.32, -0.6, 0.4 m"


def test_the_coverage_is_told_in_seconds_and_points():
    "A gap of 11 s, and 40 000 of 1 234 567 points beyond control"
    _, correction, report = fabricate(drive(gap=(20.0, 31.0)))
    pairs = dict(coverage(correction, report))
    assert pairs["Trajectory"].startswith(f"{START:.3f} to ")
    for where in (
        "Points before the first or after the last control point",
        "Points with extrapolated correction (outside the control)",
    ):
        assert pairs[where] == "40 000 (3.24 %)"
    assert pairs["Points outside the trajectory (not corrected)"] == "0"
    assert pairs["Gaps of the trajectory (nothing is interpolated across them)"] == 1


def test_files_stand_with_size_and_hash():
    "Inputs come before outputs; clouds are in points, other files in bytes"
    report = replace(fabricate(drive())[2], inputs=(FileRow("a.csv", "cd", "control", bytes=4000),))
    rows = files(report)
    assert rows["Read"] == [("control", "a.csv", "4 000 bytes", "cd")]
    assert rows["Written"][0][:3] == ("corrected cloud", "pass-1.laz", "1 234 567 points")
