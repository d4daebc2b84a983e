"""The report: one page a surveyor can read offline, and its figures as files."""

import re
import time
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.evaluation import statistics
from mlscorr.georeference import Correction
from mlscorr.report import tables, write_pictures, write_report
from mlscorr.report.look import break_at_gaps, label, thin
from mlscorr.report.plan import map_figure
from mlscorr.report.timeline import attitude_change, correction_figure
from mlscorr.survey import CloudFile, ControlPoints, Survey, Trajectory, attitude_from_angles

START = 357881.0  # s, GPS week seconds
SPEED = 6.0  # m/s


def drive(seconds=60.0, rate=50.0, gap=None):
    "A drive on a wide curve at UTM size; gap = (start, end) in s after the start"
    since = np.arange(0.0, seconds, 1 / rate)
    if gap is not None:
        since = since[(since <= gap[0]) | (since >= gap[1])]
    turn = 2 * np.pi * since / 400.0
    radius = SPEED * 400.0 / (2 * np.pi)
    position = np.column_stack(
        [
            532000.0 + radius * np.sin(turn),
            3374000.0 + radius * (1 - np.cos(turn)),
            42.0 + 0.5 * np.sin(turn * 5),
        ]
    )
    attitude = attitude_from_angles(0.01 * np.sin(since), 0.0 * since, np.pi / 2 - turn)
    return Trajectory(START + since, position, attitude)


def corrected(trajectory, sigma=True):
    "A drift of decimetres removed, with its sigma after the estimate"
    since = (trajectory.gps_time - START)[:, None]
    shift = [0.7, 0.2, 0.25] * np.sin(since / [25.0, 40.0, 60.0])
    small = Rotation.from_rotvec(np.radians([0.004, 0.003, 0.012] * np.sin(since / 50.0)))
    ones = np.ones((len(trajectory), 3))
    return Trajectory(
        trajectory.gps_time,
        trajectory.position + shift,
        small * trajectory.attitude,
        0.02 * ones * (1 + np.abs(np.sin(since / 10.0))) if sigma else None,
        np.radians(0.004) * ones if sigma else None,
    )


def fabricate(trajectory, count=8, checks=True, sigma=True, rng=None, names=None):
    "A survey, its correction and a report.json, with made-up residuals"
    rng = rng or np.random.default_rng(1)
    new = corrected(trajectory, sigma)
    correction = Correction(trajectory, new)
    epochs = np.linspace(0.06, 0.94, count) * len(trajectory)
    rows = []
    for i, epoch in enumerate(epochs.astype(int)):
        role = "check" if checks and i % 3 == 2 else "control"
        after = rng.normal(0, 0.03 if role == "check" else 0.004, 3)
        before = new.position[epoch] - trajectory.position[epoch] + after
        right = trajectory.attitude[epoch].apply([12.0, 0.0, 1.5])
        surveyed = trajectory.position[epoch] + right + before
        rows.append(
            {
                "name": names[i] if names else f"T{i + 1:02d}",
                "pass": 1 + int(trajectory.segment(trajectory.gps_time[epoch])),
                "gps_time": float(trajectory.gps_time[epoch]),
                "role": role,
                "surveyed": surveyed.tolist(),
                "observed": (surveyed - before).tolist(),
                "sigma": [0.004, 0.004, 0.005],
                "before": before.tolist(),
                "after": after.tolist(),
                "left_out": [0.06, 0.04, 0.038] if role == "control" else None,
                "used": role == "control",
                "reason": None if role == "control" else "check point",
            }
        )
    return survey_of(trajectory, rows), correction, document_of(trajectory, rows)


def survey_of(trajectory, rows):
    empty = ControlPoints((), np.empty((0, 3)), np.empty((0, 3)), (), np.empty(0), np.empty((0, 3)))
    return Survey(
        name="street",
        path=Path("survey.toml"),
        crs="EPSG:32650",
        clouds=(CloudFile(Path("pass-1.laz"), 1_234_567, 0.0, "GPS week seconds"),),
        trajectory=trajectory,
        mounting=None,
        control=empty,
        check=empty,
        notes=("Meridian convergence -0.42 deg was applied.",),
    )


