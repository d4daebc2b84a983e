"""The catalogue of the sentences of matching, with values as a survey has them."""

import pytest

from mlscorr.matching import REASONS
from mlscorr.survey import Statement

CORRECTED = {"neighbours": [("T02", -4.2), ("T04", 6.1)], "sigma": 0.03}
ALONE = {"neighbours": [], "sigma": 0.4}
CIRCLE = {"kind": "circle", "size": 0.6, "time": 357705.0}
FOUND = {"away": 1.25, "found_name": "T03"}
CATALOGUE = [
    (
        "other appearance",
        {
            "name": "T01",
            "time": 357705.0,
            "kind": "circle",
            "size": 0.6,
            "surveyed_kind": "square",
            "surveyed_size": 0.5,
            "off": 0.03,
            "exchanged": [],
            **CORRECTED,
        },
        "The observation at 357705.0 s is a circle of 0.60 m and T01 is a square of 0.50 m, "
        "0.03 m from it after correction. Its neighbors T02 (-4.2 s) and T04 (+6.1 s) predict "
        "the misclosure with a sigma of 0.03 m. Kind or size is wrong in the survey or in the "
        "extraction.",
    ),
    (
        "other appearance",
        {
            "name": "T01",
            "time": 357705.0,
            "kind": "circle",
            "size": 0.6,
            "surveyed_kind": "square",
            "surveyed_size": 0.5,
            "off": 0.03,
            "exchanged": ["T02"],
            **ALONE,
        },
        "The observation at 357705.0 s is a circle of 0.60 m and T01 is a square of 0.50 m, "
        "0.03 m from it after correction. No other target constrains the misclosure there "
        "(sigma 0.40 m). T01 and T02 seem to be exchanged.",
    ),
    (
        "wrong point",
        {
            "name": "T01",
            "time": 357705.0,
            "off": 0.5,
            "probability": 0.998,
            "observations": 2,
            "misclosure": 0.71,
            "search_radius": 10.0,
            **CORRECTED,
        },
        "T01 is 0.50 m from the corrected observation at 357705.0 s. Its neighbors T02 (-4.2 s) "
        "and T04 (+6.1 s) predict the misclosure with a sigma of 0.03 m. Its coordinates are "
        "wrong, or the observation is another object (probability 0.998 by 2 observations; "
        "misclosure 0.71 m, search radius 10.00 m): check its survey record, or exclude it.",
    ),
    (
        "two points",
        {
            "names": ["T01", "T02"],
            "apart": 0.31,
            "time": 357705.0,
            "probabilities": [0.52, 0.48],
            "search_radius": 10.0,
            **ALONE,
        },
        "T01 and T02, 0.31 m apart, both match the observation at 357705.0 s (search radius "
        "10.00 m, probability 0.520 and 0.480). No other target constrains the misclosure there "
        "(sigma 0.40 m).",
    ),
    (
        "two observations",
        {
            "name": "T01",
            "apart": 0.31,
            "times": [357705.0, 357705.4],
            "probability": 0.52,
            "search_radius": 10.0,
            **ALONE,
        },
        "Two observations 0.31 m apart, at 357705.0 s and 357705.4 s, both match T01 (search "
        "radius 10.00 m, probability 0.520 of the first). No other target constrains the "
        "misclosure there (sigma 0.40 m).",
    ),
    (
        "doubtful match",
        {
            "name": "T01",
            "misclosure": 2.1,
            "time": 357705.0,
            "probability": 0.8,
            "wrong": 0.15,
            "search_radius": 10.0,
            **ALONE,
        },
        "The match of T01 with the observation at 357705.0 s, 2.10 m away, is uncertain (search "
        "radius 10.00 m, probability 0.800; 0.150 for a wrong surveyed point). No other target "
        "constrains the misclosure there (sigma 0.40 m).",
    ),
    (
        "another object",
        {
            "name": "T01",
            "time": 357705.0,
            "off": 5.5,
            "misclosure": 6.0,
            "search_radius": 10.0,
            **CORRECTED,
        },
        "T01 is 5.50 m from the corrected observation at 357705.0 s. Its neighbors T02 (-4.2 s) "
        "and T04 (+6.1 s) predict the misclosure with a sigma of 0.03 m. The observation is "
        "another object (misclosure 6.00 m, search radius 10.00 m).",
    ),
    ("no control", CIRCLE, "No point was surveyed for the circle of 0.60 m at 357705.0 s."),
    (
        "no point left",
        {
            **CIRCLE,
            "search_radius": 10.0,
            "nearest": "T01",
            "nearest_kind": "circle",
            "nearest_size": 0.6,
            "distance": 2.0,
            "is_taken": True,
        },
        "No surveyed point remains for the circle of 0.60 m at 357705.0 s (search radius 10.00 "
        "m); the nearest, T01, already matched in this pass, a circle of 0.60 m, is 2.00 m away.",
    ),
    ("nothing found", {}, "No target was found in the cloud."),
    (
        "only refused",
        {**CIRCLE, **FOUND, "found_name": None, "why": Statement("no control", values=CIRCLE)},
        "The nearest unmatched circle of 0.60 m was found at 357705.0 s, 1.25 m away. No point "
        "was surveyed for the circle of 0.60 m at 357705.0 s.",
    ),
    (
        "only others",
        {**CIRCLE, **FOUND, "search_radius": 10.0},
        "Each circle of 0.60 m found near it (search radius 10.00 m) belongs to another "
        "surveyed point; the nearest was found at 357705.0 s, 1.25 m away (it is T03).",
    ),
    (
        "none of its kind",
        {
            **CIRCLE,
            **FOUND,
            "search_radius": 10.0,
            "nearest_kind": "square",
            "nearest_size": 0.5,
        },
        "No circle of 0.60 m was found near it (search radius 10.00 m). The nearest target, a "
        "square of 0.50 m, was found at 357705.0 s, 1.25 m away (it is T03).",
    ),
    ("not matched", {"why": "The scanner was covered."}, "The scanner was covered."),
]


@pytest.mark.parametrize(("key", "values", "sentence"), CATALOGUE)
def test_each_statement_has_its_sentence(key, values, sentence):
    "With numbers, their units and the way out"
    assert Statement(key, values=values).sentence(REASONS) == sentence


def test_no_sentence_is_missing_from_the_catalogue():
    "Every key of the reasons is read"
    assert {key for key, _, _ in CATALOGUE} == REASONS.keys()
