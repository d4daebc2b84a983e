"""The page of a calibration, made of a document."""

from dataclasses import replace

import pytest

from mlscorr.evaluate import SEEN_BY_OTHERS, TargetRow
from mlscorr.report import calibration_page, calibration_screen, scanners_screen
from mlscorr.report._calibration_page import component_rows
from tests.beds.reports import drive, fabricate, score_of, words

MOUNTING = {"lever_arm": [0.1, -0.6, 0.4], "boresight": [90.0, 0.0, 35.0]}
RANGES = {"correction": 0.012, "sigma": 0.001, "determined": True, "significant": False}
SCANNER = {"range_offset": RANGES, "encoder_scale": RANGES | {"correction": 1e-4, "sigma": 2e-4}}
PARAMETERS = {"position_scale": 1.0, "position_time": 30.0}


def calibrated(determined=True, worse=False, significant=False, unseen=()):
    "Content of calibration.json of a scanner whose lever arm lacks 9 cm to the left, and its rows"
    rows = [*fabricate(drive())[2].targets, *unseen]
    scores = {role: score_of([r for r in rows if r.group == role]) for role in ("control", "check")}
    if worse:
        scores = {role: replace(s, before=s.after, after=s.before) for role, s in scores.items()}
    method = {role: score.document() for role, score in scores.items()}
    method |= {
        "lever_arm": {"correction": [-0.091, 0.001, 0.002], "sigma": [0.003, 0.003, 0.005]},
        "boresight": {"correction": [0.001, 0.3, 0.0], "sigma": [0.01, 0.01, 0.01]},
        "correlation": [[1.0 if i == j else 0.25 for i in range(6)] for j in range(6)],
    }
    content = {
        "mounting": {"recorded": MOUNTING, "calibrated": MOUNTING},
        "lsc": method,
        "ls": method,
        "determined": [True, True, determined, True, True, True],
        "scanner_errors": SCANNER | {"range_offset": RANGES | {"significant": significant}},
        "parameters": PARAMETERS,
        "targets": [row.document() for row in rows],
        "ties": None,
        "warnings": [],
        "notes": ["Coordinates are in EPSG:32650."],
    }
    return content | calibration_screen(content, rows)


def test_the_page_says_first_what_the_mounting_lacks_and_what_the_site_does_not_tell():
    "Only what exceeds its sigma threefold is named, with sigma, in one unit each"
    content = calibrated(determined=False)
    text = words(calibration_page({"name": "site", **content}).html())
    lacks = "lacks lever arm right -91 ± 3.0 mm, boresight about forward 0.300 ± 0.010 deg."
    assert lacks in text
    assert "5 of 6 parts by this geometry. Not determined, and changed only as far as the" in text
    assert "tells it from what looks the same: lever arm up 2.0 ± 5.0 mm." in text
    assert content["rating"] == "amber"
    assert text.index(lacks) < text.index("How far the cloud is")
    assert all(row["sentence"] in text for row in content["statements"])


@pytest.mark.parametrize(
    ("determined", "lack", "rating", "sentence"),
    [
        (5, 0.424, "amber", "mounting lacks lever arm up 424 ± 41 mm (not determined)."),
        (
            5,
            0.024,
            "green",
            "holds in the parts that are determined: it lacks nothing beyond 3 sigmas.",
        ),
        (6, 0.024, "green", "mounting holds: it lacks nothing beyond 3 sigmas."),
        (0, 0.024, "amber", "This geometry does not tell whether the recorded mounting holds."),
    ],
)
def test_a_mounting_holds_where_nothing_else_is_seen(determined, lack, rating, sentence):
    "Ten sigmas of an undetermined part are named as such; where no part is told, none is cleared"
    content = calibrated()
    zero = {"correction": [0.0, 0.0, 0.0], "sigma": [0.01, 0.01, 0.041]}
    arm = zero | {"correction": [0.0, 0.0, lack]}
    content["lsc"] = content["lsc"] | {"lever_arm": arm, "boresight": zero}
    content["determined"] = [bool(determined)] * 2 + [determined == 6] + [bool(determined)] * 3
    mounting = calibration_screen(content, [])["statements"][0]
    assert mounting["rating"] == rating
    assert mounting["sentence"].endswith(sentence)


def test_the_page_says_next_what_fits_its_clouds():
    "Clouds that are as the recorded mounting put them are written anew before they are corrected"
    content = {"name": "site", **calibrated()}
    still = words(calibration_page(content | {"files": []}).html())
    assert "still as the recorded mounting put them. Next: run mlscorr calibrate --clouds" in still
    done = words(calibration_page(content | {"files": [{"name": "pass-1.laz"}]}).html())
    assert "Next: run mlscorr correct with the survey.toml beside this page." in done


def test_least_squares_without_control_has_no_result():
    "It takes nothing but control: a dash, not the nought ± 5 deg of its prior, and no row of RMSE"
    content = calibrated()
    content["ls"] = content["ls"] | {"control": content["ls"]["control"] | {"n": 0}}
    assert all(row["ls"] is row["ls_sigma"] is None for row in component_rows(content))
    text = words(calibration_page({"name": "site", **content}).html())
    assert "Check points, LSC" in text
    assert "Check points, LS " not in text


