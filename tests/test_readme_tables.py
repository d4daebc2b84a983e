"""The tables of README and docs are put in their place by the commands that measure them."""

import json

import pytest
from readme_tables import PAGES, TABLES, blind, markdown, names_in, place

TEXT = "before\n<!-- table: toy -->\n| old |\n<!-- end of table -->\nafter | kept |\n"


def test_a_table_takes_the_place_of_the_old_one():
    "All between the marks is new, all else stays; a second time changes nothing"
    table = markdown(["drive", "m"], [["car", 0.05], ["boat", 0.01]])
    text = place(TEXT, "toy", table)
    assert text == (
        "before\n<!-- table: toy -->\n| drive | m |\n| --- | --- |\n| car | 0.05 |\n"
        "| boat | 0.01 |\n<!-- end of table -->\nafter | kept |\n"
    )
    assert place(text, "toy", table) == text


def test_a_table_without_a_place_is_refused():
    "A name that the text does not have is no reason to write"
    with pytest.raises(ValueError, match="0 tables named 'other'"):
        place(TEXT, "other", "")


def test_every_table_has_its_command():
    "Each mark in README and docs names a table that can be measured, and each table has one place"
    assert [name for page in PAGES for name in names_in(page.read_text())] == list(TABLES)


def test_the_blind_check_becomes_a_table(tmp_path):
    "Shares are written in percent, counts and sizes as they are, goals with their sign"
    rows = [
        {
            "name": "right effect",
            "cases": 32,
            "value": 0.69,
            "interval": [0.51, 0.82],
            "goal": [0.92, None],
        },
        {
            "name": "size of the set",
            "cases": 96,
            "value": 1.47,
            "interval": [1.3, 1.65],
            "goal": [None, 1.5],
        },
    ]
    (tmp_path / "score.json").write_text(json.dumps({"rows": rows}))
    lines = blind(tmp_path).splitlines()
    assert lines[2] == "| right effect | 32 | 69 % [51, 82] | >= 92 % |"
    assert lines[3] == "| size of the set | 96 | 1.47 [1.30, 1.65] | <= 1.50 |"
