"""The report: one page a surveyor can read offline."""

import re
from dataclasses import replace

import numpy as np
import pytest

from mlscorr.correction import Correction
from mlscorr.evaluate import TargetRow
from mlscorr.report import tables
from mlscorr.report.correction_page import write_report
from mlscorr.wording import millimetres, number
from tests.beds.reports import Links, because, drive, fabricate, page, report_of, words
from tests.beds.tied_reports import tied_report


def test_the_page_needs_nothing_but_itself(tmp_path):
    "Every picture lies in the file, no link leaves it, and the page forbids itself to load more"
    html = page(tmp_path, *fabricate(drive()))
    links = Links(html)
    inside = [link for link in links.links if link.startswith("#")]
    assert len(links.links) - len(inside) == 5 and inside
    assert all(
        link.startswith("data:image/svg+xml;base64,") or link in inside for link in links.links
    )
    assert all(f'id="{link[1:]}"' in html for link in inside)
    assert not links.tags & {"link", "iframe", "object"}
    assert "@import" not in html and "url(" not in html and "http" not in words(html)
    assert "default-src 'none'; img-src data:;" in html
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]


@pytest.mark.long
def test_every_target_stands_in_the_table_with_its_numbers(tmp_path):
    "Nothing of targets[] is lost on the way to the reader"
    survey, correction, report = fabricate(drive())
    text = words(page(tmp_path, survey, correction, report))
    for row in report.targets:
        start = f"{row.name} {row.pass_number} {row.gps_time:.3f} {row.role} "
        before = " ".join(number(v, 3) for v in row.before)
        after = " ".join(number(v, 3) for v in row.after)
        assert start + before in text
        assert after + " " + number(tables.norm(row.after, 2), 3) in text


def test_the_report_tells_what_report_json_tells(tmp_path):
    "RMSE, model, outliers, coverage, files, conventions and versions all reach the page"
    survey, correction, report = fabricate(drive())
    text = words(page(tmp_path, survey, correction, report))
    for score in (report.control, report.check):
        for statistics in (score.before, score.after):
            assert " ".join(number(v) for v in statistics.rmse) in text
    expected = [
        "0.061 0.044 0.038",
        "0.075 0.084",
        "matern32",
        "28.4",
        "1.08",
        "T99 9.31 3.29",
        "74.5",
    ]
    expected += ["ab12" * 16, "1 234 567", "EPSG:32650", survey.notes[0], "GPS week seconds"]
    expected += ["surveyed − observed", "40 000 (3.24 %)", "mlscorr 0.1.0", "UTC"]
    assert [piece for piece in expected if piece not in text] == []


def test_names_that_hold_html_are_shown_and_not_run(tmp_path):
    "A name from a file is text, whatever is in it"
    name = '<img src=x onerror="alert(1)">&$_{'
    survey, correction, report = fabricate(drive(), 1, names=[name])
    report.model["warnings"] = ["<b>mind</b>"]
    survey = replace(survey, name="</title><script>alert(2)</script>")
    html = page(tmp_path, survey, correction, report)
    links = Links(html)
    assert "b" not in links.tags and "x" not in links.links
    assert "<script>alert" not in html
    assert "&lt;img src=x onerror=&#34;alert(1)&#34;&gt;&amp;$_{" in html
    assert "&lt;b&gt;mind&lt;/b&gt;" in html


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, r"Check points, .*: RMSE [\d./]+ m before, [\d./]+ m after \(E/N/H\), 2 points\."),
        ({"checks": False}, r"no check points\. Control points, leave-one-out: .* 8 points"),
        ({"count": 1}, r"Fit to the points used for the correction: .*, 1 point\."),
        ({"count": 0}, "no point was surveyed"),
    ],
)
def test_says_plainly_what_the_verdict_rests_on(changes, expected, tmp_path):
    "With or without check points or targets there is a page, and it does not overstate"
    html = page(tmp_path, *fabricate(drive(), **changes))
    assert re.search(expected, words(html))
    assert "Line: correction added to the recorded position. Band: its 1 sigma." in html


@pytest.mark.parametrize(("rise", "worse"), [(0.0015, False), (0.012, True)])
def test_says_so_when_the_correction_made_it_worse(rise, worse, tmp_path):
    "More than 2 mm on one axis is a fact for the first paragraph"
    survey, correction, report = fabricate(drive())
    report.check.after.rmse[2] = report.check.before.rmse[2] + rise
    html = page(tmp_path, survey, correction, report)
    assert ("increased after the correction: H by 0.012 m" in words(html)) == worse
    assert ('class="verdict red"' in html) == worse


@pytest.mark.long
def test_warnings_come_before_the_tables(tmp_path):
    "A doubt is read before the numbers that it concerns; without one there is no empty box"
    survey, correction, report = fabricate(drive())
    assert 'id="warnings"' not in page(tmp_path, survey, correction, report)
    report.model["warnings"] = ["Signal extrapolated 214 s past the last control point."]
    html = page(tmp_path, survey, correction, report)
    assert html.index("Signal extrapolated 214 s") < html.index('id="statistics"')


@pytest.mark.long
def test_a_target_that_was_not_seen_is_listed_with_its_reason(tmp_path):
    "Control first, then check, then unused, and missing numbers are dashes"
    survey, correction, report = fabricate(drive())
    surveyed = report.targets[0].surveyed
    reason = "no returns within 0.5 m"
    report.targets.insert(
        0, TargetRow.unobserved("LOST", None, "control", surveyed, because(reason))
    )
    text = words(page(tmp_path, survey, correction, report))
    table = text[text.index("Sigma is 1 sigma") :]
    assert "LOST – – control – – –" in table and "no returns within 0.5 m" in table
    order = [table.index(head) for head in ("Control points", "T01", "T03", "Not used", "LOST")]
    assert order == sorted(order)


def test_a_correction_of_zero_still_has_a_page(tmp_path):
    "Limits of axes and scales hold when there is nothing to show"
    survey, correction, report = fabricate(drive(), 2, checks=False)
    still = np.zeros(3)
    unknown = np.full(3, np.nan)
    changes = {"before": still, "after": still, "sigma": unknown}
    report = report_of(drive(), [replace(row, **changes) for row in report.targets])
    nothing = replace(correction.corrected, position=correction.recorded.position)
    nothing = replace(nothing, attitude=correction.recorded.attitude)
    page(tmp_path, survey, Correction(correction.recorded, nothing), report)


def test_a_long_drive_makes_a_small_page(tmp_path):
    "24 targets on 250 s at 50 Hz: under 3 MB"
    html = page(tmp_path, *fabricate(drive(250.0), 24))
    assert len(html.encode()) < 3e6


@pytest.mark.long
def test_the_page_tells_what_two_passes_both_saw(tmp_path):
    "Sentence, map and a row of each two passes in millimetres; without ties there is no section"
    survey, correction, report, residuals = tied_report(wrong=0.1)
    path = tmp_path / "report.html"
    write_report(path, survey, correction, report, ties=residuals)
    html = path.read_text(encoding="utf-8")
    text, (pair,) = words(html), report.ties["pairs"]
    assert 'href="#ties"' in html and "Tie features" in text
    cells = [
        millimetres(pair[state][key]) for state in ("before", "after") for key in ("median", "rms")
    ]
    assert " ".join(["1 and 2", str(pair["n"]), str(pair["used"]), *cells]) in text
    assert "Gray crosses were rejected" in text
    nothing = {"n": 0, "used": 0, "reason": "Nothing was scanned twice."}
    text = words(page(tmp_path, survey, correction, replace(report, ties=nothing)))
    assert "Tie features" not in text
