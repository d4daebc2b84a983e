"""The page of a calibration, made of a document."""

from dataclasses import replace

import pytest

from mlscorr.evaluate import SEEN_BY_OTHERS, TargetRow, reason_in_words
from mlscorr.report import calibration_page, calibration_screen, scanners_screen
from mlscorr.report._calibration_page import (
    calibration_statements,
    component_rows,
    scanners_statements,
)
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


def said(rows, what):
    "Statements of the rows on something"
    return [statement for row in rows if row.what == what for statement in row.statements]


def test_the_page_says_first_what_the_mounting_lacks_and_what_the_site_does_not_tell():
    "Only what exceeds its sigma threefold is named; each sentence stands before the tables"
    content = calibrated(determined=False)
    rows = calibration_statements(content, [])
    (lacks,) = said(rows, "Mounting")
    names = [row["name"] for row in lacks.values["components"]]
    assert names == ["lever arm right", "boresight about forward"]
    (undetermined,) = said(rows, "Determined")
    assert [row["name"] for row in undetermined.values["components"]] == ["lever arm up"]
    assert content["rating"] == "amber"
    text = words(calibration_page({"name": "site", **content}).html())
    first = text[: text.index("Misclosures at the surveyed targets")]
    assert all(row["sentence"] in first for row in content["statements"])


@pytest.mark.parametrize(
    ("determined", "lack", "severity", "key"),
    [
        (5, 0.424, "warning", "mounting lacks"),
        (5, 0.024, "note", "determined parts hold"),
        (6, 0.024, "note", "mounting holds"),
        (0, 0.024, "warning", "mounting not told"),
    ],
)
def test_a_mounting_holds_where_nothing_else_is_seen(determined, lack, severity, key):
    "Ten sigmas of an undetermined part are named as such; where no part is told, none is cleared"
    content = calibrated()
    zero = {"correction": [0.0, 0.0, 0.0], "sigma": [0.01, 0.01, 0.041]}
    arm = zero | {"correction": [0.0, 0.0, lack]}
    content["lsc"] = content["lsc"] | {"lever_arm": arm, "boresight": zero}
    content["determined"] = [bool(determined)] * 2 + [determined == 6] + [bool(determined)] * 3
    (mounting,) = said(calibration_statements(content, []), "Mounting")
    assert (mounting.key, mounting.severity) == (key, severity)


def test_the_page_says_next_what_fits_its_clouds():
    "Clouds that are as the recorded mounting put them are written anew before they are corrected"
    content = {"name": "site", **calibrated()}
    still = words(calibration_page(content | {"files": []}).html())
    assert "still use the recorded mounting. Next: run mlscorr calibrate --clouds" in still
    done = words(calibration_page(content | {"files": [{"name": "pass-1.laz"}]}).html())
    assert "Next: run mlscorr correct with the survey.toml next to this page." in done


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
    screen = calibration_statements(calibrated(), [*rows, *unseen])
    (control,) = said(screen, "Control points")
    assert control.values["elsewhere"] == {True: 2}
    assert said(screen, "Check points")[-1].values == {"count": 1, "by_others": True}
    (row,) = (row for row in screen if row.what == "Control points")
    assert ("T90", reason_in_words(SEEN_BY_OTHERS)) in row.items


def test_a_calibration_that_makes_check_points_worse_is_red():
    "A surveyor must not go on with it unwarned"
    assert calibrated(worse=True)["rating"] == "red"


def test_check_points_that_chance_or_the_scanner_makes_worse_are_amber():
    "A mounting without a significant change does no harm; what ranges lack is not the mounting's"
    content = calibrated(worse=True)
    none = {"correction": [0.0] * 3, "sigma": [0.01] * 3}
    right = content["lsc"] | {"lever_arm": none, "boresight": none}
    by_chance = content | {"lsc": right}
    by_scanner = calibrated(worse=True, significant=True)
    for each, key in ((by_chance, "worse by chance"), (by_scanner, "worse by the scanner")):
        (result,) = said(calibration_statements(each, []), "Result")
        assert (result.key, result.severity) == (key, "warning")


@pytest.mark.parametrize(
    ("significant", "key", "severity"),
    [(False, "scanner is right", "note"), (True, "scanner is off", "warning")],
)
def test_a_scanner_that_is_off_is_a_warning(significant, key, severity):
    "Ranges that lack 12 mm, beyond their sigma or not, and an encoder that lacks nothing"
    content = calibrated(significant=significant)
    (scanner,) = said(calibration_statements(content, []), "Scanner")
    assert (scanner.key, scanner.severity) == (key, severity)
    assert scanner.values == content["scanner_errors"]


def test_what_the_drift_explains_between_passes_is_said_apart():
    "1.6 cm by the mounting that is written; 2 mm where the drift is written, too"
    away = {state: {"median": size} for state, size in (("before", 0.015), ("after", 0.016))}
    ties = {"n": 90, "used": 80, "pairs": [], **away}
    content = calibrated() | {"ties": ties}
    drift = {"with_drift": {"ties": {"after": {"median": 0.002}}}}
    for more, without_drift in (({}, None), (drift, 0.002)):
        (passes,) = said(calibration_statements(content | more, []), "Tie features")
        assert passes.values == {
            "used": 80,
            "n": 90,
            "is_between_scanners": False,
            "before": 0.015,
            "after": 0.016,
            "without_drift": without_drift,
        }


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
    assert text.index("right relative to left") > text.index(
        "scanner right relative to scanner left"
    )


def test_how_well_scanners_fit_each_other_comes_first():
    "Double walls in mm, then sigmas; amber where nothing that both saw holds them, or not to 2 cm"
    for fit, severity in ((0.0018, "note"), (0.03, "warning"), (None, "warning")):
        content = calibrated_together(fit)
        row = scanners_statements(content)[0]
        (fact,) = row.statements
        assert (row.what, fact.key, fact.severity) == ("Together", "scanners together", severity)
        assert (fact.values["first"], fact.values["name"]) == ("left", "right")
        assert fact.values["fit"] == fit
        assert fact.values["lever_arm"] == content["relative"]["right"]["lever_arm"]["sigma"]
