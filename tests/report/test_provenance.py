"""What a correction was made of."""

from dataclasses import replace

from mlscorr.report import FileRow
from mlscorr.report._provenance import coverage, files, systems
from tests.beds.reports import START, drive, fabricate


def test_the_systems_and_beliefs_are_named():
    "Reference system, frames, times and the sigma that was taken"
    survey, _, _ = fabricate(drive())
    pairs = dict(systems(survey))
    assert pairs["Coordinate reference system"] == "EPSG:32650"
    assert pairs["Time of pass-1.laz"] == "GPS week seconds, as the trajectory's"
    assert pairs["Epochs of the trajectory"] == "3 000 at 50 Hz"
    assert "not stated" in dict(systems(replace(survey, crs=None)))["Coordinate reference system"]


def test_the_coverage_is_told_in_seconds_and_points():
    "A gap of 11 s, and 40 000 of 1 234 567 points beyond control"
    _, correction, report = fabricate(drive(gap=(20.0, 31.0)))
    pairs = dict(coverage(correction, report))
    assert pairs["Trajectory"].startswith(f"{START:.3f} to ")
    for where in (
        "Points before the first or past the last control point",
        "Points whose correction is extrapolated: no control point holds them",
    ):
        assert pairs[where] == "40 000 (3.24 %)"
    assert pairs["Points outside the trajectory (left as they were)"] == "0"
    assert pairs["Gaps of the trajectory (nothing is interpolated across them)"] == 1


def test_files_stand_with_size_and_hash():
    "What was read before what was written; clouds in points, others in bytes"
    report = replace(fabricate(drive())[2], inputs=(FileRow("a.csv", "cd", "control", bytes=4000),))
    rows = files(report)
    assert rows["Read"] == [("control", "a.csv", "4 000 bytes", "cd")]
    assert rows["Written"][0][:3] == ("corrected cloud", "pass-1.laz", "1 234 567 points")
