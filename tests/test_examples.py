"""The example scripts run as they stand."""

import os
import subprocess
import sys

from tests.beds.places import EXAMPLES


def test_correct_a_survey_makes_its_picture(street, tmp_path):
    "The first example corrects a survey that it is given, prints its RMSE and draws a picture"
    picture = tmp_path / "picture.png"
    script = [sys.executable, EXAMPLES / "correct_a_survey.py", street, "--picture", picture]
    printed = subprocess.check_output(script, text=True)
    assert "control: n = 4" in printed and "check: n = 1" in printed
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_pos_error_makes_its_picture(tmp_path):
    "The example on POS errors draws simulated ones where no real series is at hand"
    picture = tmp_path / "picture.png"
    script = [sys.executable, EXAMPLES / "pos_error.py", "--drives", "1", "--picture", picture]
    elsewhere = {**os.environ, "MLSCORR_SHARED": str(tmp_path)}
    subprocess.check_output(script, text=True, env=elsewhere)
    assert picture.read_bytes().startswith(b"\x89PNG")
