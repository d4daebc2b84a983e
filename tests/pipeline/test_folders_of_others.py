"""Folders as others have them: a survey.toml that runs, or the sentence on what to add.

``make folders`` takes all of them through check and correct too.
"""

import pytest

from tests.beds.folders_of_others import FOLDERS, bed, check_result, started

CORRECTED = ("POF and POQ of RIEGL", "two runs, two trajectories", "uppercase endings")


@pytest.fixture(scope="module", autouse=True)
def survey():
    "Simulated once, before the first folder"
    return bed()


@pytest.mark.long
@pytest.mark.parametrize("case", FOLDERS, ids=[case.name for case in FOLDERS])
def test_a_folder_gives_a_survey_or_the_sentence_on_what_to_add(case, tmp_path):
    "By init alone, or with what its sentence asks for; three of them are corrected too"
    path = started(case, tmp_path / "survey")
    if case.name in CORRECTED:
        check_result(case, path, tmp_path / "out")
