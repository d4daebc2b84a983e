"""First screen of a diagnosis."""

import pytest

from mlscorr.report.gap import gap_screen
from tests.beds.gap_documents import gap_document


def facts(document):
    "The first screen of a document, by what each fact is about"
    screen = gap_screen(document)
    return screen["rating"], {row["what"]: row for row in screen["statements"]}


def test_two_answers_stand_apart():
    "Accuracy of the cloud is one question, unmodeled errors are another"
    rating, rows = facts(gap_document("time_offset"))
    assert list(rows)[:2] == ["Accuracy", "Unmodeled"] and rating == "red"
    assert "less accurate than stated" in rows["Accuracy"]["sentence"]
    items = {item["name"]: item["text"] for item in rows["Accuracy"]["items"]}
    assert items["Surveyed targets"].startswith("RMS 4.1 cm per axis, 1.2 cm")
    assert items["Surveyed targets"].endswith("(limit 2.4 cm)")
    assert items["Scanner clock offset"] == "effect on the residuals: 1.2 cm (RMS)"


def test_a_good_survey_is_good_in_both():
    "Nothing unmodelled, and no channel farther off than 1.96 stated sigmas"
    good = [{"channel": "target", "things": 16, "rms_mm": 19.0, "stated_mm": 10.0}]
    _, rows = facts(gap_document("none", agreement=good))
    assert rows["Accuracy"]["rating"] == rows["Unmodeled"]["rating"] == "green"
    assert "as accurate as stated" in rows["Accuracy"]["sentence"]


def test_what_the_simulator_has_already_is_off_the_residuals():
    "A second round says so, for the cloud itself is still as it was"
    _, rows = facts(gap_document("none", simulator={"effects": [{"name": "time_offset"}]}))
    assert rows["Accuracy"]["sentence"].startswith(
        "The recorded cloud, after removing the errors in the simulator"
    )


@pytest.mark.parametrize(
    ("left_out", "mendable", "rating"),
    [
        ({"range_bias": "It acts on the range, and the survey has no [mounting]."}, True, "amber"),
        ({"dropout": "No residual of this survey depends on it."}, False, "green"),
    ],
)
def test_what_could_not_be_judged_is_said_first(left_out, mendable, rating):
    "With the reason, and amber where the user could give what is missing"
    _, rows = facts(gap_document("none", left_out=left_out, mendable=[*left_out] * mendable))
    row = rows["Not tested"]
    assert row["rating"] == rating and row["sentence"].startswith("1 of ")
    assert row["items"][0]["text"] in left_out.values()


ASSUMED = [
    {"key": "pos.position_sigma", "value": 0.02, "unit": "m", "estimate": 0.2},
    {"key": "pos.correlation_time", "value": 30.0, "unit": "s", "estimate": None},
]


def test_a_default_is_called_assumed_and_judges_nothing():
    "12 cm where nobody stated a sigma are neither more nor less than stated"
    _, rows = facts(gap_document("none", assumed=ASSUMED))
    accuracy = rows["Accuracy"]
    assumed = rows["Assumed"]
    assert accuracy["rating"] == assumed["rating"] == "amber"
    assert "no sigma of the POS is given" in accuracy["sentence"]
    assert accuracy["items"][0]["text"] == "RMS 1.4 cm per axis"
    assert assumed["sentence"].startswith("2 accuracies were not given and are assumed")
    items = {item["name"]: item["text"] for item in assumed["items"]}
    assert items["Position of the POS"] == "2.0 cm assumed; estimated from this survey: 20.0 cm"
    assert items["Correlation time of the POS"].startswith("30 s assumed; 0.1 to 3 times")
    assert "Assumed" not in facts(gap_document("none"))[1]


def test_a_time_that_is_assumed_leaves_the_accuracy_to_be_judged():
    "With sigma columns and without [pos] the correlation time alone is assumed: green"
    _, rows = facts(gap_document("none", assumed=ASSUMED[1:]))
    assert rows["Assumed"]["rating"] == "green"
    assert rows["Accuracy"]["sentence"] == "The recorded cloud is as accurate as stated."
    assert "sigma columns" not in rows["Assumed"]["sentence"]


def test_a_noisy_pos_is_not_noisier_than_what_nobody_stated():
    "The verdict on positions compares them with what is assumed, and says that"
    document = gap_document("position_noise", 0.97, assumed=ASSUMED)
    assert "Noisier than assumed" in facts(document)[1]["Unmodeled"]["sentence"]
    document = gap_document("position_noise", 0.97)
    assert "Noisier than stated" in facts(document)[1]["Unmodeled"]["sentence"]
