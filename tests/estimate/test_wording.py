"""The sentences on an estimate, each with the values that it needs."""

import numpy as np
import pytest

from mlscorr.estimate import sentences_of
from mlscorr.estimate._wording import SENTENCES
from mlscorr.survey import Statement

PAIR = {"names": ("T02", "T03"), "misclosures": ([0.1, -0.2, 0.0], [0.11, -0.19, 0.01])}
ANGLE = float(np.radians(0.25))
CATALOGUE = [
    (
        "zero sigmas",
        {"epochs": 2001, "column": "attitude_sigma", "unit": "deg"},
        "All 2001 trajectory epochs state attitude_sigma = 0 deg, which is not realistic. The "
        "values under [pos] in survey.toml are used instead.",
    ),
    (
        "filled sigmas",
        {"filled": 5, "epochs": 2001, "column": "position_sigma", "unit": "m", "first": 413200.5},
        "5 of 2001 trajectory epochs state position_sigma = 0 m, or an isolated outlier (first "
        "at 413200.500 s). The values of the neighboring epochs are used there.",
    ),
    (
        "unstated drift",
        {"names": ("T02", "T03"), "size": 0.123, "first": 413200.0, "last": 413260.26},
        "T02, T03 deviate together by at least 0.12 m per axis from 413200.0 to 413260.3 s. The "
        "POS drifts more than it states there, so its sigma was increased.",
    ),
    (
        "wrong or drift",
        {"names": ("T02", "T07"), "targets": 12, "size": 0.2, "odds": 3.04},
        "2 of 12 control points (T02, T07) were rejected as wrong. A short unstated drift of "
        "the POS near each of them is 3.0 times as probable; errors of up to 0.20 m would then "
        "remain, and the sigmas include this. Survey these points again, or more points around "
        "them.",
    ),
    (
        "neighbours rejected",
        PAIR,
        "T02 and T03 are consecutive, were both rejected, and deviate in the same direction "
        "(0.10/-0.20/0.00 and 0.11/-0.19/0.01 m). Either both are wrong, as from one instrument "
        "setup, or the POS drifted there briefly. Survey one of them again.",
    ),
    (
        "neighbours kept",
        PAIR,
        "T02 and T03 are consecutive and deviate from the others in the same direction "
        "(0.10/-0.20/0.00 and 0.11/-0.19/0.01 m). This was treated as drift of the POS, but an "
        "error in both, as from one instrument setup, is almost as likely. Survey one of them "
        "again.",
    ),
    (
        "contradicts ties",
        {
            "name": "T2",
            "misclosure": (0.1, 0.0, -0.0204),
            "statistic": 40.02,
            "critical": 16.3,
            "is_used": False,
        },
        "Control point T2 contradicts the other control points, connected to it by ties: it "
        "deviates by 0.100/0.000/-0.020 m (E/N/H), statistic 40.0, critical value 16.3. It was "
        "not used. Survey it again, or test with --no-ties whether the ties are wrong.",
    ),
    (
        "contradicts ties",
        {
            "name": "T2",
            "misclosure": (0.1, 0.0, -0.0204),
            "statistic": 40.02,
            "critical": 16.3,
            "is_used": True,
        },
        "Control point T2 contradicts the other control points, connected to it by ties: it "
        "deviates by 0.100/0.000/-0.020 m (E/N/H), statistic 40.0, critical value 16.3. It was "
        "used, because too few points remain to identify the wrong one. Survey it again, or "
        "test with --no-ties whether the ties are wrong.",
    ),
    (
        "no tie used",
        {"ties": 300},
        "None of the 300 ties between passes was used: more than half of them contradict the "
        "others, or all of them contradict several control points. Possible causes: the street "
        "changed between passes, the mounting is wrong (run mlscorr calibrate), or the "
        "scanner's encoder has a scale error.",
    ),
    ("on ties", {"sentence": "Nothing was scanned twice."}, "Nothing was scanned twice."),
    (
        "lowered order",
        {"targets": 1, "epochs": 1, "asked": 3, "order": 0},
        "1 control point at 1 epoch is too few for a trend of order 3, which needs 5. Order 0 "
        "is used.",
    ),
    (
        "lowered order",
        {"targets": 3, "epochs": 2, "asked": 3, "order": 0},
        "3 control points at 2 epochs are too few for a trend of order 3, which needs 5. Order "
        "0 is used.",
    ),
    (
        "few targets",
        {"targets": 1, "least": 3},
        "Only 1 control point was used, so a wrong point cannot be identified. Survey at least 3.",
    ),
    (
        "few targets",
        {"targets": 2, "least": 3},
        "Only 2 control points were used, so a wrong point cannot be identified. Survey at "
        "least 3.",
    ),
    (
        "one epoch",
        {"targets": 4, "seconds": 0.44, "start": 413200.04},
        "All 4 control points were observed within 0.4 s at 413200.0 s, and the correction is "
        "determined only there. Elsewhere a decreasing part of it is applied, with increasing "
        "sigmas.",
    ),
    (
        "relative only",
        {},
        "No control point was used. The passes agree with each other, but their absolute "
        "position rests on the POS: the accuracy is relative only.",
    ),
    (
        "pass without control",
        {"first": 413200.0, "last": 413300.0},
        "The pass from 413200.0 to 413300.0 s has no control point. It is corrected only by the "
        "trend of the other passes and the remaining correlation with them.",
    ),
    (
        "global test",
        {"statistic": 71.4, "redundancy": 30.2, "upper": 59.7},
        "The global test fails: the misclosures exceed the stated sigmas of control points and "
        "targets (chi-squared 71, limit 60, 30 degrees of freedom). Check the sigmas of the "
        "control points.",
    ),
    (
        "extrapolated",
        {"seconds": 40.0, "side": "past the last", "correlation_times": 1.33, "is_faded": False},
        "The signal is extrapolated 40 s past the last control point (1.3 correlation times): "
        "it decays to the trend there.",
    ),
    (
        "extrapolated",
        {"seconds": 100.0, "side": "before the first", "correlation_times": 3.3, "is_faded": True},
        "The signal is extrapolated 100 s before the first control point (3.3 correlation "
        "times): only the trend applies there.",
    ),
    (
        "faded",
        {"seconds": 400.0, "start": 413200.0, "correlation_times": 8.0},
        "There is no control point for 400 s from 413200.0 s (8.0 correlation times). Only the "
        "trend applies in the middle of this interval.",
    ),
    (
        "clock",
        {"lack": -0.1, "speed": 10.0, "spread": 5.0},
        "The lever arm needs a correction of -100 mm forward. A clock offset of 10 ms has the "
        "same effect at this survey's speed (10.0 ± 5.0 m/s). mlscorr diagnose separates the "
        "two where speeds differ.",
    ),
    (
        "scanner errors",
        {
            "components": ("range offset", "encoder scale"),
            "corrections": (0.01, -0.002),
            "sigmas": (0.001, 0.0003),
            "determined": (True, False),
        },
        "The scanner itself has errors: range offset 10.0 ± 1.0 mm, encoder scale -2.0 ± 0.3 "
        "mrad per rad (not determined). The mounting is free of them, but the points are not. "
        "Set them in the scanner's software, export the clouds again, and repeat the "
        "calibration.",
    ),
    (
        "mounting by ties alone",
        {},
        "No control point was used. The calibration makes the passes agree; their absolute "
        "position rests on the POS.",
    ),
    (
        "undetermined",
        {"components": ("lever arm up", "boresight about up"), "sigmas": (0.05, ANGLE)},
        "This geometry does not determine lever arm up (sigma 0.050 m), boresight about up "
        "(sigma 0.250 deg). A constant offset between control and trajectory, or another "
        "component, has the same effect. Targets on both sides, near and far, high and low, "
        "passed in both directions, help; a level street never separates lever arm up from a "
        "height offset.",
    ),
    (
        "wrong mounting",
        {
            "components": ("lever arm right", "boresight about up"),
            "corrections": (-0.087, ANGLE),
            "sigmas": (0.011, ANGLE / 10),
            "statistic": 69.1,
            "critical": 22.5,
            "scanners": 1,
        },
        "The misclosures depend on the direction of travel (arrows of opposite passes are "
        "opposite). Likely cause: wrong mounting; estimated corrections: lever arm right -0.087 "
        "± 0.011 m, boresight about up 0.25 ± 0.03 deg (chi-squared 69, critical value 22). "
        "This correction treats them as drift: run mlscorr calibrate --clouds first, and "
        "correct the survey that it writes.",
    ),
    (
        "wrong mounting",
        {
            "components": ("boresight about up",),
            "corrections": (ANGLE,),
            "sigmas": (ANGLE / 10,),
            "statistic": 69.1,
            "critical": 22.5,
            "scanners": 2,
        },
        "The misclosures depend on the direction of travel (arrows of opposite passes are "
        "opposite). Likely cause: wrong mountings; estimated common corrections of the 2 "
        "scanners: boresight about up 0.25 ± 0.03 deg (chi-squared 69, critical value 22). This "
        "correction treats them as drift: run mlscorr calibrate --clouds first, and correct the "
        "survey that it writes.",
    ),
    (
        "wrong scanner",
        {
            "name": "right",
            "first": "left",
            "corrections": (0.02, 0.0, -0.001, 0.0, ANGLE, 0.0),
            "sigmas": (0.001, 0.002, 0.003, ANGLE, ANGLE, ANGLE),
        },
        "Scanner right disagrees with scanner left. Relative to it, the lever arm needs "
        "corrections of 20 ± 1, 0 ± 2, -1 ± 3 mm (right, forward, up), and the boresight 0.00 ± "
        "0.25, 0.25 ± 0.25, 0.00 ± 0.25 deg about the same axes. They are kept out of the drift "
        "but remain in the points. Run mlscorr calibrate --clouds first, and correct the survey "
        "that it writes.",
    ),
    (
        "wrong scanner",
        {
            "name": "",
            "first": "",
            "corrections": (0.02, 0.0, -0.001, 0.0, ANGLE, 0.0),
            "sigmas": (0.001, 0.002, 0.003, ANGLE, ANGLE, ANGLE),
        },
        "The scanner disagrees with itself between passes: the lever arm needs corrections of "
        "20 ± 1, 0 ± 2, -1 ± 3 mm (right, forward, up), and the boresight 0.00 ± 0.25, 0.25 ± "
        "0.25, 0.00 ± 0.25 deg about the same axes. They are kept out of the drift but remain "
        "in the points. Run mlscorr calibrate --clouds first, and correct the survey that it "
        "writes.",
    ),
]


@pytest.mark.parametrize("key, values, sentence", CATALOGUE, ids=lambda part: str(part)[:20])
def test_each_statement_has_its_sentence(key, values, sentence):
    "Numbers with units, in the words that a reader of the report gets"
    assert sentences_of([Statement(key, "warning", values)]) == (sentence,)


def test_the_catalogue_is_complete():
    "A new key comes with its sentence here"
    assert {key for key, _, _ in CATALOGUE} == set(SENTENCES)
