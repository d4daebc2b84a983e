"""Advice that follows from a verdict."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.gap.advice import OF_EXCESS, Agreement, advice_of, excess_of
from mlscorr.gap.closure import Closure
from mlscorr.gap.closure.closure import Gap, OverSigma
from mlscorr.gap.evidence import Cause, Inference, Where
from mlscorr.gap.evidence.decision import GapVerdict
from mlscorr.gap.plan import NextData
from mlscorr.gap.wording import (
    ADVICE,
    LEFT_OUT,
    advice_sentences,
    left_out_sentences,
    sentence_of,
)
from mlscorr.survey import Statement

BAND = (-0.4, 0.7)  # mm
AGAIN = NextData("the same road again", "two passes share errors")


def keys(advice):
    return [statement.key for statement in advice]


def inference(label="none", whole=0.1, labels=("none",), hint=""):
    "Of a verdict, with the gap (mm) of all rows together"
    none = np.zeros(0)
    empty = np.zeros((0, 2))
    where = Where(whole, whole, BAND, (), none, none, empty, none)
    verdict = GapVerdict(label, 0.34, labels, 0.6, hint, False)
    cause = Cause(label, 0.34, (), (), np.zeros(3))
    return Inference(verdict, (cause,), (), where, None, {label: 0.34}, None, None)


def closure(effect="none", before=0.1, after=0.1, shrink=0.0, over=1.0):
    "Of a cause, with gaps (mm) and errors in height (sigmas) after it"
    sigmas = OverSigma(("H",), (over,), (over,), (1.9,))
    gap = Gap(before, after, BAND)
    return Closure(
        effect,
        0.3,
        "systematic",
        "mm",
        before,
        after,
        shrink,
        (shrink, shrink),
        BAND,
        "",
        True,
        np.zeros((1, 2)),
        gap,
        sigmas,
    )


@pytest.mark.parametrize(
    ("whole", "before", "over", "rms_mm", "excess"),
    [
        (0.1, 0.1, 1.0, 20.0, ""),
        (12.9, 0.1, 1.0, 20.0, "chance"),
        (0.1, 0.8, 1.0, 20.0, "chance"),
        (0.1, 0.1, 7.3, 20.0, "stated"),
        (12.9, 0.1, 1.0, 91.6, "stated"),
    ],
)
def test_nothing_needs_to_be_done_where_all_is_as_stated(whole, before, over, rms_mm, excess):
    "Gap, errors over their sigma, accuracy: each can stand against it, in sentence and advice"
    found = inference(whole=whole)
    closed = closure(before=before, over=over)
    assert excess_of(found, closed, [Agreement("target", 9, rms_mm, 20.6)]) == excess
    assert keys(advice_of(found, closed, [], excess)) == [OF_EXCESS[excess]]
    assert ("No error was detected" in sentence_of(found, excess)) == (not excess)
    assert (OF_EXCESS[excess] == "nothing to do") == (not excess)


def test_nothing_is_larger_than_a_default():
    "With a default sigma of the POS, 9 cm and 7 sigma are drift, and no excess"
    found = inference()
    closed = closure(over=7.3)
    far = [Agreement("target", 9, 91.6, 20.6)]
    assert excess_of(found, closed, far) == "stated"
    assert excess_of(found, closed, far, is_stated=False) == ""
    assert keys(advice_of(found, closed, [], "", is_stated=False)) == ["drift of a default"]


def test_where_something_is_to_be_measured_something_needs_to_be_done():
    "With an open question and an addition that settles it the addition is all that is advised"
    found = inference(labels=("none", "lever_arm"))
    (addition,) = advice_of(found, closure(), [AGAIN], "")
    assert addition.key == "addition" and addition.values["labels"] == ("lever_arm",)
    assert addition.values["survey"] == AGAIN.survey
    assert keys(advice_of(found, closure(), [], "")) == ["nothing to do"]


def test_the_nearest_effect_is_advised_against_by_its_share():
    "Its share of the squared gap is a value beside its name"
    found = inference("unknown", labels=("unknown",), hint="easting error")
    first, second = advice_of(found, closure("range_scale", 9.0, 0.6, 0.9952), [], "")
    assert first == Statement("unknown error", values={"lead": "easting error"})
    assert second.values == {"effect": "range_scale", "share": 0.9952}


def test_what_no_judged_effect_explains_may_be_one_that_needs_a_mounting():
    "Two of three effects lack [mounting]: to state it comes first, and no effect is ruled out"
    found = inference("unknown", labels=("unknown",), hint="error to the right")
    mounting = Statement("no mounting", "warning", {"stage": "mounting"})
    left_out = {"lever_arm": mounting, "boresight": mounting, "range": Statement("no row")}
    first, second = advice_of(found, closure(), [], "", left_out=left_out)
    assert first == Statement("unstated mounting", values={"effects": 2})
    assert second.key == "unknown error"
    assert "No tested effect explains" in sentence_of(found, "")


def test_what_chance_makes_is_not_closed():
    "Of a gap of 0.5 mm where chance makes up to 0.7 mm no share is told; lost returns count below"
    found = inference("unknown", labels=("unknown",), hint="easting error")
    within = closure("range_scale", 0.5, -0.9, -1.0)
    assert within.is_within_noise and not closure("range_scale", 0.8, 0.1, 0.9).is_within_noise
    assert not closure("none", 0.5, 0.5).is_within_noise
    _, second = advice_of(found, within, [], "")
    assert second.key == "nearest effect" and second.values["share"] is None
    lost = replace(within, kind="returns", before=-10.0, unit="%")
    assert not lost.is_within_noise


@pytest.mark.parametrize(("after", "shrink", "is_said"), [(-53.9, -0.88, True), (0.1, 0.9, False)])
def test_a_size_with_which_the_gap_grew_is_not_advised_alone(after, shrink, is_said):
    "The noise is stated as large as found, but for what the simulator says of that size"
    found = inference("range_noise", labels=("range_noise",))
    advice = advice_of(found, closure("range_noise", 18.7, after, shrink), [], "")
    assert advice[0] == Statement("remedy", values={"effect": "range_noise"})
    assert ("grown gap" in keys(advice)) == is_said


VALUES = {  # of each key whose sentence has any
    "unknown error": {"lead": "easting error"},
    "unstated mounting": {"effects": 2},
    "nearest effect": {"effect": "range_scale", "share": 0.9952},
    "remedy": {"effect": "range_noise"},
    "grown gap": {"before": 18.7, "after": -53.9, "unit": "mm"},
    "addition": {"labels": ("lever_arm", "lever_arm"), "survey": AGAIN.survey, "why": AGAIN.why},
    "simulator as it was": {"why": "A time_offset of 500 s exceeds 1 s."},
}


def test_every_advice_has_its_sentence():
    "With its numbers, articles and names in words, and nothing twice"
    advice = [Statement(key, values=VALUES.get(key, {})) for key in ADVICE]
    sentences = dict(zip(ADVICE, advice_sentences([*advice, *advice]), strict=True))
    assert sentences["nothing to do"].startswith("No action is needed")
    assert "cause of an easting error: no tested effect" in sentences["unknown error"]
    assert sentences["unstated mounting"].startswith("Add [mounting] to survey.toml")
    assert "2 error types" in sentences["unstated mounting"]
    assert "closes 99.5 % of the squared gap, but does not explain" in sentences["nearest effect"]
    assert "to the value found" in sentences["remedy"]
    assert ("gap increased with that size in the simulator (from 18.7 to -53.9 mm)") in sentences[
        "grown gap"
    ]
    settled = "To resolve the open hypotheses (lever arm), measure the same road again: two passes"
    assert sentences["addition"].startswith(settled)
    assert "time_offset of 500 s exceeds" in sentences["simulator as it was"]


def test_a_nearest_effect_without_a_share_is_advised_against():
    "No percentage is made of what chance makes"
    statement = Statement("nearest effect", values={"effect": "range_scale", "share": None})
    (sentence,) = advice_sentences([statement])
    assert "%" not in sentence and "does not explain it: do not use it" in sentence


def test_every_reason_not_to_judge_has_its_sentence():
    "With the stage or the key that lacks a value"
    values = {
        "stage": "range",
        "name": "range_noise",
        "why": "It gives values that are not numbers.",
    }
    left_out = {key: Statement(key, values=values) for key in LEFT_OUT}
    sentences = left_out_sentences(left_out)
    assert sentences["no mounting"] == "It acts on the range, and the survey has no [mounting]."
    assert sentences["unstated size"].endswith("does not give its size: [scanner] range_noise.")
    assert sentences["not usable"] == values["why"]
    assert all(sentence.endswith(".") for sentence in sentences.values())
