"""What a diagnosis says first."""

import pytest

from mlscorr.report.gap import gap_screen
from tests.beds.gap_documents import gap_document


def facts(document):
    "The first screen of a document, by what each fact is about"
    screen = gap_screen(document)
    return screen["rating"], {row["what"]: row for row in screen["statements"]}


def test_two_answers_stand_apart():
    "Whether the cloud is accurate is one question, whether something is unmodelled another"
    rating, rows = facts(gap_document("time_offset"))
    assert list(rows)[:2] == ["Accuracy", "Unmodelled"] and rating == "red"
    assert "less accurate than stated" in rows["Accuracy"]["sentence"]
    items = {item["name"]: item["text"] for item in rows["Accuracy"]["items"]}
    assert items["Surveyed targets"].startswith("off by 4.1 cm (RMS per axis), 1.2 cm")
    assert items["Surveyed targets"].endswith("(worse from 2.4 cm on)")
    assert items["Scanner clock offset"] == "moves what was compared by 1.2 cm (RMS)"


def test_a_good_survey_is_good_in_both():
    "Nothing unmodelled, and no channel farther off than 1.96 stated sigmas"
    good = [{"channel": "target", "things": 16, "rms_mm": 19.0, "stated_mm": 10.0}]
    _, rows = facts(gap_document("none", agreement=good))
    assert rows["Accuracy"]["rating"] == rows["Unmodelled"]["rating"] == "green"
    assert "as accurate as stated" in rows["Accuracy"]["sentence"]


def test_what_the_simulator_has_already_is_off_the_residuals():
    "A second round says so, for the cloud itself is still as it was"
    _, rows = facts(gap_document("none", simulator={"effects": [{"name": "time_offset"}]}))
    assert rows["Accuracy"]["sentence"].startswith("The recorded cloud, less what the simulator")


@pytest.mark.parametrize(
    ("left_out", "rating"),
    [
        ({"range_bias": "It acts on the range, and the survey has no [mounting]."}, "amber"),
        ({"dropout": "No row of this survey depends on it."}, "green"),
    ],
)
def test_what_could_not_be_judged_is_said_first(left_out, rating):
    "With the reason, and amber where the user could give what is missing"
    _, rows = facts(gap_document("none", left_out=left_out))
    row = rows["Not judged"]
    assert row["rating"] == rating and row["sentence"].startswith("1 of ")
    assert row["items"][0]["text"] in left_out.values()
