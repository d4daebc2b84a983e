"""The page of a comparison: the methods in words, a table and a figure."""

import numpy as np
import pytest

from mlscorr.evaluate import TargetRow
from mlscorr.report import comparison_figure, comparison_screen, method_warnings, write_comparison
from mlscorr.report._comparison_screen import comparison_statements, ranking, verdict
from tests.beds.reports import because

PLACE = np.array([532_000.0, 3_374_000.0, 42.0])
UNSEEN = [TargetRow.unobserved("T9", 1, "check", PLACE, because("No disc there."), True)]


def fake(scores, **changes):
    "A document of compare.json with these 3D RMSE (m)"
    kinds = {"raw": "none", "lsc": "collocation", "correct": "collocation", "ls-2": "over time"}
    rows = []
    for name, value in scores.items():
        axes = None if value is None else [value / np.sqrt(3)] * 3
        score = {"n": 8, "rmse": axes, "min": axes, "max": axes, "rmse_3d": value}
        rows.append(
            {
                "name": name,
                "kind": kinds.get(name, "one move"),
                "about": f"About {name} <&>.",
                "status": "determined" if value is not None else "not determined",
                "why": None if value is not None else "All targets lie on one <line>.",
                "check": score,
                "control": score,
                "cross_validated": score,
                "seconds": None if value is None else 0.1,
                "warnings": [],
                "details": {"ties": 0, "untied": "One pass."} if name == "correct" else {},
            }
        )
    document = {"name": "street", "crs": None, "control_points": 9, "check_points": 8}
    document |= {"scored_by": "check", "cross_validation_groups": 0, "methods": rows, "unseen": []}
    document |= changes
    return comparison_screen(document, UNSEEN) | document


@pytest.mark.parametrize(
    ("scores", "keys", "values"),
    [
        (
            {"raw": 0.5, "shift": 0.2, "lsc": 0.02},
            ["best method", "best of a kind"],
            {"name": "lsc", "about": "About lsc <&>.", "rmse": 0.02, "raw": 0.5},
        ),
        (
            {"raw": 0.5, "shift": 0.0215, "lsc": 0.02},
            ["best methods"],
            {"names": ["lsc", "shift"], "rmse": 0.02, "raw": 0.5, "least": 0.002},
        ),
        (
            {"raw": 0.5, "ls-2": 0.02, "correct": 0.03},
            ["best method", "behind the best"],
            {"name": "ls-2", "about": "About ls-2 <&>.", "rmse": 0.02, "raw": 0.5},
        ),
        (
            {"raw": 0.021, "shift": 0.02, "lsc": 0.03},
            ["no method improves"],
            {"least": 0.002, "raw": 0.021},
        ),
    ],
)
def test_the_verdict_says_what_the_numbers_say(scores, keys, values):
    "Best, tie, our own method behind, nothing gained"
    said = verdict(fake(scores))
    assert [statement.key for statement in said] == keys
    assert said[0].values == values


def test_the_page_is_one_file_that_sorts_and_tells_what_is_missing(tmp_path):
    "No address leads out of the page, its table is sorted, and text from outside is escaped"
    path = tmp_path / "compare.html"
    write_comparison(path, fake({"raw": 0.5, "shift": 0.2, "affine": None, "lsc": 0.02}))
    page = path.read_text()
    assert "http:" not in page.replace("http://www.w3.org", "") and "https:" not in page
    assert "default-src 'none'; img-src data:;" in page
    assert "All targets lie on one &lt;line&gt;." in page
    rows = page[page.index("<tbody>") : page.index("</tbody>")]
    assert rows.index(">lsc<") < rows.index(">shift<") < rows.index(">raw<")
    assert "table.sortable" in page
    assert 'src="data:image/svg+xml' in page


def test_methods_are_ranked_and_those_without_a_score_are_not():
    "By their 3D RMSE; a method that could not be fitted has no place"
    document = fake({"raw": 0.5, "affine": None, "lsc": 0.02, "shift": 0.2})
    assert [row["name"] for row in ranking(document)] == ["lsc", "shift", "raw"]


def said_of(document, what):
    "Statements of a row of the first screen"
    rows = comparison_statements(document, UNSEEN)
    return [statement for row in rows if row.what == what for statement in row.statements]


@pytest.mark.parametrize(
    ("changes", "key", "values"),
    [
        ({}, "scored by check points", {"control": 9, "check": 8}),
        ({"scored_by": "control"}, "scored by the fit", {"control": 9}),
        (
            {"scored_by": "cross_validated", "check_points": 1, "cross_validation_groups": 9},
            "cross-validated",
            {"control": 9, "check": 1, "groups": 9},
        ),
    ],
)
def test_what_the_scores_rest_on_is_one_statement(changes, key, values):
    "Check points, cross-validation, or the fit alone"
    (said,) = said_of(fake({"raw": 0.5, "lsc": 0.02}, **changes), "Scores")
    assert (said.key, said.values) == (key, values)


def test_what_failed_stands_on_the_first_screen():
    "Check points without an observation and methods without a score are named, with the reason"
    document = fake({"raw": 0.5, "affine": None, "lsc": 0.02})
    facts = {row["what"]: row for row in document["statements"]}
    assert document["rating"] == facts["Check points"]["rating"] == "red"
    assert facts["Check points"]["items"] == [{"name": "T9", "text": "No disc there."}]
    (said,) = said_of(document, "Not determined")
    assert said.values == {"count": 1, "methods": 3}
    assert facts["Not determined"]["items"][0]["name"] == "affine"
    assert facts["Result"]["rating"] == "green"
    nothing = fake({"raw": 0.5, "lsc": 0.02}, scored_by="control")["statements"]
    assert [row["rating"] for row in nothing[:2]] == ["amber", "amber"]


@pytest.mark.parametrize(
    ("details", "key", "values"),
    [
        ({"ties": 375, "untied": None}, "method with ties", {"count": 375}),
        (
            {"ties": 0, "untied": "One pass."},
            "method without ties",
            {"other": "lsc", "why": "One pass."},
        ),
        ({"ties": 0, "untied": None}, "method without ties", {"other": "lsc", "why": None}),
    ],
)
def test_what_other_methods_leave_out_is_stated(details, key, values):
    "Number of ties that correct used, or the reason for none; nothing without that method"
    document = fake({"raw": 0.5, "lsc": 0.03, "correct": 0.02})
    document["methods"][-1]["details"] = details
    (said,) = said_of(document, "Ties")
    assert (said.key, said.values) == (key, {"name": "correct", **values})
    assert said_of(fake({"raw": 0.5, "lsc": 0.03}), "Ties") == []


def test_a_warning_of_two_methods_stands_once():
    "With both names before it; another one by itself"
    rows = fake({"raw": 0.5, "lsc": 0.03, "correct": 0.02})["methods"]
    rows[1]["warnings"] = ["T1 was refused."]
    rows[2]["warnings"] = ["T1 was refused.", "Ties disagree."]
    assert method_warnings(rows) == ["lsc and correct: T1 was refused.", "correct: Ties disagree."]


def test_each_method_stands_at_its_rmse():
    "A mark for each method on each axis, the best at the top, to 1e-12 m"
    panels = comparison_figure(fake({"raw": 0.5, "lsc": 0.02})).axes
    for panel in panels:
        marks = [line for line in panel.lines if line.get_marker() in "ox"]
        places = {float(line.get_ydata()[0]): line.get_xdata()[0] for line in marks}
        np.testing.assert_allclose([places[0.0], places[1.0]], np.array([0.02, 0.5]) / np.sqrt(3))
