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
        "The accuracy of the correction is unknown: no point was surveyed.",
    ),
    (
        "no target to judge by",
        {},
        "The accuracy of the correction is unknown: no target was found.",
    ),
    (
        "hardly changed",
        {"before": 0.011, "after": 0.012, "kind": "check"},
        "The correction hardly changed the cloud. 3D RMSE at independent check points: 1.1 cm "
        "before, 1.2 cm after the correction.",
    ),
    (
        "changed within sigma",
        {"before": 0.008, "after": 0.016, "kind": "leave-one-out"},
        "The change is smaller than the accuracy of these targets. 3D RMSE at control points "
        "(leave-one-out): 8 mm before, 1.6 cm after the correction.",
    ),
    (
        "made worse",
        {"before": 0.008, "after": 0.016, "kind": "check"},
        "The correction made the cloud worse; don't use it. 3D RMSE at independent check "
        "points: 8 mm before, 1.6 cm after the correction.",
    ),
    (
        "improved",
        {**OFF, "kind": "check", "times": 9.7, "holds_everywhere": True},
        "3D RMSE at independent check points: 77.5 cm before, 8.0 cm after the correction (10 "
        "times smaller).",
    ),
    (
        "improved",
        {**OFF, "kind": "check", "times": 9.7, "holds_everywhere": False},
        "3D RMSE at independent check points: 77.5 cm before, 8.0 cm after the correction. It "
        "does not apply to the whole cloud; the items below state where.",
    ),
    (
        "improved",
        {**OFF, "kind": "leave-one-out", "times": 9.7, "holds_everywhere": False},
        "3D RMSE at control points (leave-one-out): 77.5 cm before, 8.0 cm after the "
        "correction. It does not apply to the whole cloud; the items below state where.",
    ),
    (
        "improved",
        {**OFF, "kind": "fit", "times": None, "holds_everywhere": True},
        "3D RMSE at the points used for the correction (fit only, no independent check): 77.5 "
        "cm before, 8.0 cm after the correction.",
    ),
    (
        "rmse of check points",
        {**AXES, "points": 2, "observations": 2},
        "Check points, not used in the estimate: RMSE 0.71/0.20/0.24 m before, 0.06/0.04/0.04 m "
        "after (E/N/H), 2 points.",
    ),
    (
        "rmse left out",
        {**AXES, "points": 4, "observations": 8, "has_checks": True},
        "No check point was found in the cloud. Control points, leave-one-out: RMSE "
        "0.71/0.20/0.24 m before, 0.06/0.04/0.04 m after (E/N/H), 8 observations of 4 points.",
    ),
    (
        "rmse left out",
        {**AXES, "points": 4, "observations": 8, "has_checks": False},
        "There are no check points. Control points, leave-one-out: RMSE 0.71/0.20/0.24 m "
        "before, 0.06/0.04/0.04 m after (E/N/H), 8 observations of 4 points.",
    ),
    (
        "rmse of the fit",
        {
            "before": [0.7081, 0.2043, 0.2398],
            "after": [0.0012, 0.004, 0.004],
            "points": 1,
            "observations": 1,
        },
        "Fit to the points used for the correction: RMSE 0.7081/0.2043/0.2398 m before, "
        "0.0012/0.0040/0.0040 m after (E/N/H), 1 point. No independent point shows the accuracy "
        "elsewhere.",
    ),
    (
        "worse axes",
        {"rises": {"E": 0.0082, "H": 0.012}, "points": 2, "observations": 2},
        "The RMSE of 2 points increased after the correction: E by 0.008 m, H by 0.012 m.",
    ),
    (
        "points",
        {"held": 900, "extrapolated": 93, "left": 7},
        "90 % of all points constrained by control, 9 % extrapolated, 0.7 % not corrected. "
        "7 of 1000 points were measured outside the trajectory or in its gaps.",
    ),
    (
        "points",
        {"held": 1000, "extrapolated": 0, "left": 0},
        "100 % of all points constrained by control, 0 % extrapolated, 0 % not corrected.",
    ),
    (
        "no check point",
        {},
        "No check point was surveyed: there is no independent test of this result.",
    ),
    (
        "check points",
        {"scored": 1, "surveyed": 3},
        "1 of 3 surveyed check points was found and used for the RMSE.",
    ),
    (
        "check points",
        {"scored": 2, "surveyed": 2},
        "2 of 2 surveyed check points were found and used for the RMSE.",
    ),
    (
        "hidden check points",
        {"names": ["C7"]},
        "1 check point was not found although the cloud covers the surroundings (C7). The error "
        "there is unknown.",
    ),
    (
        "refused check points",
        {"names": ["C1", "C2", "C3", "C4", "C5", "C6", "C7", "C8"]},
        "8 check points were found but rejected, because position, kind or size does not fit "
        "(C1, C2, C3, C4, C5, C6 and 2 more). The error there is unknown.",
    ),
    (
        "check points elsewhere",
        {"count": 1, "by_others": True},
        "1 was scanned by another scanner only.",
    ),
    (
        "check points elsewhere",
        {"count": 2, "by_others": False},
        "2 were outside the scanned area.",
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
        "5 of 9 surveyed points used, 1 rejected (T01), 1 not found (T40), 1 outside the "
        "scanned area, 2 scanned by another scanner only.",
    ),
    (
        "control points",
        {"scored": 6, "surveyed": 6, "refused": [], "hidden": [], "elsewhere": {}},
        "6 of 6 surveyed points used.",
    ),
    (
        "no control point",
        {"is_tied": True, "sigma": 0.09},
        "No control point was used: the absolute position of the cloud is that of the POS. Tie "
        "features align the passes with one another. The accuracy is relative only, and an "
        "error that all passes share remains. Expected error up to 9.0 cm (1 sigma).",
    ),
    (
        "no control point",
        {"is_tied": False, "sigma": 0.0},
        "No control point was used: the absolute position of the cloud is that of the POS.",
    ),
    (
        "control of other drives",
        {},
        "This drive has no control point of its own. Control points of other drives constrain "
        "it through ties.",
    ),
    (
        "datum",
        {"lengths": {"scale": 0.1, "turn": 0.052}},
        "Control and cloud differ systematically (scale 10.0 cm, turn 5.2 cm). Check points "
        "from the same survey cannot show this.",
    ),
    (
        "held by other drives",
        {},
        "Control points of other drives constrain the whole drive through ties.",
    ),
    ("held", {}, "Control points constrain the whole drive."),
    (
        "extrapolated",
        {"seconds": 31.5, "metres": 160.0, "share": 0.03, "sigma": 1.25},
        "31.5 s (160 m, 3 % of the points) are outside the control. The correction is "
        "extrapolated there; expected error up to 1.25 m (1 sigma).",
    ),
    (
        "between control points",
        {"sigma": 0.095},
        "Between control points, expected error up to 9.5 cm.",
    ),
    (
        "left out",
        {"rmse": [0.06, 0.04, 0.038], "rmse_3d": 0.0815},
        "3D RMSE at control points, each predicted from the others: 8.2 cm (6.0 cm, 4.0 cm, 3.8 "
        "cm in E, N, H).",
    ),
    (
        "single control point",
        {},
        "No leave-one-out test is possible with a single control point: only the stated sigmas "
        "of the POS check it.",
    ),
    (
        "sigma",
        {"largest": 0.13, "time": 413_205.0, "median": 0.053},
        "3D sigma of the corrected position: median 5.3 cm, largest 13.0 cm (at 413205.0 s).",
    ),
    ("stated sigma", {"sigma": 0.03}, "The POS states 3.0 cm for the recorded position."),
    (
        "assumed",
        {
            "count": 1,
            "purpose": " until control points give an estimate",
            "sections": ["[pos]"],
            "has_sigma": True,
        },
        "1 accuracy was not given and is assumed until control points give an estimate. Set "
        "known values under [pos] in survey.toml, or add sigma columns to the trajectory.",
    ),
    (
        "assumed",
        {"count": 3, "purpose": "", "sections": ["[pos]", "[scanner]"], "has_sigma": False},
        "3 accuracies were not given and are assumed. Set known values under [pos] and "
        "[scanner] in survey.toml.",
    ),
    ("warnings", {"count": 2}, "2 warnings:"),
    ("no ties", {"reason": "One pass."}, "One pass."),
    (
        "unused ties",
        {"n": 1200, "has_control": True},
        "None of the 1 200 tie features was used, because more than half of them contradict the "
        "others. The correction is based on the control points alone.",
    ),
    (
        "unused ties",
        {"n": 1200, "has_control": False},
        "None of the 1 200 tie features was used, because more than half of them contradict the "
        "others. The passes were not aligned with each other.",
    ),
    (
        "ties",
        {"n": 1200, "before": 0.105, "after": 0.0029},
        "Median misclosure of 1 200 tie features (walls, road surfaces, poles and painted lines "
        "scanned twice): 10.5 cm before, 3 mm after the correction.",
    ),
    (
        "contradicting ties",
        {"wrong": 13},
        "13 of these tie features were rejected because the others contradict them. Likely "
        "causes: moving cars, people, foliage, or repeated facade elements matched wrongly.",
    ),
    (
        "contradicting ties",
        {"wrong": 1},
        "1 of these tie features was rejected because the others contradict them. Likely "
        "causes: moving cars, people, foliage, or repeated facade elements matched wrongly.",
    ),
    (
        "relative ties",
        {},
        "The accuracy is relative only: no control point was used, and an error that all passes "
        "share remains in the cloud.",
    ),
    (
        "share of control",
        {"control": 0.003},
        "Information on the drift: 0.3 % from control points, 99.7 % from tie features.",
    ),
    (
        "sufficient control",
        {"control": 6, "sufficient": 3},
        "6 control points were used; 3 of them, evenly spaced, would give a sigma within 10 % "
        "of the present one.",
    ),
    (
        "sufficient control",
        {"control": 6, "sufficient": 1},
        "6 control points were used; 1 of them would give a sigma within 10 % of the present one.",
    ),
    (
        "all control needed",
        {"control": 6},
        "All 6 control points are needed: with fewer, the sigma of the correction increases.",
    ),
    (
        "all control needed",
        {"control": 2},
        "Both control points are needed: with fewer, the sigma of the correction increases.",
    ),
    (
        "scanners together",
        {"first": "left", "name": "right", "fit": 0.0018, **SIGMAS},
        "Walls scanned by both scanner left and scanner right agree to 1.8 mm. Sigma of scanner "
        "right relative to scanner left: lever arm 0.3/1.3/0.4 mm (right/forward/up), boresight "
        "0.016/0.008/0.033 deg about the same axes.",
    ),
    (
        "scanners together",
        {"first": "left", "name": "right", "fit": None, **SIGMAS},
        "No wall was scanned by both scanner left and scanner right. Sigma of scanner right "
        "relative to scanner left: lever arm 0.3/1.3/0.4 mm (right/forward/up), boresight "
        "0.016/0.008/0.033 deg about the same axes.",
    ),
    ("mounting not told", {}, "This geometry can't confirm the recorded mounting."),
    (
        "mounting holds",
        {"sigmas": 3.0},
        "The recorded mounting is confirmed: no correction exceeds 3 sigma.",
    ),
    (
        "determined parts hold",
        {"sigmas": 3.0},
        "The determined components of the recorded mounting are confirmed: no correction "
        "exceeds 3 sigma.",
    ),
    (
        "mounting lacks",
        {"components": COMPONENTS},
        "Corrections to the recorded mounting: boresight about up 0.300 ± 0.010 deg, lever arm "
        "up 424 ± 41 mm (not determined).",
    ),
    ("all parts determined", {"count": 6}, "This geometry determines all 6 components."),
    (
        "parts not determined",
        {"components": COMPONENTS[1:], "count": 6},
        "This geometry determines 5 of 6 components. Not determined: lever arm up 424 ± 41 mm. "
        "Their sigmas rest on the stated accuracy of the POS.",
    ),
    ("no target", {}, "The accuracy of the calibration is unknown: no target was found."),
    (
        "fit of a calibration",
        {"role": "control", **OFF},
        "3D RMSE at control points: 77.5 cm before, 8.0 cm after the calibration (fit only, no "
        "independent check).",
    ),
    (
        "calibration tested",
        {"role": "check", **OFF},
        "3D RMSE at check points: 77.5 cm before, 8.0 cm after the calibration (not used in the "
        "estimate).",
    ),
    (
        "worse by the scanner",
        {"role": "check", **OFF},
        "3D RMSE at check points: 77.5 cm before, 8.0 cm after the calibration (not used in the "
        "estimate; errors of the scanner itself remain).",
    ),
    (
        "worse by chance",
        {"role": "check", **OFF},
        "3D RMSE at check points: 77.5 cm before, 8.0 cm after the calibration (not used in the "
        "estimate). No component changed significantly.",
    ),
    (
        "scanner is off",
        {"range_offset": RANGES, "encoder_scale": ENCODER},
        "Range offset 12 ± 1.0 mm (not determined), scale of the scan angles 0.10 ± 0.20 mrad "
        "per rad; the mounting is free of these errors.",
    ),
    (
        "scanner is right",
        {"range_offset": ENCODER, "encoder_scale": ENCODER},
        "Range offset 0.1 ± 0.2 mm, scale of the scan angles 0.10 ± 0.20 mrad per rad: not "
        "significant.",
    ),
    (
        "scanner hardly told",
        {"range_offset": ENCODER, "encoder_scale": RANGES},
        "Range offset 0.1 ± 0.2 mm, scale of the scan angles 12.00 ± 1.00 mrad per rad (not "
        "determined); this geometry hardly determines them.",
    ),
    (
        "two passes",
        {**PASSES, "is_between_scanners": False, "without_drift": None},
        "80 of 90 tie features between passes were used. Median misclosure: 1.5 cm before, 1.6 "
        "cm after the calibration.",
    ),
    (
        "two passes",
        {**PASSES, "is_between_scanners": True, "without_drift": 0.002},
        "80 of 90 tie features between passes or scanners were used. Median misclosure: 1.5 cm "
        "before, 1.6 cm after the calibration, 2 mm with the drift removed.",
    ),
    (
        "no method improves",
        {"least": 0.002, "raw": 0.021},
        "No method reduces the 3D RMSE by 2 mm or more. The recorded cloud has 0.021 m.",
    ),
    (
        "best method",
        {"name": "lsc", "about": "About lsc.", "rmse": 0.02, "raw": 0.5},
        "Best method: lsc, 3D RMSE 0.020 m; 0.500 m without correction. About lsc.",
    ),
    (
        "best methods",
        {"names": ["lsc", "shift"], "rmse": 0.02, "raw": 0.5, "least": 0.002},
        "Best methods: lsc and shift, 3D RMSE 0.020 m; 0.500 m without correction. They differ "
        "by less than 2 mm, which is not significant.",
    ),
    (
        "best of a kind",
        {"kind": "one move", "name": "shift", "rmse": 0.2},
        "Best single transformation of the whole cloud: shift, 0.200 m.",
    ),
    (
        "best of a kind",
        {"kind": "over time", "name": "ls-2", "rmse": 0.2},
        "Best polynomial or interpolation over time: ls-2, 0.200 m.",
    ),
    (
        "behind the best",
        {"name": "correct", "rmse": 0.03, "behind": 0.01},
        "correct has 0.030 m, 0.010 m more than the best.",
    ),
    (
        "scored by check points",
        {"control": 9, "check": 8},
        "Every method was fitted to the same 9 control points and tested at 8 check points not "
        "used in the fit.",
    ),
    (
        "scored by the fit",
        {"control": 9},
        "Every method was fitted to the same 9 control points. No independent point is left: "
        "the scores show the fit only.",
    ),
    (
        "cross-validated",
        {"control": 9, "check": 1, "groups": 9},
        "Every method was fitted to the same 9 control points. As there is only 1 check point, "
        "the scores are cross-validated (leave-one-out): control points are predicted from the "
        "others. Each check point is predicted from all control points.",
    ),
    (
        "cross-validated",
        {"control": 40, "check": 0, "groups": 10},
        "Every method was fitted to the same 40 control points. As there are no check points, "
        "the scores are cross-validated (in 10 groups): control points are predicted from the "
        "others.",
    ),
    (
        "method with ties",
        {"name": "correct", "count": 375},
        "correct also uses 375 ties between passes (planes, poles and paint). All other methods "
        "use the control points only.",
    ),
    (
        "method without ties",
        {"name": "correct", "other": "lsc", "why": "One pass."},
        "correct equals lsc here because no ties were used. One pass.",
    ),
    (
        "method without ties",
        {"name": "correct", "other": "lsc", "why": None},
        "correct equals lsc here because no ties were used.",
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
        "400 epochs of the first result have no counterpart in the second, which was "
        "interpolated there. Not covered by the other trajectory and therefore not compared: 1 "
        "epoch of the first, 99 of the second.",
    ),
    (
        "epochs differ",
        {"interpolated": 1, "first": 0, "second": 0},
        "1 epoch of the first result has no counterpart in the second, which was interpolated "
        "there.",
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
        "1 surveyed point has different coordinates in the second result:",
    ),
    ("same targets used", {"n": 4}, "Both results use the same 4 observations of targets."),
    ("targets used in one", {"count": 2}, "2 observations were used in one result only:"),
    (
        "values differ",
        {"count": 9, "all": 21},
        "9 of 21 values of model and coverage differ (first → second):",
    ),
    ("values differ", {"count": 0, "all": 21}, "All 21 values of model and coverage agree."),
    ("inputs differ", {"count": 1, "all": 4}, "1 of 4 inputs differ:"),
    ("inputs differ", {"count": 0, "all": 4}, "All 4 inputs have the same contents."),
    ("warnings of one", {"count": 1}, "1 warning appears in one result only:"),
    (
        "check sigmas hold",
        SIGMA_TEST | {"statistic": 20.14},
        "The residuals at 8 check points agree with their stated sigmas: chi-squared 20.1 with "
        "24 degrees of freedom, within the limits 12.4 and 39.4 (95 %). The test disregards the "
        "correlation between neighboring check points: a value just outside the limits proves "
        "little.",
    ),
    (
        "check sigmas too small",
        SIGMA_TEST | {"statistic": 60.0, "factor": 1.58},
        "The residuals at 8 check points exceed their stated sigmas: chi-squared 60.0 with 24 "
        "degrees of freedom, outside the limits 12.4 and 39.4 (95 %). The sigmas are too small "
        "by a factor of about 1.6, or some check points are wrong. The test disregards the "
        "correlation between neighboring check points: a value just outside the limits proves "
        "little.",
    ),
    (
        "check sigmas too large",
        SIGMA_TEST | {"statistic": 9.2, "factor": 0.62},
        "The residuals at 8 check points are smaller than their stated sigmas: chi-squared 9.2 "
        "with 24 degrees of freedom, outside the limits 12.4 and 39.4 (95 %). The sigmas are "
        "pessimistic: the residuals are only 0.62 times as large. The test disregards the "
        "correlation between neighboring check points: a value just outside the limits proves "
        "little.",
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
        "50.0 to 61.5 s, chainage 300 to 360 m",
        "no control; sigma up to 1.25 m",
    )


@pytest.mark.parametrize(
    ("row", "use", "text"),
    [
        (
            {"value": 0.02, "unit": "m", "estimate": 0.031},
            None,
            "2.0 cm assumed; estimated from this survey: 3.1 cm",
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
