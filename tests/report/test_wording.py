"""The catalogue of the sentences of reports, with values as a survey has them."""

import pytest

from mlscorr.report.wording import SENTENCES, assumed_in_words, interval_in_words
from mlscorr.survey import Statement

OFF = {"before": 0.775, "after": 0.08}
AXES = {"before": [0.7081, 0.2043, 0.2398], "after": [0.0602, 0.0401, 0.0353]}
RANGES = {"correction": 0.012, "sigma": 0.001, "determined": False, "significant": True}
ENCODER = {"correction": 1e-4, "sigma": 2e-4, "determined": True, "significant": False}
SIGMAS = {"lever_arm": [0.0003, 0.0013, 0.0004], "boresight": [0.016, 0.008, 0.033]}
PASSES = {"used": 80, "n": 90, "before": 0.015, "after": 0.016}
COMPONENTS = [
    {
        "name": "boresight about up",
        "lsc": 0.3,
        "lsc_sigma": 0.01,
        "unit": "deg",
        "determined": True,
    },
    {"name": "lever arm up", "lsc": 0.424, "lsc_sigma": 0.041, "unit": "m", "determined": False},
]

SIGMA_TEST = {
    "points": 8,
    "degrees_of_freedom": 24,
    "limits": (12.4, 39.36),
    "significance": 0.05,
    "factor": 1.0,
}
CATALOGUE = [
    (
        "nothing to judge by",
        {},
        "There is no surveyed point that could tell how good the correction is.",
    ),
    (
        "no target to judge by",
        {},
        "No target was found that could tell how good the correction is.",
    ),
    (
        "hardly changed",
        {"before": 0.011, "after": 0.012, "kind": "check"},
        "The correction changed next to nothing, as independent check points tell: from 1.1 cm "
        "to 1.2 cm off the surveyed places.",
    ),
    (
        "changed within sigma",
        {"before": 0.008, "after": 0.016, "kind": "leave-one-out"},
        "The correction changed less than these targets tell, as control points tell that were "
        "left out in turn: from 8 mm to 1.6 cm off the surveyed places.",
    ),
    (
        "made worse",
        {"before": 0.008, "after": 0.016, "kind": "check"},
        "The correction made the cloud worse, as independent check points tell: from 8 mm to "
        "1.6 cm off the surveyed places. Don't use it.",
    ),
    (
        "improved",
        {**OFF, "kind": "check", "times": 9.7, "holds_everywhere": True},
        "The correction brought the cloud from 77.5 cm to 8.0 cm off the surveyed places (10 "
        "times closer), as independent check points tell.",
    ),
    (
        "improved",
        {**OFF, "kind": "check", "times": 9.7, "holds_everywhere": False},
        "The correction brought the cloud from 77.5 cm to 8.0 cm off the surveyed places at the"
        " points that were seen, as independent check points tell.",
    ),
    (
        "improved",
        {**OFF, "kind": "leave-one-out", "times": 9.7, "holds_everywhere": False},
        "The correction brought the cloud from 77.5 cm to 8.0 cm off the surveyed places where "
        "control holds it, as control points tell that were left out in turn.",
    ),
    (
        "improved",
        {**OFF, "kind": "fit", "times": None, "holds_everywhere": True},
        "The correction brought the cloud from 77.5 cm to 8.0 cm off the surveyed places, but "
        "only at the points that it was made from: nothing independent can judge it.",
    ),
    (
        "rmse of check points",
        {**AXES, "points": 2, "observations": 2},
        "Check points: RMSE 0.71/0.20/0.24 m before, 0.06/0.04/0.04 m after (E/N/H), 2 points "
        "that took no part in the estimate.",
    ),
    (
        "rmse left out",
        {**AXES, "points": 4, "observations": 8, "has_checks": True},
        "No check point was seen. Control points, each left out in turn and predicted from the "
        "others: RMSE 0.71/0.20/0.24 m before, 0.06/0.04/0.04 m after (E/N/H), 8 observations "
        "of 4 points.",
    ),
    (
        "rmse left out",
        {**AXES, "points": 4, "observations": 8, "has_checks": False},
        "There are no check points. Control points, each left out in turn and predicted from "
        "the others: RMSE 0.71/0.20/0.24 m before, 0.06/0.04/0.04 m after (E/N/H), 8 "
        "observations of 4 points.",
    ),
    (
        "rmse of the fit",
        {
            "before": [0.7081, 0.2043, 0.2398],
            "after": [0.0012, 0.004, 0.004],
            "points": 1,
            "observations": 1,
        },
        "There is no independent check: every target used (1 point) made the correction. The "
        "fit, RMSE 0.7081/0.2043/0.2398 m before, 0.0012/0.0040/0.0040 m after (E/N/H), does "
        "not tell how good the correction is elsewhere.",
    ),
    (
        "worse axes",
        {"rises": {"E": 0.0082, "H": 0.012}, "points": 2, "observations": 2},
        "After the correction it is worse than before: E by 0.008 m, H by 0.012 m (RMS of 2 "
        "points).",
    ),
    (
        "points",
        {"held": 900, "extrapolated": 93, "left": 7},
        "90 % of the points corrected where control holds them, 9 % by extrapolation, 0.7 % "
        "left as they were. 7 of 1000 points lie outside the trajectory or in its gaps.",
    ),
    (
        "points",
        {"held": 1000, "extrapolated": 0, "left": 0},
        "100 % of the points corrected where control holds them, 0 % by extrapolation, 0 % left"
        " as they were.",
    ),
    (
        "no check point",
        {},
        "No check point was surveyed, so nothing independent tests this result.",
    ),
    (
        "check points",
        {"scored": 1, "surveyed": 3},
        "1 of 3 surveyed check points was seen and scored.",
    ),
    (
        "check points",
        {"scored": 2, "surveyed": 2},
        "2 of 2 surveyed check points were seen and scored.",
    ),
    (
        "hidden check points",
        {"names": ["C7"]},
        "1 check point was not seen although the cloud covers the surroundings (C7): the error "
        "there is unknown, and counts against this result.",
    ),
    (
        "refused check points",
        {"names": ["C1", "C2", "C3", "C4", "C5", "C6", "C7", "C8"]},
        "8 check points were found, but refused, as place, kind or size does not fit (C1, C2, "
        "C3, C4, C5, C6 and 2 more): the error there is unknown, and counts against this "
        "result.",
    ),
    (
        "check points elsewhere",
        {"count": 1, "by_others": True},
        "1 stands where only another scanner saw the target.",
    ),
    (
        "check points elsewhere",
        {"count": 2, "by_others": False},
        "2 stand where nothing was scanned.",
    ),
    (
        "control points",
        {
            "scored": 5,
            "surveyed": 9,
            "refused": ["T01"],
            "hidden": ["T40"],
            "elsewhere": {False: 1, True: 2},
        },
        "5 of 9 surveyed points used, 1 refused (T01), 1 not seen (T40), 1 where nothing was "
        "scanned, 2 where only another scanner saw the target.",
    ),
    (
        "control points",
        {"scored": 6, "surveyed": 6, "refused": [], "hidden": [], "elsewhere": {}},
        "6 of 6 surveyed points used.",
    ),
    (
        "no control point",
        {"is_tied": True, "sigma": 0.09},
        "No control point takes part: nothing but the POS says where the cloud lies. Passes are"
        " fitted to one another by what two of them both saw: accuracy is relative only, and an"
        " error that all of them share stays in the cloud. An error of up to 9.0 cm is to be "
        "expected (one sigma).",
    ),
    (
        "no control point",
        {"is_tied": False, "sigma": 0.0},
        "No control point takes part: nothing but the POS says where the cloud lies.",
    ),
    (
        "control of other drives",
        {},
        "No point of its own takes part: those of other drives hold it, through ties.",
    ),
    (
        "datum",
        {"lengths": {"scale": 0.1, "turn": 0.052}},
        "Control and cloud differ by one linear term each (scale 10.0 cm, turn 5.2 cm), which "
        "check points of the same survey cannot show.",
    ),
    (
        "held by other drives",
        {},
        "Control points of other drives hold the whole drive, through ties.",
    ),
    ("held", {}, "Control points hold the whole drive."),
    (
        "extrapolated",
        {"seconds": 31.5, "metres": 160.0, "share": 0.03, "sigma": 1.25},
        "No control holds 31.5 s (160 m) of the drive, 3 % of the points: the correction is "
        "extrapolated there, and an error of up to 1.25 m is to be expected (one sigma).",
    ),
    ("between control points", {"sigma": 0.095}, "Between control points it is up to 9.5 cm."),
    (
        "left out",
        {"rmse": [0.06, 0.04, 0.038], "rmse_3d": 0.0815},
        "RMSE 8.2 cm in 3D (6.0 cm, 4.0 cm, 3.8 cm in E, N, H) at control points that the "
        "others alone correct.",
    ),
    (
        "single control point",
        {},
        "A single control point has no others: the POS's own sigmas alone check it.",
    ),
    (
        "sigma",
        {"largest": 0.13, "time": 413_205.0, "median": 0.053},
        "Up to 13.0 cm (at 413205.0 s), 5.3 cm at half of the epochs: one sigma in 3D of the "
        "corrected position.",
    ),
    ("stated sigma", {"sigma": 0.03}, "The POS states 3.0 cm of the recorded one."),
    (
        "assumed",
        {
            "count": 1,
            "purpose": " until control points show better",
            "sections": ["[pos]"],
            "has_sigma": True,
        },
        "1 accuracy that nobody stated is assumed until control points show better. State what "
        "you know under [pos] in survey.toml, or give the trajectory sigma columns.",
    ),
    (
        "assumed",
        {"count": 3, "purpose": "", "sections": ["[pos]", "[scanner]"], "has_sigma": False},
        "3 accuracies that nobody stated are assumed. State what you know under [pos] and "
        "[scanner] in survey.toml.",
    ),
    ("warnings", {"count": 2}, "2 warnings:"),
    ("no ties", {"reason": "One pass."}, "One pass."),
    (
        "unused ties",
        {"n": 1200, "has_control": True},
        "None of the 1 200 places that were seen twice is used, since more than half of them "
        "contradict the others: control points alone made the correction.",
    ),
    (
        "unused ties",
        {"n": 1200, "has_control": False},
        "None of the 1 200 places that were seen twice is used, since more than half of them "
        "contradict the others: passes stay apart.",
    ),
    (
        "ties",
        {"n": 1200, "before": 0.105, "after": 0.0029},
        "The same wall, road surface, pole or painted line was seen twice in 1 200 places: "
        "there both views lay 10.5 cm apart before the correction and lie 3 mm apart after it "
        "(median).",
    ),
    (
        "contradicting ties",
        {"wrong": 13},
        "13 of these places are not used, as the others contradict them: cars that moved, "
        "people, leaves, or one row of windows taken for the next.",
    ),
    (
        "contradicting ties",
        {"wrong": 1},
        "1 of these places is not used, as the others contradict them: cars that moved, people,"
        " leaves, or one row of windows taken for the next.",
    ),
    (
        "relative ties",
        {},
        "This is relative only; nothing is claimed in absolute terms: no control point takes "
        "part, and an error that all passes share stays in the cloud.",
    ),
    (
        "share of control",
        {"control": 0.003},
        "Of what the result knows of the drive, 0.3 % comes from control points and 99.7 % from"
        " these places.",
    ),
    (
        "sufficient control",
        {"control": 6, "sufficient": 3},
        "6 control points took part; 3 of them, evenly spread, would have sufficed to know the "
        "drive about as well (to a tenth of its sigma).",
    ),
    (
        "sufficient control",
        {"control": 6, "sufficient": 1},
        "6 control points took part; 1 of them would have sufficed to know the drive about as "
        "well (to a tenth of its sigma).",
    ),
    (
        "all control needed",
        {"control": 6},
        "All 6 control points were needed: with fewer the drive is known less well.",
    ),
    (
        "all control needed",
        {"control": 2},
        "Both control points were needed: with fewer the drive is known less well.",
    ),
    (
        "scanners together",
        {"first": "left", "name": "right", "fit": 0.0018, **SIGMAS},
        "Scanners left and right put a wall that both saw in one place to 1.8 mm. Scanner right"
        " beside scanner left: lever arm to 0.3/1.3/0.4 mm right/forward/up, boresight to "
        "0.016/0.008/0.033 deg about them (one sigma).",
    ),
    (
        "scanners together",
        {"first": "left", "name": "right", "fit": None, **SIGMAS},
        "No wall that scanners left and right both saw holds them. Scanner right beside scanner"
        " left: lever arm to 0.3/1.3/0.4 mm right/forward/up, boresight to 0.016/0.008/0.033 "
        "deg about them (one sigma).",
    ),
    ("mounting not told", {}, "This geometry does not tell whether the recorded mounting holds."),
    (
        "mounting holds",
        {"sigmas": 3.0},
        "The recorded mounting holds: it lacks nothing beyond 3 sigmas.",
    ),
    (
        "determined parts hold",
        {"sigmas": 3.0},
        "The recorded mounting holds in the parts that are determined: it lacks nothing beyond "
        "3 sigmas.",
    ),
    (
        "mounting lacks",
        {"components": COMPONENTS},
        "The recorded mounting lacks boresight about up 0.300 ± 0.010 deg, lever arm up 424 ± "
        "41 mm (not determined).",
    ),
    ("all parts determined", {"count": 6}, "All 6 parts by this geometry."),
    (
        "parts not determined",
        {"components": COMPONENTS[1:], "count": 6},
        "5 of 6 parts by this geometry. Not determined, and changed only as far as the accuracy"
        " of the POS tells it from what looks the same: lever arm up 424 ± 41 mm.",
    ),
    ("no target", {}, "No target tells how good the calibration is."),
    (
        "fit of a calibration",
        {"role": "control", **OFF},
        "3D RMSE of control points 77.5 cm → 8.0 cm: the fit alone, which proves little.",
    ),
    (
        "calibration tested",
        {"role": "check", **OFF},
        "3D RMSE of check points 77.5 cm → 8.0 cm; they took no part.",
    ),
    (
        "worse by the scanner",
        {"role": "check", **OFF},
        "3D RMSE of check points 77.5 cm → 8.0 cm; they took no part, and keep what the scanner"
        " itself lacks.",
    ),
    (
        "worse by chance",
        {"role": "check", **OFF},
        "3D RMSE of check points 77.5 cm → 8.0 cm; they took no part. No part changed "
        "significantly.",
    ),
    (
        "scanner is off",
        {"range_offset": RANGES, "encoder_scale": ENCODER},
        "Ranges lack 12 ± 1.0 mm (not determined), scan angles 0.10 ± 0.20 mrad per rad; the "
        "mounting is free of it.",
    ),
    (
        "scanner is right",
        {"range_offset": ENCODER, "encoder_scale": ENCODER},
        "Ranges lack 0.1 ± 0.2 mm, scan angles 0.10 ± 0.20 mrad per rad: nothing significant.",
    ),
    (
        "scanner hardly told",
        {"range_offset": ENCODER, "encoder_scale": RANGES},
        "Ranges lack 0.1 ± 0.2 mm, scan angles 12.00 ± 1.00 mrad per rad (not determined); this"
        " geometry hardly tells it.",
    ),
    (
        "two passes",
        {**PASSES, "is_between_scanners": False, "without_drift": None},
        "80 of 90 places that two passes both saw are used: 1.5 cm apart before, 1.6 cm after "
        "(median).",
    ),
    (
        "two passes",
        {**PASSES, "is_between_scanners": True, "without_drift": 0.002},
        "80 of 90 places that two passes, or two scanners of one, both saw are used: 1.5 cm "
        "apart before, 1.6 cm after (median), 2 mm without the drift.",
    ),
    (
        "no method improves",
        {"least": 0.002, "raw": 0.021},
        "No method improves this cloud by 2 mm or more. The cloud as recorded, with 0.021 m, is"
        " as good as any.",
    ),
    (
        "best method",
        {"name": "lsc", "about": "About lsc.", "rmse": 0.02, "raw": 0.5},
        "Best is lsc: 3D RMSE 0.020 m, against 0.500 m without any correction. About lsc.",
    ),
    (
        "best methods",
        {"names": ["lsc", "shift"], "rmse": 0.02, "raw": 0.5, "least": 0.002},
        "Best are lsc and shift: 3D RMSE 0.020 m, against 0.500 m without any correction. They "
        "differ by less than 2 mm, which can't be told apart.",
    ),
    (
        "best of a kind",
        {"kind": "one move", "name": "shift", "rmse": 0.2},
        "Best of those that move the whole cloud as one: shift, with 0.200 m.",
    ),
    (
        "best of a kind",
        {"kind": "over time", "name": "ls-2", "rmse": 0.2},
        "Best of polynomials and interpolation over time: ls-2, with 0.200 m.",
    ),
    (
        "behind the best",
        {"name": "correct", "rmse": 0.03, "behind": 0.01},
        "correct, with 0.030 m, is 0.010 m behind.",
    ),
    (
        "scored by check points",
        {"control": 9, "check": 8},
        "Every method was fitted to the same 9 control points and scored by 8 check points that"
        " took no part.",
    ),
    (
        "scored by the fit",
        {"control": 9},
        "Every method was fitted to the same 9 control points. Nothing independent is left to "
        "score them by: this is the mere fit.",
    ),
    (
        "cross-validated",
        {"control": 9, "check": 1, "groups": 9},
        "Every method was fitted to the same 9 control points. There is only 1 check point, so "
        "the scores are cross-validated over all points: control points, each left out in turn,"
        " are predicted from the others; each check point from all control points.",
    ),
    (
        "cross-validated",
        {"control": 40, "check": 0, "groups": 10},
        "Every method was fitted to the same 40 control points. There are no check points, so "
        "the scores are cross-validated over all points: control points, left out in 10 groups "
        "in turn, are predicted from the others.",
    ),
    (
        "method with ties",
        {"name": "correct", "count": 375},
        "correct also uses 375 ties: planes, poles and paint that two passes both saw. All "
        "other methods use the control points alone.",
    ),
    (
        "method without ties",
        {"name": "correct", "other": "lsc", "why": "One pass."},
        "correct equals lsc here, for no ties were used. One pass.",
    ),
    (
        "method without ties",
        {"name": "correct", "other": "lsc", "why": None},
        "correct equals lsc here, for no ties were used.",
    ),
    ("methods without a score", {"count": 1, "methods": 3}, "1 of 3 methods have no score."),
    (
        "equal trajectories",
        {"epochs": 801},
        "The corrected trajectories are equal at all 801 epochs.",
    ),
    (
        "trajectories differ",
        {
            "largest": 0.1003,
            "time": 357703.08,
            "rms": 0.0023,
            "axes": {"easting": 0.0009, "northing": 0.0021, "height": 0.0},
        },
        "The corrected positions differ by up to 10.0 cm in 3D (at 357703.1 s), 2.3 mm RMS "
        "(0.9 mm, 2.1 mm, 0.0 mm in E, N, H).",
    ),
    (
        "epochs differ",
        {"interpolated": 400, "first": 1, "second": 99},
        "400 epochs of the first result have no partner in the second, which is interpolated "
        "there. Not compared, as the other trajectory does not cover them: 1 epoch of the first, "
        "99 of the second.",
    ),
    (
        "epochs differ",
        {"interpolated": 1, "first": 0, "second": 0},
        "1 epoch of the first result has no partner in the second, which is interpolated there.",
    ),
    (
        "scores of results",
        {
            "name": "check points",
            "first": 0.0126,
            "second": 0.0093,
            "difference": -0.0033,
            "counts": [5, 4],
        },
        "3D RMSE at check points: 1.3 cm in the first, 9.3 mm in the second (-3.3 mm; 5 "
        "observations and 4 observations).",
    ),
    (
        "scores of results",
        {
            "name": "check points",
            "first": 0.002,
            "second": 0.002,
            "difference": 0.0,
            "counts": [1, 1],
        },
        "3D RMSE at check points: 2.0 mm in the first, 2.0 mm in the second (no change; 1 "
        "observation).",
    ),
    (
        "residuals differ",
        {"name": "T04", "change": 0.0025, "count": 2, "all": 4, "least": 0.002},
        "The residuals of 2 of 4 observations differ by more than 2 mm, most at T04 (2.5 mm):",
    ),
    (
        "residuals differ",
        {"name": "T04", "change": 0.0005, "count": 0, "all": 4, "least": 0.002},
        "No residual differs by more than 2 mm; largest difference 0.5 mm at T04.",
    ),
    (
        "surveyed differently",
        {"count": 1},
        "1 surveyed point has other coordinates in the second result:",
    ),
    ("same targets used", {"n": 4}, "Both results use the same 4 observations of targets."),
    ("targets used in one", {"count": 2}, "2 observations are used in one result only:"),
    (
        "values differ",
        {"count": 9, "all": 21},
        "9 of 21 values of model and coverage differ (first → second):",
    ),
    ("values differ", {"count": 0, "all": 21}, "All 21 values of model and coverage agree."),
    ("inputs differ", {"count": 1, "all": 4}, "1 of 4 inputs differ:"),
    ("inputs differ", {"count": 0, "all": 4}, "All 4 inputs have the same contents."),
    ("warnings of one", {"count": 1}, "1 warning stands in one result only:"),
    (
        "check sigmas hold",
        SIGMA_TEST | {"statistic": 20.14},
        "The residuals of 8 check points agree with their stated sigmas: chi-squared is 20.1 with "
        "24 degrees of freedom, within its limits 12.4 and 39.4 (95 %). The residuals of "
        "neighboring check points are correlated, which the test disregards: a narrow miss proves "
        "little.",
    ),
    (
        "check sigmas too small",
        SIGMA_TEST | {"statistic": 60.0, "factor": 1.58},
        "The residuals of 8 check points exceed their stated sigmas: chi-squared is 60.0 with 24 "
        "degrees of freedom, outside its limits 12.4 and 39.4 (95 %). The sigmas are too small by "
        "a factor of about 1.6, or some check points are wrong. The residuals of neighboring "
        "check points are correlated, which the test disregards: a narrow miss proves little.",
    ),
    (
        "check sigmas too large",
        SIGMA_TEST | {"statistic": 9.2, "factor": 0.62},
        "The residuals of 8 check points are smaller than their stated sigmas: chi-squared is 9.2 "
        "with 24 degrees of freedom, outside its limits 12.4 and 39.4 (95 %). The sigmas are "
        "pessimistic: residuals are about 0.62 times as large. The residuals of neighboring check "
        "points are correlated, which the test disregards: a narrow miss proves little.",
    ),
]


