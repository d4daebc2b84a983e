"""The pictures of README.md and docs, the scripts that draw them, and the one that compares."""

import importlib.util
import json
import os
import runpy
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

from tests.beds.joint_scores import records
from tests.beds.places import BENCHMARKS, ROOT

PICTURES = BENCHMARKS / "pictures"
DRAWING = sorted(path.stem for path in PICTURES.glob("*.py"))
SCRIPTS = sorted(p.stem for p in BENCHMARKS.glob("*.py") if "__main__" in p.read_text())

spec = importlib.util.spec_from_file_location("assets", ROOT / "benchmarks" / "assets.py")
assets = importlib.util.module_from_spec(spec)
spec.loader.exec_module(assets)


def test_every_picture_has_a_script_that_draws_it():
    "None is left of an example that went"
    assert {path.stem for path in assets.ASSETS.glob("*.png")} == set(assets.SCRIPTS)
    assert all((ROOT / script).exists() for script, _ in assets.SCRIPTS.values())


def test_a_moved_curve_is_a_change_and_a_shade_is_none(tmp_path):
    "A line of 2 % of the pixels that moves, against a difference of 10 of 255 everywhere"
    grey = np.full((100, 100, 3), 200, np.uint8)
    moved = grey.copy()
    moved[40:42] = 0
    for name, pixels in (("old", grey), ("shade", grey - 10), ("curve", moved), ("cut", grey[:9])):
        Image.fromarray(pixels).save(tmp_path / f"{name}.png")
    share = {
        name: assets.share_changed(tmp_path / "old.png", tmp_path / f"{name}.png")
        for name in ("shade", "curve", "cut")
    }
    assert share["shade"] == 0.0
    assert share["curve"] > assets.SHARE
    assert share["cut"] == 1.0


def test_the_drawing_of_the_rooms_has_every_room(tmp_path):
    "Each room of the plan once, and only imports from a floor to a lower one"
    rooms = runpy.run_path(str(PICTURES / "rooms.py"))
    rooms["draw"](tmp_path / "rooms.svg")
    text = (tmp_path / "rooms.svg").read_text()
    plan = rooms["floors"]()
    names = [room for floor in plan for room in floor]
    assert all(text.count(f">{room}<") == 1 for room in names)
    height = {room: number for number, floor in enumerate(plan) for room in floor}
    lines = list(rooms["imports"](names))
    assert len(lines) >= len(names) - 2
    assert all(height[room] > height[other] for room, other in lines)


@pytest.mark.long
def test_correct_a_survey_makes_its_picture(street, tmp_path):
    "The picture of the README shows a survey that the script is given, and it prints its RMSE"
    picture = tmp_path / "picture.png"
    script = [sys.executable, PICTURES / "correct_a_survey.py", street, "--picture", picture]
    printed = subprocess.check_output(script, text=True)
    assert "control: n = 4" in printed and "check: n = 1" in printed
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.long
def test_pos_error_makes_its_picture(tmp_path):
    "POS errors are drawn of simulated units where no real series is at hand"
    picture = tmp_path / "picture.png"
    script = [sys.executable, PICTURES / "pos_error.py", "--drives", "1", "--picture", picture]
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


@pytest.mark.parametrize("name", DRAWING)
def test_a_script_says_what_it_takes_before_it_draws(name, tmp_path):
    "From any folder, within the time of its imports; nothing is drawn meanwhile"
    script = [sys.executable, PICTURES / f"{name}.py", "--help"]
    printed = subprocess.check_output(script, text=True, cwd=tmp_path, timeout=60)
    assert "--picture" in printed
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", DRAWING)
def test_a_script_without_its_input_ends_in_a_sentence(name, tmp_path):
    "It names the file; a word that a script has no use for is refused as well"
    script = [sys.executable, PICTURES / f"{name}.py", tmp_path / "none"]
    done = subprocess.run(script, text=True, capture_output=True, cwd=tmp_path, check=False)
    assert done.returncode and str(tmp_path / "none") in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("name", DRAWING)
def test_a_script_draws_outside_the_manual(name):
    "Without --picture it draws into build/pictures, so that no picture of the manual changes"
    script = runpy.run_path(str(PICTURES / f"{name}.py"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", [f"{name}.py"])
        given = script["parse"]()
    assert given.picture.parent == ROOT / "build" / "pictures"


@pytest.mark.long
@pytest.mark.parametrize("name", SCRIPTS)
def test_a_benchmark_says_what_it_takes_before_it_works(name, tmp_path):
    "Within the time of its imports; nothing is measured meanwhile"
    script = [sys.executable, BENCHMARKS / f"{name}.py", "--help"]
    printed = subprocess.check_output(script, text=True, cwd=tmp_path, timeout=60)
    assert "usage:" in printed
