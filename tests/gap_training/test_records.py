"""Records are made once and read again."""

import json

from gap_training.records import collect, read_records

from tests.beds.joint_scores import records


def test_what_is_in_the_folder_is_read(tmp_path):
    "Worlds whose files are there are not made again, and come back as they were"
    known = records(6, worlds=1)
    text = json.dumps([vars(r) | {"joint": vars(r.joint)} for r in known])
    (tmp_path / "0.json").write_text(text)
    assert read_records(tmp_path / "0.json") == known
    assert collect(tmp_path, [0], 6, {}) == known


def test_a_truth_is_right_in_any_order():
    "Both of a pair in any order, and not one of them alone"
    pair = next(r for r in records(60) if r.kind == "pair")
    assert pair.is_right("boresight+range_bias")
    assert not pair.is_right("boresight")
