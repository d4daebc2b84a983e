"""Folders as others have them: a survey.toml that runs, or the sentence on what to add.

``make folders`` takes all of them through check and correct too.
"""

import pytest

from tests.beds.folders_of_others import FOLDERS, bed, check_verdicts, started

BY_NAME = {case.name: case for case in FOLDERS}
CORRECTED = ("each point surveyed twice", "LAS beside LAZ")


@pytest.fixture(scope="module", autouse=True)
def survey():
    "Simulated once, before the first folder"
    return bed()


@pytest.mark.long
@pytest.mark.parametrize("case", FOLDERS, ids=BY_NAME)
def test_a_folder_gives_a_survey_or_the_sentence_on_what_to_add(case, tmp_path):
    "By init alone, or with what its sentence asks for"
    assert started(case, tmp_path / "survey").exists()


@pytest.mark.parametrize("name", CORRECTED)
def test_what_a_check_passes_of_a_folder_is_corrected(name, tmp_path):
    "Some of them go through check and correct: passed by both, or refused by both in one sentence"
    case = BY_NAME[name]
    check_verdicts(case, started(case, tmp_path / "survey"), tmp_path / "out")
