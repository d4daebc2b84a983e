"""The command that learns."""

import json
import sys

import pytest
from train_decision import main

from tests.beds.joint_scores import records


@pytest.mark.long
def test_prints_both_operating_points(tmp_path, monkeypatch, capsys):
    "From records that are there already, rates for cheap and for dear false alarms"
    made = records(160)
    for world in range(8):
        of_world = [vars(r) | {"joint": vars(r.joint)} for r in made if r.world == world]
        (tmp_path / f"{world}.json").write_text(json.dumps(of_world))
    arguments = ["train", str(tmp_path), "--first", "0", "--worlds", "8"]
    monkeypatch.setattr(sys, "argv", arguments)
    main()
    told = capsys.readouterr().out
    assert "sensitive    default    careful" in told
    assert "calibration error" in told