@pytest.mark.parametrize(("key", "values", "sentence"), CATALOGUE)
def test_each_statement_has_its_sentence(key, values, sentence):
    "The result first, numbers with units, and what to do"
    assert Statement(key, values=values).sentence(SENTENCES) == sentence


def test_no_sentence_is_missing_from_the_catalogue():
    "Each key stands in it once at least"
    assert {key for key, _, _ in CATALOGUE} == SENTENCES.keys()


def test_an_extrapolated_part_is_named_by_time_and_way():
    "And what it is, with its sigma"
    assert interval_in_words(50.0, 61.5, 300.0, 60.0, "no control", 1.25) == (
        "50.0 to 61.5 s, 300 to 360 m of the way",
        "no control; sigma up to 1.25 m",
    )


@pytest.mark.parametrize(
    ("row", "use", "text"),
    [
        (
            {"value": 0.02, "unit": "m", "estimate": 0.031},
            None,
            "2.0 cm assumed; about 3.1 cm by this survey",
        ),
        ({"value": 0.02, "unit": "m"}, "for the sigmas", "2.0 cm assumed; for the sigmas"),
        ({"value": (0.01, 0.02), "unit": "deg"}, None, "0.01°, 0.02° assumed"),
        ({"value": None, "unit": "s"}, None, "– assumed"),
        ({"value": 60.0, "unit": "s"}, None, "60 s assumed"),
    ],
)
def test_an_assumed_accuracy_stands_with_its_size(row, use, text):
    "The default, beside it what this survey shows, or what it is used for"
    row = {"key": "pos.position_sigma", **row}
    assert assumed_in_words(row, use) == ("Position of the POS", text)