def document_of(trajectory, rows):
    document = {"schema": "mlscorr.report/1", "targets": rows}
    for role in ("control", "check"):
        mine = [row for row in rows if tables.group(row) == role]
        before, after = (tables.array(mine, key) for key in ("before", "after"))
        document[role] = {
            "n": len(mine),
            "before": statistics(before),
            "after": statistics(after),
        }
    control = [row["gps_time"] for row in rows if row["role"] == "control"]
    several = len(control) > 1
    document["control"]["leave_one_out"] = {"rmse": [0.061, 0.044, 0.038] if several else None}
    document["model"] = {
        "method": "lsc",
        "order": 1,
        "covariance": {"family": "matern32", "correlation_time": 28.4, "scale": 1.3},
        "estimated_by": "marginal likelihood of the control points",
        "sigma0": 1.08 if several else None,
        "outliers": [{"name": "T99", "statistic": 9.31, "critical": 3.29}] if several else [],
        "alternatives": [
            {"family": "matern32", "correlation_time": 28.4, "log_likelihood": 81.25},
            {"family": "exponential", "correlation_time": 61.0, "log_likelihood": 74.5},
        ],
        "warnings": [],
    }
    document["coverage"] = {
        "control_span": [min(control), max(control)] if several else None,
        "longest_gap_s": float(np.ptp(trajectory.gaps)) if len(trajectory.gaps) else 0.0,
        "points_outside_trajectory": 0,
        "points_outside_control": 40_000,
    }
    document["files"] = [{"name": "pass-1.laz", "points": 1_234_567, "sha256": "ab12" * 16}]
    return document


def page(folder, survey, correction, document):
    write_report(folder / "report.html", survey, correction, document)
    return (folder / "report.html").read_text(encoding="utf-8")


def words(html):
    "The page's text without its style and scripts, one space between words"
    html = re.sub(r"<(style|script)\b.*?</\1>", "", html, flags=re.S)
    return " ".join(re.sub(r"<[^>]*>", " ", html).split())


class Links(HTMLParser):
    def __init__(self, html):
        super().__init__()
        self.tags, self.links = set(), []
        self.feed(html)

    def handle_starttag(self, tag, attributes):
        self.tags.add(tag)
        self.links += [v for k, v in attributes if k in ("src", "href", "srcset", "data", "action")]


def test_the_page_needs_nothing_but_itself(tmp_path):
    "Every picture lies in the file, no link leaves it, and the page forbids itself to load more"
    html = page(tmp_path, *fabricate(drive()))
    links = Links(html)
    inside = [link for link in links.links if link.startswith("#")]
    assert len(links.links) - len(inside) == 4 and inside
    assert all(link.startswith("data:image/svg+xml;base64,") or link in inside
               for link in links.links)  # fmt: skip
    assert all(f'id="{link[1:]}"' in html for link in inside)
    assert not links.tags & {"link", "iframe", "object"}
    assert "@import" not in html and "url(" not in html and "http" not in words(html)
    assert "default-src 'none'; img-src data:;" in html
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]


def test_every_target_stands_in_the_table_with_its_numbers(tmp_path):
    "Nothing of targets[] is lost on the way to the reader"
    survey, correction, document = fabricate(drive())
    text = words(page(tmp_path, survey, correction, document))
    for row in document["targets"]:
        start = f"{row['name']} {row['pass']} {row['gps_time']:.3f} {row['role']} "
        before = " ".join(tables.number(v, 4) for v in row["before"])
        after = " ".join(tables.number(v, 4) for v in row["after"])
        assert start + before in text
        assert after + " " + tables.number(tables.norm(row["after"], 2), 4) in text


def test_the_report_tells_what_report_json_tells(tmp_path):
    "RMSE, model, outliers, coverage, files, conventions and versions all reach the page"
    survey, correction, document = fabricate(drive())
    text = words(page(tmp_path, survey, correction, document))
    for role in ("control", "check"):
        for when in ("before", "after"):
            assert " ".join(f"{v:.4f}" for v in document[role][when]["rmse"]) in text
    expected = [
        "0.0610 0.0440 0.0380",
        "0.0752 0.0843",
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
    survey, correction, document = fabricate(drive(), 1, names=[name])
    document["model"]["warnings"] = ["<b>mind</b>"]
    survey = replace(survey, name="</title><script>alert(2)</script>")
    html = page(tmp_path, survey, correction, document)
    links = Links(html)
    assert "b" not in links.tags and "x" not in links.links
    assert "<script>alert" not in html
    assert "&lt;img src=x onerror=&#34;alert(1)&#34;&gt;&amp;$_{" in html
    assert "&lt;b&gt;mind&lt;/b&gt;" in html


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, r"Check points: RMSE [\d./]+ m before, [\d./]+ m after \(E/N/H\), 2 points that took"),
        ({"checks": False}, r"no check points\. Control points, each left out in turn .* 8 points"),
        ({"sigma": False}, "Check points: RMSE"),
        ({"count": 1}, r"no independent check: every target used \(1 point\) made the correction"),
        ({"count": 0}, "No target was found"),
    ],
)
def test_says_plainly_what_the_verdict_rests_on(changes, expected, tmp_path):
    "With or without check points, sigmas or targets there is a page, and it does not overstate"
    html = page(tmp_path, *fabricate(drive(), **changes))
    assert re.search(expected, words(html))
    assert ("its 1 sigma after the estimate" in html) == changes.get("sigma", True)


