"""Statements on ties between passes."""

import pytest

from mlscorr.report.tables import tie_statements

SECTION = {
    "n": 1200,
    "used": 1187,
    "before": {"median": 0.105, "rms": 0.42},
    "after": {"median": 0.0029, "rms": 0.005},
    "share": {"control": 0.14, "plane": 0.8, "pole": 0.06},
    "sufficient_control": 3,
}


def said(control, **changed):
    "Values of all that is said of a section with changes, by their keys"
    statements = tie_statements(SECTION | changed, control)
    return {statement.key: statement.values for statement in statements}


def test_places_distances_shares_and_the_points_that_sufficed_are_told():
    "In this order, with the numbers of the section"
    assert said(6) == {
        "ties": {"n": 1200, "before": 0.105, "after": 0.0029},
        "contradicting ties": {"wrong": 13},
        "share of control": {"control": 0.14},
        "sufficient control": {"control": 6, "sufficient": 3},
    }


def test_without_control_nothing_absolute_is_claimed():
    "No control point: relative only, and no share of what there is not"
    keys = list(said(0, sufficient_control=None))
    assert keys == ["ties", "contradicting ties", "relative ties"]


@pytest.mark.parametrize(
    ("control", "enough", "key"),
    [(6, 6, "all control needed"), (2, 2, "all control needed"), (6, 1, "sufficient control")],
)
def test_all_points_are_not_said_to_have_sufficed(control, enough, key):
    "No statement says that 6 of 6 would have sufficed"
    assert list(said(control, sufficient_control=enough))[-1] == key


def test_ties_that_are_not_used_are_said_to_be_so():
    "More than half of them contradict the others: who made the correction is said"
    nothing = {"used": 0, "before": {"median": None}, "after": {"median": None}}
    assert said(4, **nothing) == {"unused ties": {"n": 1200, "has_control": True}}
    assert said(0, **nothing) == {"unused ties": {"n": 1200, "has_control": False}}


def test_no_ties_have_their_reason_or_no_statement():
    "The reason as it is where somebody looked for ties; else nothing"
    assert said(3, n=0, used=0, reason="One pass.") == {"no ties": {"reason": "One pass."}}
    assert tie_statements(None, 3) == []
