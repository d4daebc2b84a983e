"""The first line of a report."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.cli.correct import report_result
from mlscorr.estimate import DRIFT, REASONS, Support, WeakInterval
from mlscorr.estimate.support import NO_CONTROL
from mlscorr.evaluate import DatumDifference, TargetRow
from mlscorr.report import first_screen
from mlscorr.report.headline import headline, statements
from mlscorr.survey import Assumption
from tests.beds.reports import START, because, drive, fabricate, page, report_of, words


def lost(name, role="check", scanned=True, number=None):
    "A surveyed point that was not observed"
    return TargetRow.unobserved(
        name, number, role, np.zeros(3), because(f"{name} is hidden."), scanned
    )


def said(report, what):
    "Statements of a row of the first screen, by their keys"
    rows = [row for row in statements(report) if row.what == what]
    return {statement.key: statement for row in rows for statement in row.statements}


def test_all_that_was_seen_and_held_is_said_plainly():
    "Two check and six control points on a drive that control holds"
    report = replace(fabricate(drive())[2], support=Support())
    assert headline(report) == (
        "2 of 2 surveyed check points were found and used for the RMSE. Control: 6 of 6 "
        "surveyed points used. Control points constrain the whole drive."
    )


def test_a_check_point_that_should_have_been_seen_counts_against_the_result():
    "It is counted and named; one on another street is counted, and one of two passes isn't"
    report = fabricate(drive())[2]
    observed = next(row.name for row in report.targets if row.role == "check")
    rows = [lost("C7"), lost("C8", scanned=False), lost(observed, number=2)]
    report = replace(report, targets=[*report.targets, *rows])
    points = said(report, "Check points")
    assert points["check points"].values == {"scored": 2, "surveyed": 4}
    assert points["hidden check points"].values == {"names": ["C7"]}
    assert points["check points elsewhere"].values == {"count": 1, "by_others": False}
    check = report.document()["check"]
    assert (check["n_surveyed"], check["n_seen"], check["n_unseen"]) == (4, 2, 1)
    assert check["unseen"] == [{"name": "C7", "reason": "C7 is hidden."}]


def test_refused_and_missing_control_points_are_counted():
    "A rejected one, and one that was not seen"
    report = fabricate(drive())[2]
    out = {"used": False, "why": because("outlier")}
    rows = [replace(report.targets[0], **out), *report.targets[1:], lost("T40", "control")]
    values = said(replace(report, targets=rows), "Control points")["control points"].values
    assert (values["scored"], values["surveyed"]) == (5, 7)
    assert (values["refused"], values["hidden"]) == (["T01"], ["T40"])


def test_control_in_another_scale_is_not_green(tmp_path):
    "The term, what it makes, and the sentence of the warning; the result is amber however good"
    survey, correction, report = fabricate(drive())
    size = np.array([4e-4])
    sigma = np.array([1e-5])
    scale = DatumDifference("scale", size, sigma, 20.0, 12, 250.0)
    report = replace(report, support=Support(), datum=(scale,))
    assert scale.sentence in words(page(tmp_path, survey, correction, report))
    screen = first_screen(report)
    (fact,) = [fact for fact in screen["statements"] if fact["what"] == "Datum"]
    assert (fact["rating"], screen["rating"]) == ("amber", "amber")
    assert said(report, "Datum")["datum"].values["lengths"] == pytest.approx({"scale": 0.1})
    assert fact["items"] == [{"name": "scale", "text": scale.sentence}]
    assert [fact["rating"] for fact in screen["statements"] if fact["what"] == "Result"] == [
        "amber"
    ]
    assert report.document()["datum"] == [scale.document()]


@pytest.mark.parametrize("checks", [True, False])
def test_a_single_control_point_is_corrected_by_no_others(checks):
    "It is said that the POS alone checks it, and no number of what the others make of it"
    rows = [row for row in fabricate(drive(), count=3)[2].targets if row.name != "T02"]
    report = report_of(drive(), rows if checks else rows[:1])
    (fact,) = said(report, "Leave-one-out").values()
    assert (fact.key, fact.severity) == ("single control point", "warning")
    words = " ".join(f"{row.sentence} {row.items}" for row in statements(report))
    assert "the others" not in words and "(leave-one-out)" not in words


def test_what_was_found_half_a_metre_off_is_not_said_to_be_unseen():
    "Refused, with its reason; a check point counts against the result all the same"
    report = fabricate(drive())[2]
    seen = {"scanned": True, "gps_time": 413_200.0}
    reason = "T40 lies 0.50 m from where the observation says."
    rows = [
        TargetRow.unobserved(name, 1, role, np.zeros(3), because(reason), **seen)
        for name, role in (("T40", "control"), ("C40", "check"))
    ]
    report = replace(report, targets=[*report.targets, *rows])
    control = said(report, "Control points")["control points"].values
    assert (control["refused"], control["hidden"]) == (["T40"], [])
    rows = {row.what: row for row in statements(report)}
    assert rows["Control points"].items == (("T40", reason),)
    check = said(report, "Check points")
    assert check["refused check points"].values == {"names": ["C40"]}
    assert "hidden check points" not in check and rows["Check points"].rating == "red"
    assert report.document()["check"]["n_unseen"] == 1


def test_an_extrapolated_part_is_told_with_its_length_and_the_error_to_expect():
    "Seconds, metres, share of the points, and the largest sigma"
    weak = WeakInterval(0.0, 20.0, 100.0, 0.4, "a"), WeakInterval(50.0, 61.5, 60.0, 1.25, "b")
    report = replace(fabricate(drive())[2], support=Support(weak))
    values = said(report, "Extrapolated")["extrapolated"].values
    assert (values["seconds"], values["metres"], values["sigma"]) == (31.5, 160.0, 1.25)
    assert values["share"] == report.coverage.share_extrapolated


def test_nothing_independent_is_said_where_no_check_point_was_surveyed():
    "A fit proves little"
    report = fabricate(drive(), checks=False)[2]
    assert list(said(report, "Check points")) == ["no check point"]


@pytest.mark.parametrize("ties", [None, {"n": 700, "used": 700}, {"n": 700, "used": 0}])
def test_without_control_the_first_words_are_that_only_the_pos_says_where_the_cloud_lies(ties):
    "Check points follow, relative accuracy is named where ties were used, no count of 0 of 0"
    report = fabricate(drive())[2]
    rows = [row for row in report.targets if row.role == "check"]
    report = replace(report, targets=rows, ties=ties)
    fact = said(report, "Control points")["no control point"]
    assert fact.values == {"sigma": 0.09, "is_tied": ties is not None and ties["used"] > 0}
    control, check = (
        next(row.sentence for row in statements(report) if row.what == what)
        for what in ("Control points", "Check points")
    )
    assert headline(report) == f"{control} {check}"


def test_page_report_and_terminal_begin_with_the_same_statements(tmp_path, capsys):
    "Each sentence and each named point stands in all three before any table, the worst is red"
    survey, correction, report = fabricate(drive())
    report.model["warnings"] = ["The clock may be wrong."]
    outlier = because("outlier")
    rows = [replace(report.targets[0], used=False, why=outlier), *report.targets[1:]]
    report = replace(report, targets=[*rows, lost("C7")])
    content = {**first_screen(report), **report.document()}
    html = page(tmp_path, survey, correction, report)
    report_result(content, tmp_path, as_json=False)
    terminal = " ".join(capsys.readouterr().err.split())
    text = words(html)
    for row in content["statements"]:
        assert row["sentence"] in text[: text.index("Misclosures at the surveyed")]
        if row["what"] != "Warnings":  # said when they arose
            assert row["sentence"] in terminal[: terminal.index("RMSE of misclosures")]
    assert "C7 : C7 is hidden." in text and "C7: C7 is hidden." in terminal
    assert "T01 : outlier" in text and "T01: outlier" in terminal
    assert "The clock may be wrong." in text
    assert content["rating"] == "red" and 'class="verdict red"' in html


def test_a_good_result_is_green_and_a_part_that_was_left_is_red():
    "Nothing is amber without a reason; points that were left as they were can't be overlooked"
    report = replace(fabricate(drive())[2], support=Support())
    assert {row.rating for row in statements(report)} == {"green"}
    left = replace(report, coverage=replace(report.coverage, points_outside_trajectory=7))
    points = next(row for row in statements(left) if row.what == "Points")
    assert points.rating == "red" and points.statements[0].values["left"] == 7
    assert first_screen(left)["rating"] == "red"


def test_a_weak_stretch_is_named_by_time_and_way_and_is_amber_where_it_exceeds_what_was_tested():
    "The worst first; where its sigma is below what was found at points, it changes nothing"
    report = fabricate(drive())[2]
    for sigma, rating in ((0.4, "amber"), (0.0001, "green")):
        weak = (
            WeakInterval(10.0, 20.0, 50.0, sigma / 2, "a"),
            WeakInterval(50.0, 61.5, 60.0, sigma, "b", 300.0),
        )
        row = next(
            row
            for row in statements(replace(report, support=Support(weak)))
            if row.what == "Extrapolated"
        )
        assert row.rating == rating
        assert row.items[0][0] == "50.0 to 61.5 s, chainage 300 to 360 m"


def test_a_correction_that_is_extrapolated_everywhere_is_never_green():
    "A correction by ties alone has no known position, even with a sigma below the misclosures"
    report = fabricate(drive())[2]
    everywhere = replace(report.coverage, points_extrapolated=report.coverage.points_corrected)
    weak = Support((WeakInterval(0.0, 60.0, 300.0, 0.0001, "a"),))
    rows = statements(replace(report, coverage=everywhere, support=weak))
    (row,) = (row for row in rows if row.what == "Extrapolated")
    assert row.rating == "amber" and row.statements[0].values["share"] == 1.0


def test_a_sigma_beyond_what_the_pos_states_is_amber():
    "Metres along half of the way where centimetres are stated: the correction is hardly one"
    report = replace(fabricate(drive())[2], support=Support())
    for stated, rating in ((6.0, "green"), (0.03, "amber")):
        sigma = {"median": 5.3, "largest": 13.0, "time": 413_205.0, "stated": stated}
        rows = statements(replace(report, position_sigma=sigma))
        (row,) = (row for row in rows if row.what == "Sigma")
        assert row.rating == rating
        keys = [statement.key for statement in row.statements]
        assert ("stated sigma" in keys) == (rating == "amber")


def test_a_sigma_that_nobody_stated_is_called_assumed():
    "It is green, for control points show better, and nowhere does the POS state it"
    report = fabricate(drive())[2]
    assert "Assumed" not in [row.what for row in statements(report)]
    assumed = (Assumption("pos.position_sigma", 0.02, "m"),)
    rows = {row.what: row for row in statements(replace(report, assumed=assumed))}
    assert rows["Assumed"].rating == "green"
    assert rows["Assumed"].items == (("Position of the POS", "2.0 cm assumed"),)
    values = rows["Assumed"].statements[0].values
    assert (values["count"], values["sections"], values["has_sigma"]) == (1, ["[pos]"], True)
    assert replace(report, assumed=assumed).document()["assumed"][0]["value"] == 0.02


def test_a_drive_without_control_of_its_own_is_not_held_by_it():
    "Constraints through ties with other drives are reported as such"
    report = fabricate(drive())[2]
    rows = [row for row in report.targets if row.role == "check"]
    report = replace(report, targets=rows, support=Support())
    (fact,) = said(report, "Extrapolated").values()
    assert (fact.key, fact.severity) == ("held by other drives", "warning")


@pytest.mark.parametrize("weak", [(), (WeakInterval(0.0, 9.0, 45.0, 0.02, REASONS[DRIFT]),)])
def test_a_drive_that_others_hold_is_nowhere_said_to_stand_on_the_pos_alone(weak):
    "Without control of its own, and with a part of which theirs tells little, it is not red"
    report = fabricate(drive())[2]
    rows = [row for row in report.targets if row.role == "check"]
    report = replace(report, targets=rows, support=Support(weak))
    (fact,) = said(report, "Control points").values()
    assert (fact.key, fact.severity) == ("control of other drives", "warning")
    assert headline(report).startswith("2 of 2 surveyed check points were found")
    alone = Support((WeakInterval(0.0, 9.0, 45.0, 0.02, REASONS[NO_CONTROL]),))
    assert list(said(replace(report, support=alone), "Control points")) == ["no control point"]


def test_what_became_no_better_is_not_green():
    "8 mm at check points that are 10 mm off afterwards, as their sigma allows: amber"
    report = replace(fabricate(drive())[2], support=Support())
    ratings = []
    for before in (0.030, 0.008):
        report.check.before.rmse[:] = before
        report.check.after.rmse[:] = 0.0102
        ratings.append(statements(report)[0].rating)
    assert ratings == ["green", "amber"]


def test_a_sigma_between_control_points_that_is_larger_than_any_extrapolated_is_named():
    "9.5 cm in the middle of a drive that control holds, 9 cm at its ends; 9 cm there alone is not"
    report = fabricate(drive())[2]
    middle = {"median": 0.02, "largest": 0.095, "time": START + 30.0}
    assert list(said(report, "Extrapolated")) == ["extrapolated"]
    both = said(replace(report, position_sigma=middle), "Extrapolated")
    assert both["between control points"].values == {"sigma": 0.095}
    edge = replace(report, position_sigma=middle | {"time": START, "largest": 0.09})
    assert list(said(edge, "Extrapolated")) == ["extrapolated"]
