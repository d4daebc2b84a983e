"""The first line of a report."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.estimate import Support, WeakStretch
from mlscorr.evaluate.rows import TargetRow
from mlscorr.report.headline import headline
from tests.beds.reports import drive, fabricate, page, words


def lost(name, role="check", scanned=True, number=None):
    "A surveyed point that was not observed"
    return TargetRow.unobserved(name, number, role, np.zeros(3), f"{name} is hidden.", scanned)


def test_all_that_was_seen_and_held_is_said_plainly():
    "Two check and six control points on a drive that control holds"
    report = replace(fabricate(drive())[2], support=Support())
    assert headline(report) == (
        "2 of 2 surveyed check points were seen and scored. "
        "Control: 6 of 6 surveyed points used. Control points hold the whole drive."
    )


def test_a_check_point_that_should_have_been_seen_counts_against_the_result():
    "It is counted and named; one on another street is counted, and one of two passes isn't"
    report = fabricate(drive())[2]
    observed = next(row.name for row in report.targets if row.role == "check")
    rows = [lost("C7"), lost("C8", scanned=False), lost(observed, number=2)]
    report = replace(report, targets=[*report.targets, *rows])
    text = headline(report)
    assert text.startswith("2 of 4 surveyed check points were seen and scored. 1 check point was")
    assert "(C7)" in text and "counts against this result" in text
    assert "1 stands where nothing was scanned." in text
    check = report.document()["check"]
    assert (check["n_surveyed"], check["n_seen"], check["n_unseen"]) == (4, 2, 1)
    assert check["unseen"] == [{"name": "C7", "reason": "C7 is hidden."}]


def test_refused_and_missing_control_points_are_counted():
    "A rejected one, and one that was not seen"
    report = fabricate(drive())[2]
    out = {"used": False, "reason": "outlier"}
    rows = [replace(report.targets[0], **out), *report.targets[1:], lost("T40", "control")]
    text = headline(replace(report, targets=rows))
    assert "Control: 5 of 7 surveyed points used, 1 refused (T01), 1 not seen (T40)." in text


def test_an_extrapolated_part_is_told_with_its_length_and_the_error_to_expect():
    "Seconds, metres, share of the points, and the largest sigma"
    weak = WeakStretch(0.0, 20.0, 100.0, 0.4, "a"), WeakStretch(50.0, 61.5, 60.0, 1.25, "b")
    report = replace(fabricate(drive())[2], support=Support(weak))
    text = headline(report)
    assert "31.5 s (160 m) of the drive, 3 % of the points" in text
    assert "up to 1.25 m is to be expected" in text


def test_nothing_independent_is_said_where_no_check_point_was_surveyed():
    "A fit proves little"
    report = fabricate(drive(), checks=False)[2]
    assert headline(report).startswith("No check point was surveyed, so nothing independent")


@pytest.mark.parametrize("ties", [None, {"n": 700, "used": 700}, {"n": 700, "used": 0}])
def test_without_control_the_first_words_are_that_only_the_pos_says_where_the_cloud_lies(ties):
    "Check points follow, relative accuracy is named where ties were used, no count of 0 of 0"
    report = fabricate(drive())[2]
    rows = [row for row in report.targets if row.role == "check"]
    text = headline(replace(report, targets=rows, ties=ties))
    assert text.startswith("No control point takes part: nothing but the POS says where the cloud")
    assert "up to 9.0 cm is to be expected" in text
    assert text.endswith("2 of 2 surveyed check points were seen and scored.")
    assert ("accuracy is relative only" in text) == (ties is not None and ties["used"] > 0)
    assert "0 of 0" not in text


def test_the_page_begins_with_it_and_lists_what_was_not_seen(tmp_path):
    "The headline before the verdict, and each missing point with its reason"
    survey, correction, report = fabricate(drive())
    report = replace(report, targets=[*report.targets, lost("C7")])
    html = page(tmp_path, survey, correction, report)
    text = words(html)
    assert text.index(headline(report)) < text.index("The correction brought the cloud")
    assert "C7 : C7 is hidden." in text and 'class="verdict worse"' in html