def test_the_verdict_gives_centimetres_where_they_tell_enough():
    "The sentence as the surveyor would say it"
    document = fabricate(drive())[2]
    document["check"]["before"]["rmse"] = [0.7081, 0.2043, 0.2398]
    document["check"]["after"]["rmse"] = [0.0602, 0.0401, 0.0353]
    assert tables.verdict(document) == (
        [
            "The correction brought the cloud from 77.5 cm to 8.0 cm off the surveyed places "
            "(10 times closer), as independent check points tell.",
            "Check points: RMSE 0.71/0.20/0.24 m before, 0.06/0.04/0.04 m after (E/N/H), "
            "2 points that took no part in the estimate.",
        ],
        False,
    )


@pytest.mark.parametrize(("rise", "worse"), [(0.0015, False), (0.012, True)])
def test_says_so_when_the_correction_made_it_worse(rise, worse, tmp_path):
    "More than 2 mm on one axis is a fact for the first paragraph"
    survey, correction, document = fabricate(drive())
    summary = document["check"]
    summary["after"]["rmse"][2] = summary["before"]["rmse"][2] + rise
    html = page(tmp_path, survey, correction, document)
    assert ("worse than before: H by 0.012 m" in words(html)) == worse
    assert ('class="verdict worse"' in html) == worse


def test_warnings_come_before_the_tables(tmp_path):
    "A doubt is read before the numbers that it concerns; without one there is no empty box"
    survey, correction, document = fabricate(drive())
    assert 'id="warnings"' not in page(tmp_path, survey, correction, document)
    document["model"]["warnings"] = ["Signal extrapolated 214 s past the last control point."]
    html = page(tmp_path, survey, correction, document)
    assert html.index("Signal extrapolated 214 s") < html.index('id="statistics"')


def test_a_target_that_was_not_seen_is_listed_with_its_reason(tmp_path):
    "Control first, then check, then unused, and missing numbers are dashes"
    survey, correction, document = fabricate(drive())
    blank = {"pass": None, "gps_time": None, "observed": None, "before": None, "after": None}
    lost = document["targets"][0] | blank
    lost |= {"name": "LOST", "used": False, "sigma": None, "reason": "no returns within 0.5 m"}
    document["targets"].insert(0, lost)
    text = words(page(tmp_path, survey, correction, document))
    table = text[text.index("Sigma is 1 sigma") :]
    assert "LOST – – control – – –" in table and "no returns within 0.5 m" in table
    order = [table.index(head) for head in ("Control points", "T01", "T03", "Not used", "LOST")]
    assert order == sorted(order)


def test_a_gap_breaks_the_curves_and_is_shaded(tmp_path):
    "No line suggests knowledge where the trajectory has none"
    trajectory = drive(gap=(20.0, 31.0))
    survey, correction, document = fabricate(trajectory)
    assert "Gaps of the trajectory" in words(page(tmp_path, survey, correction, document))
    figure = correction_figure(survey, correction, document)
    curve = max(figure.axes[0].lines, key=lambda line: len(line.get_xdata()))
    (at,) = np.flatnonzero(np.isnan(curve.get_ydata()))
    np.testing.assert_allclose(curve.get_xdata()[[at - 1, at + 1]], [20.0, 31.0], atol=0.03)
    assert "Gap of the trajectory" in [text.get_text() for text in figure.legends[0].texts]


