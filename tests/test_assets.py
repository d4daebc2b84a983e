"""The pictures of README.md and docs, and the script that compares them."""

import importlib.util

import numpy as np
from PIL import Image

from tests.test_house import ROOT

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
