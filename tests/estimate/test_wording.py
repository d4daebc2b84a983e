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
        "All 2001 trajectory epochs state a attitude_sigma of 0 deg, which no POS has: what "
        "survey.toml's [pos] believes is used.",
    ),
    (
        "filled sigmas",
        {"filled": 5, "epochs": 2001, "column": "position_sigma", "unit": "m", "first": 413200.5},
        "5 of 2001 trajectory epochs state a position_sigma of 0 m, or one that jumps at these "
        "epochs alone (first at 413200.500 s), which is no statement: those of the epochs before "
        "and after are used there.",
    ),
    (
        "unstated drift",
        {"names": ("T02", "T03"), "size": 0.123, "first": 413200.0, "last": 413260.26},
        "T02, T03 deviate together by 0.12 m and more per axis from 413200.0 to 413260.3 s: the "
        "POS drifts there by more than it states, so that its sigma was raised.",
    ),
    (
        "wrong or drift",
        {"names": ("T02", "T07"), "targets": 12, "size": 0.2, "odds": 3.04},
        "2 of 12 control points (T02, T07) were refused as wrong. That the POS drifts for a short "
        "time beside each of them, and doesn't state it, is 3.0 times as probable: then up to "
        "0.20 m are left there, and sigmas are larger for it. Survey these points again, or more "
        "of them around.",
    ),
    (
        "neighbours rejected",
        PAIR,
        "T02 and T03 follow each other, were both rejected, and deviate in one direction "
        "(0.10/-0.20/0.00 and 0.11/-0.19/0.01 m). They may be wrong together, as by one setup of "
        "the instrument, or the POS drifted there for a short time: survey one of them again.",
    ),
    (
        "neighbours kept",
        PAIR,
        "T02 and T03 follow each other and deviate from the others in one direction "
        "(0.10/-0.20/0.00 and 0.11/-0.19/0.01 m). This was taken as drift of the POS; that both "
        "are wrong together, as by one setup of the instrument, is not much less likely: survey "
        "one of them again.",
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
        "Control point T2 contradicts what ties carry to it from the other control points: it is "
        "0.100/0.000/-0.020 m (E/N/H) off that, statistic 40.0 against 16.3. It takes no part: "
        "survey it again, or see by --no-ties whether ties are wrong.",
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
        "Control point T2 contradicts what ties carry to it from the other control points: it is "
        "0.100/0.000/-0.020 m (E/N/H) off that, statistic 40.0 against 16.3. It is used, as too "
        "few are left to tell which point is wrong: survey it again, or see by --no-ties whether "
        "ties are wrong.",
    ),
    (
        "no tie used",
        {"ties": 300},
        "None of the 300 ties between passes was used: more than half of them contradict the "
        "others, or all of them several control points. Did the street change between the passes, "
        "is the mounting wrong (mlscorr calibrate), or does the scanner's own encoder turn by "
        "another scale (milliradians per radian)?",
    ),
    ("on ties", {"sentence": "Nothing was scanned twice."}, "Nothing was scanned twice."),
    (
        "lowered order",
        {"targets": 1, "epochs": 1, "asked": 3, "order": 0},
        "1 control point at 1 epoch is too few for a trend of order 3, which needs 5: order 0 is "
        "used.",
    ),
    (
        "lowered order",
        {"targets": 3, "epochs": 2, "asked": 3, "order": 0},
        "3 control points at 2 epochs are too few for a trend of order 3, which needs 5: order 0 "
        "is used.",
    ),
    (
        "few targets",
        {"targets": 1, "least": 3},
        "Only 1 control point takes part: a wrong one cannot be found. Survey at least 3.",
    ),
    (
        "few targets",
        {"targets": 2, "least": 3},
        "Only 2 control points take part: a wrong one cannot be found. Survey at least 3.",
    ),
    (
        "one epoch",
        {"targets": 4, "seconds": 0.44, "start": 413200.04},
        "All 4 control points were seen within 0.4 s at 413200.0 s: the correction is known there. "
        "Nothing tells whether it is the same elsewhere, so that a part of it is kept, with "
        "growing sigmas.",
    ),
    (
        "relative only",
        {},
        "No control point takes part. The passes agree with each other, but nothing is known of "
        "where they are beyond what the POS states: accuracy is relative only.",
    ),
    (
        "pass without control",
        {"first": 413200.0, "last": 413300.0},
        "The pass from 413200.0 to 413300.0 s has no control point: only the trend of the other "
        "passes and what is left of their signal correct it.",
    ),
    (
        "global test",
        {"statistic": 71.4, "redundancy": 30.2, "upper": 59.7},
        "The global test fails: the misclosures vary more than the stated sigmas of control points "
        "and targets allow (chi-squared 71 above 60 of 30 degrees of freedom). Are the sigmas of "
        "control points right?",
    ),
    (
        "extrapolated",
        {"seconds": 40.0, "side": "past the last", "correlation_times": 1.33, "is_faded": False},
        "Signal extrapolated 40 s past the last control point (1.3 correlation times): it fades to "
        "the trend there.",
    ),
    (
        "extrapolated",
        {"seconds": 100.0, "side": "before the first", "correlation_times": 3.3, "is_faded": True},
        "Signal extrapolated 100 s before the first control point (3.3 correlation times): only "
        "the trend applies there.",
    ),
    (
        "faded",
        {"seconds": 400.0, "start": 413200.0, "correlation_times": 8.0},
        "No control point for 400 s from 413200.0 s (8.0 correlation times): only the trend "
        "applies in the middle of it.",
    ),
    (
        "clock",
        {"lack": -0.1, "speed": 10.0, "spread": 5.0},
        "The lever arm lacks -100 mm forward. A clock offset of 10 ms at this survey's speed (10.0 "
        "± 5.0 m/s) looks the same but where speeds differ: by those mlscorr diagnose tells which.",
    ),
    (
        "scanner errors",
        {
            "components": ("range offset", "encoder scale"),
            "corrections": (0.01, -0.002),
            "sigmas": (0.001, 0.0003),
            "determined": (True, False),
        },
        "The scanner itself is off: it lacks range offset 10.0 ± 1.0 mm, encoder scale -2.0 ± 0.3 "
        "mrad per rad (not determined). The mounting is given free of that, but the points keep "
        "it: set it in the scanner's own software, export the clouds anew, and calibrate again.",
    ),
    (
        "mounting by ties alone",
        {},
        "No control point takes part: the mounting is that which makes the passes agree, and where "
        "they are is what the POS says.",
    ),
    (
        "undetermined",
        {"components": ("lever arm up", "boresight about up"), "sigmas": (0.05, ANGLE)},
        "This geometry does not determine lever arm up (sigma 0.050 m), boresight about up (sigma "
        "0.250 deg): a constant difference between the coordinates of control and trajectory, or "
        "another component, looks the same, and the sigma holds only as far as the POS's own do. "
        "Targets on both sides, near and far, high and low, passed in both directions tell more; "
        "no level street tells lever arm up from a height difference.",
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
        "Passes disagree by their direction of travel (arrows of opposite passes are opposite), as "
        "a wrong mounting makes them: it lacks lever arm right -0.087 ± 0.011 m, boresight about "
        "up 0.25 ± 0.03 deg (chi-squared 69, critical 22). This correction takes that for drift. "
        "Run mlscorr calibrate --clouds first, and correct the survey that it writes.",
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
        "Passes disagree by their direction of travel (arrows of opposite passes are opposite), as "
        "wrong mountings make them: each of the 2 scanners' lacks, alike, boresight about up 0.25 "
        "± 0.03 deg (chi-squared 69, critical 22). This correction takes that for drift. Run "
        "mlscorr calibrate --clouds first, and correct the survey that it writes.",
    ),
    (
        "wrong scanner",
        {
            "name": "right",
            "first": "left",
            "corrections": (0.02, 0.0, -0.001, 0.0, ANGLE, 0.0),
            "sigmas": (0.001, 0.002, 0.003, ANGLE, ANGLE, ANGLE),
        },
        "Scanner right puts what both see elsewhere than left does: beside it, its lever arm lacks "
        "20 ± 1, 0 ± 2, -1 ± 3 mm to the right, forward, up, and its boresight 0.00 ± 0.25, 0.25 ± "
        "0.25, 0.00 ± 0.25 deg about them. No drift is made of it, but its points keep it. Run "
        "mlscorr calibrate --clouds first, and correct the survey that it writes.",
    ),
    (
        "wrong scanner",
        {
            "name": "",
            "first": "",
            "corrections": (0.02, 0.0, -0.001, 0.0, ANGLE, 0.0),
            "sigmas": (0.001, 0.002, 0.003, ANGLE, ANGLE, ANGLE),
        },
        "The scanner puts what it sees twice elsewhere the second time: its lever arm lacks 20 ± "
        "1, 0 ± 2, -1 ± 3 mm to the right, forward, up, and its boresight 0.00 ± 0.25, 0.25 ± "
        "0.25, 0.00 ± 0.25 deg about them. No drift is made of it, but its points keep it. Run "
        "mlscorr calibrate --clouds first, and correct the survey that it writes.",
    ),
]


@pytest.mark.parametrize("key, values, sentence", CATALOGUE, ids=lambda part: str(part)[:20])
def test_each_statement_has_its_sentence(key, values, sentence):
    "Numbers with units, in the words that a reader of the report gets"
    assert sentences_of([Statement(key, "warning", values)]) == (sentence,)


def test_the_catalogue_is_complete():
    "A new key comes with its sentence here"
    assert {key for key, _, _ in CATALOGUE} == set(SENTENCES)
