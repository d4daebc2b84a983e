"""The example scripts run as they stand."""

import os
import subprocess
import sys
from pathlib import Path

EXAMPLES = Path(__file__).parents[1] / "examples"


def test_correct_a_survey_makes_its_picture(tmp_path):
    "The first example corrects a simulated survey, prints its RMSE and draws a picture"
    picture = tmp_path / "picture.png"
    script = [sys.executable, EXAMPLES / "correct_a_survey.py", "--picture", picture]
    printed = subprocess.check_output(script, text=True)
    assert "check: n = 8" in printed
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_pos_error_makes_its_picture(tmp_path):
    "The example on POS errors draws simulated ones where no real series is at hand"
    picture = tmp_path / "picture.png"
    script = [sys.executable, EXAMPLES / "pos_error.py", "--drives", "1", "--picture", picture]
    elsewhere = {**os.environ, "MLSCORR_SHARED": str(tmp_path)}
    subprocess.check_output(script, text=True, env=elsewhere)
    assert picture.read_bytes().startswith(b"\x89PNG")
