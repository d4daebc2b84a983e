"""A survey: what it says of itself from its parts."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from mlscorr.survey import CloudFile, MountedScanner, Scanner, Survey
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
    assert SURVEY.assumed_mounting is MOUNTING
    assumed = replace(SURVEY, mounting=None).assumed_mounting
    assert not assumed.lever_arm.any()  # m
    assert assumed.boresight.magnitude() == 0.0  # rad


def with_scanners():
    "The street with a left scanner that wrote the second file, and a right one without a mounting"
    arm = replace(MOUNTING, lever_arm=np.ones(3))
    left = MountedScanner("left", Scanner(range_noise=0.02), arm, CLOUDS[1:])
    right = MountedScanner("right", Scanner(), None, CLOUDS[:1])
    return replace(SURVEY, mounting=None, scanners=(left, right))


def test_a_file_is_seen_by_the_scanner_that_wrote_it():
    "Mounting, beliefs and files are those of its scanner; the same survey where there is one"
    survey = with_scanners()
    left = survey.scanners[0]
    assert survey.of(CLOUDS[1]).mounting is left.mounting
    assert survey.of(CLOUDS[1]).scanner is left.scanner
    assert survey.of(CLOUDS[0]).clouds == CLOUDS[:1]
    assert survey.of(CLOUDS[0]).mounting is None
    assert list(survey.by_scanner) == ["left", "right"]
    assert SURVEY.of(CLOUDS[0]) is SURVEY.by_scanner[""] is SURVEY


def test_rows_are_parted_by_scanner():
    "Of three rows the first file's is the right scanner's, those of the second the left one's"
    survey = with_scanners()
    assert survey.scanner_numbers.tolist() == [1, 0]
    scanner = survey.scanner_numbers[[0, 1, 1]]
    (_, left), (_, right) = survey.rows_by_scanner(scanner)
    assert left.tolist() == [False, True, True]
    assert right.tolist() == [True, False, False]
    ((survey, rows),) = SURVEY.rows_by_scanner(scanner)
    assert survey is SURVEY and len(scanner[rows]) == 3


def test_other_mountings_are_those_of_the_scanners_in_their_order():
    "One survey keeps its one, two scanners get one each; all else stays"
    survey = with_scanners()
    arms = [replace(MOUNTING, lever_arm=np.full(3, i)) for i in (2.0, 3.0)]
    changed = survey.with_mountings(arms)
    assert changed.mountings == tuple(arms) and changed.scanners[0].clouds == CLOUDS[1:]
    assert survey.mountings[1] is None
    assert SURVEY.mountings == (MOUNTING,)
    assert SURVEY.with_mountings(arms[:1]).mounting is arms[0]