def test_points_that_another_scanner_alone_saw_are_called_so():
    "Not that nothing was scanned about them: two scanners look at two sides of a street"
    rows = fabricate(drive())[2].targets
    unseen = [
        TargetRow.unobserved(name, None, role, rows[0].surveyed, SEEN_BY_OTHERS, False)
        for name, role in (("T90", "control"), ("T91", "control"), ("C90", "check"))
    ]
    said = {row["what"]: row for row in calibrated(unseen=unseen)["statements"]}
    assert "2 where only another scanner saw the target" in said["Control points"]["sentence"]
    assert "1 stands where only another scanner saw the target." in said["Check points"]["sentence"]
    assert {"name": "T90", "text": SEEN_BY_OTHERS} in said["Control points"]["items"]
    assert "nothing was scanned" not in said["Control points"]["sentence"]


def test_a_calibration_that_makes_check_points_worse_is_red():
    "A surveyor must not go on with it unwarned"
    assert calibrated(worse=True)["rating"] == "red"


def test_check_points_that_chance_or_the_scanner_makes_worse_are_amber():
    "A mounting without a significant change does no harm; what ranges lack is not the mounting's"
    content = calibrated(worse=True)
    none = {"correction": [0.0] * 3, "sigma": [0.01] * 3}
    right = content["lsc"] | {"lever_arm": none, "boresight": none}
    screens = [
        calibration_screen(content | {"lsc": right}, []),
        calibrated(worse=True, significant=True),
    ]
    ends = "No part changed significantly.", "and keep what the scanner itself lacks."
    for screen, end in zip(screens, ends, strict=True):
        (result,) = (row for row in screen["statements"] if row["what"] == "Result")
        assert result["rating"] == "amber"
        assert result["sentence"].endswith(end)


def test_a_scanner_that_is_off_is_amber():
    "Ranges that lack 12 mm, and an encoder that lacks nothing, are said with their sigmas"
    sentence = "Ranges lack 12 ± 1.0 mm, scan angles 0.10 ± 0.20 mrad per rad"
    for significant, rating, end in (
        (False, "green", ": nothing significant."),
        (True, "amber", "; the mounting is free of it."),
    ):
        rows = calibrated(significant=significant)["statements"]
        (row,) = (row for row in rows if row["what"] == "Scanner")
        assert (row["rating"], row["sentence"]) == (rating, sentence + end)


def test_a_scanner_error_that_is_not_determined_is_called_so():
    "Significant, but with a sigma that no site should leave"
    off = RANGES | {"significant": True, "determined": False}
    content = calibrated() | {"scanner_errors": SCANNER | {"range_offset": off}}
    (row,) = (r for r in calibration_screen(content, [])["statements"] if r["what"] == "Scanner")
    assert row["sentence"].startswith("Ranges lack 12 ± 1.0 mm (not determined), scan angles 0.10")


def test_what_the_drift_explains_between_passes_is_said_apart():
    "1.6 cm by the mounting that is written; 2 mm where the drift is written, too"
    away = {state: {"median": size} for state, size in (("before", 0.015), ("after", 0.016))}
    ties = {"n": 90, "used": 80, "pairs": [], **away}
    content = calibrated() | {"ties": ties}
    sentences = []
    for more in ({}, {"with_drift": {"ties": {"after": {"median": 0.002}}}}):
        rows = calibration_screen(content | more, [])["statements"]
        sentences += [row["sentence"] for row in rows if row["what"] == "Two passes"]
    assert sentences[0].endswith("are used: 1.5 cm apart before, 1.6 cm after (median).")
    assert sentences[1] == sentences[0][:-1] + ", 2 mm without the drift."


def calibrated_together(fit=0.0018):
    "Content of calibration.json of a left and a right scanner, which fit each other to as much (m)"
    misfit = {"median": 0.02, "rms": 0.03}
    pair = {"passes": [1, 2], "scanners": [1, 2], "n": 90, "used": 80, "before": misfit}
    ties = {
        "n": 90,
        "used": 80,
        "before": misfit,
        "after": misfit,
        "pairs": [pair | {"after": misfit}],
    }
    sigma = {"lever_arm": [0.0003, 0.0013, 0.0004], "boresight": [0.016, 0.008, 0.033]}
    parts = {name: {"correction": [0.0, 0.0, 0.0], "sigma": sigma[name]} for name in sigma}
    content = {
        "scanners": {"left": calibrated() | {"ties": ties}, "right": calibrated() | {"ties": ties}},
        "relative": {"right": {"beside": "left", **parts, "fit_sigma": fit}},
        "ties": ties,
        "warnings": [],
    }
    return content | scanners_screen(content)


def test_each_scanner_has_its_part():
    "Two scanners: their screens, rows of tables under their names, and first what they share"
    html = calibration_page({"name": "site", **calibrated_together()}).html()
    assert html.count('class="verdict') == 3
    text = words(html)
    assert text.count("Scanner left") == 6
    assert "1 and 2, scanners left and right" in text
    assert text.index("right beside left") > text.index("Scanner right beside scanner left")


def test_how_well_scanners_fit_each_other_comes_first():
    "Double walls in mm, then sigmas; amber where nothing that both saw holds them, or not to 2 cm"
    content = calibrated_together()
    sentence = (
        "Scanners left and right put a wall that both saw in one place to 1.8 mm. Scanner right "
        "beside scanner left: lever arm to 0.3/1.3/0.4 mm right/forward/up, boresight to "
        "0.016/0.008/0.033 deg about them (one sigma)."
    )
    assert content["statements"][0]["sentence"] == sentence
    assert [content["rating"], calibrated_together(0.03)["rating"]] == ["green", "amber"]
    lonely = calibrated_together(None)["statements"][0]
    assert lonely["rating"] == "amber"
    assert lonely["sentence"].startswith("No wall that scanners left and right both saw holds them")
