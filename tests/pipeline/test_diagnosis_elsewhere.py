"""The diagnosis of surveys that another simulator made."""

import json

import pytest

import mlscorr
from tests.beds.shared import shared

pytestmark = pytest.mark.long


@pytest.mark.parametrize("name", ["none", "time_offset", "lever_arm", "position_bump"])
def test_surveys_of_another_simulator_are_told_rightly(name):
    "Effects that another simulator put into a survey are named, with their size"
    folder = shared("surveys", f"practice_{name}")
    told = mlscorr.diagnose(mlscorr.read_survey(folder)).document
    assert told["verdict"]["label"] == name
    if name == "none":
        return
    truth = json.loads((folder / "truth.json").read_text())["params"]
    found = {one["name"]: one for one in told["causes"][0]["parameters"]}
    metres = dict(zip(("right", "forward", "up"), truth.get("metres", ()), strict=False))
    wanted = {
        "time_offset": {"magnitude": truth.get("seconds")},
        "lever_arm": metres,
        "position_bump": {"height": metres.get("up")},
    }[name]
    for key, value in wanted.items():
        off = abs(found[key]["estimate"] - value)
        assert off < max(0.1 * abs(value), 1.96 * found[key]["sigma"]), key