def test_thinning_keeps_every_peak_and_every_edge():
    "A spike of one epoch in a long drive stays visible in at most 3000 epochs"
    gps_time = START + np.append(np.arange(30_000), np.arange(30_000) + 40_000) * 0.02
    values = np.sin(np.arange(60_000) / 5_000)[:, None]
    values[[12_345, 54_321]] = [[5.0], [-5.0]]
    gaps = np.array([[gps_time[29_999], gps_time[30_000]]])
    rows = thin(values, gps_time, gaps)
    assert len(rows) <= 3002
    assert {0, 12_345, 29_999, 30_000, 54_321, 59_999} <= set(rows.tolist())
    at, line = break_at_gaps(gps_time[rows], gaps, values[rows, 0])
    assert np.isnan(line).sum() == 1 and (np.diff(at) > 0).all()


def test_the_attitude_panel_shows_the_smaller_turn_through_north():
    "From 359.999 to 0.001 deg is 0.002 deg, not a whole turn"
    trajectory = drive(1.0)
    old, new = (
        replace(trajectory, attitude=attitude_from_angles(0.0, 0.0, np.full(50, np.radians(a))))
        for a in (359.999, 0.001)
    )
    np.testing.assert_allclose(
        attitude_change(Correction(old, new)), [[0, 0, 0.002]] * 50, atol=1e-9
    )


def test_an_outlier_does_not_squash_the_curve():
    "A rejected misclosure of 80 m is marked at the panel's edge; the axis stays in decimetres"
    survey, correction, document = fabricate(drive())
    document["targets"][1] |= {"used": False, "reason": "outlier", "before": [80.0, -80.0, 0.1]}
    figure = correction_figure(survey, correction, document)
    assert all(np.ptp(panel.get_ylim()) < 3.0 for panel in figure.axes)
    assert any("Not used" in text.get_text() for text in figure.legends[0].texts)


def test_the_map_has_equal_scales_and_states_its_arrows():
    "A metre east is as long as a metre north, and the arrow key names length and enlargement"
    figure = map_figure(*fabricate(drive()))
    (axes,) = figure.axes
    assert axes.get_aspect() == 1.0
    texts = [text.get_text() for text in axes.texts]
    assert {"N", "T01", "T08"} <= set(texts)
    assert any(
        re.fullmatch(r"Residual of [\d.]+ m \(arrows enlarged \d+ times\)", t) for t in texts
    )


def test_names_on_the_map_do_not_cover_one_another():
    "Of 300 targets side by side some names are left out; the outermost stay readable"
    figure = map_figure(*fabricate(drive(), 300))
    figure.draw_without_rendering()
    names = [text for text in figure.axes[0].texts if text.get_text().startswith("T")]
    boxes = [text.get_window_extent() for text in names]
    assert 10 < len(names) < 300
    assert not any(a.overlaps(b) for i, a in enumerate(boxes) for b in boxes[:i])


def test_a_correction_of_zero_still_has_a_page(tmp_path):
    "Limits of axes and scales hold when there is nothing to show"
    survey, correction, document = fabricate(drive(), 2, checks=False, sigma=False)
    for row in document["targets"]:
        row |= {"before": [0.0] * 3, "after": [0.0] * 3, "sigma": None}
    page(tmp_path, survey, Correction(correction.recorded, correction.recorded), document)


def test_names_the_font_cannot_draw_become_question_marks():
    "A Chinese point name costs its glyphs in the figure, not the report"
    assert label("点7$\n<b>") == "?7$ <b>"
    assert label(None) == "no name"
    assert len(label("x" * 99)) == 14


def test_multiple_passes_are_counted_as_observations_of_points():
    "Eight observations of four points are not eight points"
    document = fabricate(drive(), 8, checks=False, names=["A", "B", "C", "D"] * 2)[2]
    assert tables.count(document, "control") == "8 observations of 4 points"


def test_pictures_are_written_as_png(tmp_path):
    "The same figures for another document"
    paths = write_pictures(tmp_path, *fabricate(drive()))
    assert [path.name for path in paths] == ["correction.png", "map.png", "residuals.png"]
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in paths)


def test_a_long_drive_makes_a_small_page_quickly(tmp_path):
    "24 targets on 250 s at 50 Hz: under 3 MB and a few seconds"
    parts = fabricate(drive(250.0), 24)
    start = time.perf_counter()
    html = page(tmp_path, *parts)
    assert time.perf_counter() - start < 15.0  # about 2 s; the rest is for a busy machine
    assert len(html.encode()) < 3e6
