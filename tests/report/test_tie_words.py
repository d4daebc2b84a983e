"""What ties did, in sentences."""

import pytest

from mlscorr.report import tie_sentences

SECTION = {
    "n": 1200,
    "used": 1187,
    "before": {"median": 0.105, "rms": 0.42},
    "after": {"median": 0.0029, "rms": 0.005},
    "share": {"control": 0.14, "plane": 0.8, "pole": 0.06},
    "sufficient_control": 3,
}


def words(control, **changed):
    "All sentences on a section with changes"
    return " ".join(tie_sentences(SECTION | changed, control))


def test_a_client_reads_numbers_with_units_and_no_name_of_a_method():
    "Places, distances before and after, shares of 100 %, and the number of points that sufficed"
    text = words(6)
    assert "in 1 200 places" in text.replace("\N{NARROW NO-BREAK SPACE}", " ")
    assert "10.5 cm apart before the correction and lie 3 mm apart after it (median)" in text
    assert "13 of these places are not used" in text
    assert "14 % comes from control points and 86 % from these places" in text
    assert "6 control points took part; 3 of them, evenly spread, would have sufficed" in text


def test_without_control_nothing_absolute_is_claimed():
    "No control point: relative only, and no share of what there is not"
    text = words(0, sufficient_control=None)
    assert "relative only; nothing is claimed in absolute terms" in text
    assert "%" not in text


@pytest.mark.parametrize(
    "control, enough, expected",
    [(6, 6, "All 6 control points"), (2, 2, "Both control points"), (6, 1, "1 of them would")],
)
def test_all_points_or_a_single_one_are_named_so(control, enough, expected):
    "No sentence says that 6 of 6 would have sufficed"
    assert expected in words(control, sufficient_control=enough)


def test_a_share_of_next_to_nothing_is_not_zero():
    "0.3 % of control is not none, and the rest not all"
    text = words(2, share={"control": 0.003, "plane": 0.997, "pole": 0.0})
    assert "0.3 % comes from control points and 99.7 %" in text


def test_ties_that_are_not_used_are_said_to_be_so():
    "More than half of them contradict the others: who made the correction is said"
    nothing = {"used": 0, "before": {"median": None}, "after": {"median": None}}
    assert "control points alone made the correction" in words(4, **nothing)
    assert "passes stay apart" in words(0, **nothing)


def test_no_ties_have_their_reason_or_no_sentence():
    "The reason as it is where somebody looked for ties; else nothing"
    assert tie_sentences({"n": 0, "used": 0, "reason": "One pass."}, 3) == ["One pass."]
    assert tie_sentences(None, 3) == []
