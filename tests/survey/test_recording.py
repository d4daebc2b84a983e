"""A survey: what it says of itself from its parts."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from mlscorr.survey import CloudFile, Survey
from tests.beds.drives import MOUNTING, drive
from tests.survey.test_targets import surveyed

CLOUDS = tuple(CloudFile(Path(f"{i}.laz"), 100 * i, 0.0, "week") for i in (1, 2))
SURVEY = Survey(
    "street", Path("survey.toml"), None, CLOUDS, drive(), MOUNTING, surveyed("T1"), surveyed("C1")
)


def test_control_stands_before_check():
    "All surveyed points are the control points and then the check points"
    assert SURVEY.surveyed.name == ("T1", "C1")


def test_points_of_all_files_are_counted():
    "Two files of 100 and 200 points have 300"
    assert SURVEY.points == 300


def test_without_a_mounting_the_scanner_stands_at_the_pos():
    "The lever arm of an unknown mounting is zero"
    assert np.array_equal(SURVEY.lever_arm, MOUNTING.lever_arm)
    assert not replace(SURVEY, mounting=None).lever_arm.any()  # m
