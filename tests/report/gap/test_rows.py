"""Rows of the tables of a diagnosis and of a plan."""

import pytest

from mlscorr.report.gap._rows import bin_rows, cause_rows, detectable_rows, round_rows, worst_rows
from tests.beds.gap_documents import CAUSES, gap_document, parameter, round_document


def part(name, detectable, typical):
    return {"name": name, "unit": "m", "detectable": detectable, "typical": typical}


@pytest.mark.parametrize(
    ("detectable", "typical", "visible"),
    [
        (0.004, 0.01, "yes"),
        (0.025, 0.01, "only from 2.5 times the usual size"),
        (0.25, 0.01, "only from 25 times the usual size"),
        (0.025, None, "–"),
        (None, 0.01, "no"),
    ],
)
def test_a_survey_sees_what_is_smaller_than_usual(detectable, typical, visible):
    "Smallest over usual size in words; nothing is made up where one of them is not known"
    (row,) = detectable_rows({"range_bias": [part("range_bias", detectable, typical)]})
    assert (row.title, row.name, row.visible) == ("Range bias", "magnitude", visible)


def test_the_worst_part_of_an_effect_counts():
    "Each effect has a row of its least visible part, and the plainest effect stands first"
    rows = detectable_rows(
        {
            "lever_arm": [part("lever_arm up", 0.06, 0.02), part("lever_arm right", 0.01, 0.02)],
            "range_bias": [part("range_bias", 0.02, 0.01)],
        }
    )
    assert [(row.title, row.name) for row in worst_rows(rows)] == [
        ("Range bias", "magnitude"),
        ("Lever arm", "up"),
    ]


def test_every_bin_and_every_parameter_has_a_row():
    "Bins of all splits with their edges; a cause without parameters has a row of dashes"
    document = gap_document()
    bins = bin_rows(document)
    causes = cause_rows(document)
    assert len(bins) == sum(len(split["count"]) for split in document["where"])
    assert (bins[0].by, bins[0].bin) == ("Time since the start (s)", "0 to 25.0")
    assert [row.chosen for row in causes if row.title == "Scanner clock offset"] == [True]
    nothing = next(row for row in causes if row.title == "Nothing")
    assert (nothing.name, nothing.estimate, nothing.unit) == ("–", "–", "–")


def test_a_round_names_the_target_that_is_wrong():
    "A correction sheet without the target's name helps nobody"
    sizes = [parameter(axis, "m", 0.146, 0.004) for axis in ("easting", "northing", "height")]
    (row,) = round_rows([round_document("target_outlier", parameters=sizes, target="T08")])
    assert "The surveyed coordinates of target T08 are wrong" in row.size


def test_a_round_says_when_its_event_acts():
    "Of two passing errors, each found in a round of its own, each has its time"
    window = {"effect": "position_bump", "start": 413215.0, "end": 413225.0}
    sizes = CAUSES["position_bump"]
    (row,) = round_rows([round_document("position_bump", parameters=sizes, windows=[window])])
    assert "between gps_time 413215 s and 413225 s" in row.size


def test_what_was_not_put_into_the_simulator_closes_nothing():
    "Of something unknown the table has the gap before, and dashes for what is left and gone"
    (row,) = round_rows([round_document("unknown", after=None, shrink=None)])
    assert (row.before, row.after, row.gone) == ("38.2 mm", "–", "–")
