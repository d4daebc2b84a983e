"""The example scripts run as they stand."""

import json
import os
import runpy
import subprocess
import sys

import pytest

from tests.beds.joint_scores import records
from tests.beds.places import BENCHMARKS, EXAMPLES, ROOT


@pytest.mark.long
def test_correct_a_survey_makes_its_picture(street, tmp_path):
    "The first example corrects a survey that it is given, prints its RMSE and draws a picture"
    picture = tmp_path / "picture.png"
    script = [sys.executable, EXAMPLES / "correct_a_survey.py", street, "--picture", picture]
    printed = subprocess.check_output(script, text=True)
    assert "control: n = 4" in printed and "check: n = 1" in printed
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.long
def test_pos_error_makes_its_picture(tmp_path):
    "The example on POS errors draws simulated ones where no real series is at hand"
    picture = tmp_path / "picture.png"
    script = [sys.executable, EXAMPLES / "pos_error.py", "--drives", "1", "--picture", picture]
    elsewhere = {**os.environ, "MLSCORR_SHARED": str(tmp_path)}
    subprocess.check_output(script, text=True, env=elsewhere)
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.long
def test_decision_costs_makes_its_picture(tmp_path):
    "Of records that are there no world is made anew: a picture, and a line each operating point"
    for world in range(2):
        part = [
            json.dumps(vars(r) | {"joint": vars(r.joint), "world": 1000 + world})
            for r in records(240, seed=world)
        ]
        (tmp_path / f"{1000 + world}.json").write_text(f"[{','.join(part)}]")
    picture = tmp_path / "picture.png"
    script = [sys.executable, BENCHMARKS / "decision_costs.py", "--records", tmp_path]
    command = [*script, "--worlds", "2", "--picture", picture]
    printed = subprocess.check_output(command, text=True)
    assert [line.split(":")[0] for line in printed.splitlines()] == [
        "sensitive",
        "default",
        "careful",
    ]
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("name", sorted(path.stem for path in EXAMPLES.glob("*.py")))
def test_an_example_says_what_it_takes_before_it_works(name, tmp_path):
    "From any folder, within the time of its imports; nothing is drawn meanwhile"
    script = [sys.executable, EXAMPLES / f"{name}.py", "--help"]
    printed = subprocess.check_output(script, text=True, cwd=tmp_path, timeout=60)
    assert "--picture" in printed
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", sorted(path.stem for path in EXAMPLES.glob("*.py")))
def test_an_example_without_its_input_ends_in_a_sentence(name, tmp_path):
    "It names the file; a word that an example has no use for is refused as well"
    script = [sys.executable, EXAMPLES / f"{name}.py", tmp_path / "none"]
    done = subprocess.run(script, text=True, capture_output=True, cwd=tmp_path, check=False)
    assert done.returncode and str(tmp_path / "none") in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("name", sorted(path.stem for path in EXAMPLES.glob("*.py")))
def test_an_example_draws_outside_the_manual(name):
    "Without --picture it draws into build/examples, so that no picture of the manual changes"
    script = runpy.run_path(str(EXAMPLES / f"{name}.py"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", [f"{name}.py"])
        given = script["parse"]()
    assert given.picture.parent == ROOT / "build" / "examples"


SCRIPTS = sorted(p.stem for p in BENCHMARKS.glob("*.py") if "__main__" in p.read_text())


@pytest.mark.long
@pytest.mark.parametrize("name", SCRIPTS)
def test_a_benchmark_says_what_it_takes_before_it_works(name, tmp_path):
    "Within the time of its imports; nothing is measured meanwhile"
    script = [sys.executable, BENCHMARKS / f"{name}.py", "--help"]
    printed = subprocess.check_output(script, text=True, cwd=tmp_path, timeout=60)
    assert "usage:" in printed
