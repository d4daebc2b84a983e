"""The catalogue of the sentences of a diagnosis, with values as a survey has them."""

import pytest

from mlscorr.gap.wording import ADVICE, LEFT_OUT
from mlscorr.survey import Statement

ADDITION = {
    "labels": ("lever_arm", "vertical_datum"),
    "survey": "the same road in the opposite direction",
    "why": "the squared correlation of lever arm and vertical datum decreases from 0.97 to 0.31.",
}
CATALOGUE = [
    (
        ADVICE,
        "nothing to do",
        {},
        "No action is needed: the remaining differences agree with the simulator.",
    ),
    (
        ADVICE,
        "drift of a default",
        {},
        "Run mlscorr correct: the remaining differences look like POS drift, and no sigma of "
        "the POS was given.",
    ),
    (
        ADVICE,
        "errors above stated",
        {},
        "The errors are larger than stated: run mlscorr correct, or increase the stated sigmas "
        "of the POS.",
    ),
    (
        ADVICE,
        "gap above chance",
        {},
        "More control points or a second pass may show why survey and simulation differ.",
    ),
    (
        ADVICE,
        "unmatched targets",
        {},
        "Find out why the targets of that interval could not be matched before using the survey "
        "there. The warnings give the reason for each target.",
    ),
    (
        ADVICE,
        "unstated mounting",
        {"effects": 12},
        "Add [mounting] to survey.toml and diagnose again: 12 error types can't be tested "
        "without it, and one of them may be the cause.",
    ),
    (
        ADVICE,
        "unknown error",
        {"lead": "height error that grows with speed"},
        "Look for the cause of a height error that grows with speed: no tested effect explains it.",
    ),
    (
        ADVICE,
        "nearest effect",
        {"effect": "range_scale", "share": 0.6},
        "The nearest known effect, range scale, closes 60 % of the squared gap, but does not "
        "explain it: do not use it.",
    ),
    (
        ADVICE,
        "nearest effect",
        {"effect": "range_scale", "share": None},
        "The nearest known effect, range scale, does not explain it: do not use it.",
    ),
    (
        ADVICE,
        "remedy",
        {"effect": "range_noise"},
        "Set the scanner's range noise in survey.toml to the value found, or have the scanner "
        "checked.",
    ),
    (
        ADVICE,
        "grown gap",
        {"before": 18.7, "after": 53.9, "unit": "mm"},
        "However, the gap increased with that size in the simulator (from 18.7 to 53.9 mm). The "
        "cause is reliable, its size is not.",
    ),
    (
        ADVICE,
        "addition",
        ADDITION,
        "To resolve the open hypotheses (lever arm, vertical datum), measure the same road in "
        "the opposite direction: the squared correlation of lever arm and vertical datum "
        "decreases from 0.97 to 0.31.",
    ),
    (ADVICE, "channels", {}, 'See "Channels" for differences other than geometry.'),
    (
        ADVICE,
        "simulator as it was",
        {"why": "time_offset of 500 s exceeds 1 s."},
        "simulator.toml is unchanged, because no simulator can include this: time_offset of 500 "
        "s exceeds 1 s.",
    ),
    (
        ADVICE,
        "next run",
        {},
        "Run mlscorr diagnose again with --simulator simulator.toml from this folder. It "
        "contains the cause, and the next run finds what remains.",
    ),
    (
        ADVICE,
        "next clouds",
        {},
        "Add the cause to your simulator, and give its new clouds as a second --simulated. They "
        "show how far the gap decreases; on their own, they show what remains.",
    ),
    (
        ADVICE,
        "second clouds",
        {},
        "Run mlscorr diagnose with the second clouds alone: they show what remains.",
    ),
    (
        LEFT_OUT,
        "no mounting",
        {"stage": "range"},
        "It acts on the range, and the survey has no [mounting].",
    ),
    (
        LEFT_OUT,
        "unstated size",
        {"name": "range_noise"},
        "survey.toml does not give its size: [scanner] range_noise.",
    ),
    (LEFT_OUT, "no row", {}, "No residual of this survey depends on it."),
    (
        LEFT_OUT,
        "noise",
        {},
        "Noise shows in surface roughness and in the scatter of residuals, not in a shift.",
    ),
    (
        LEFT_OUT,
        "not usable",
        {"why": "It gives values that are not numbers."},
        "It gives values that are not numbers.",
    ),
]


@pytest.mark.parametrize(("wordings", "key", "values", "sentence"), CATALOGUE)
def test_each_statement_has_its_sentence(wordings, key, values, sentence):
    "An advice says what to do, a reason why an effect was not tested"
    assert Statement(key, values=values).sentence(wordings) == sentence


@pytest.mark.parametrize("wordings", [ADVICE, LEFT_OUT])
def test_no_sentence_is_missing_from_the_catalogue(wordings):
    "Every key of the advice and of the reasons is read"
    assert {key for some, key, _, _ in CATALOGUE if some is wordings} == wordings.keys()
