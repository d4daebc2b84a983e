"""The catalogue of the sentences on excluded and included control points."""

import pytest

from mlscorr.pipeline.wording import CHOICES
from mlscorr.survey import Statement

CATALOGUE = [
    (
        "excluded",
        {
            "name": "T07",
            "residual": 0.213,
            "by": "check",
            "with_point": 0.021,
            "without_point": 0.012,
        },
        "T07 is excluded by the user; its 3D residual is 21.3 cm. 3D RMSE (check): 2.1 cm with it, "
        "1.2 cm without it.",
    ),
    (
        "included, contradicted",
        {"name": "T05", "statistic": 61.24, "critical": 21.11},
        "T05 is used because include names it, and the other control points contradict it: "
        "statistic 61.2, critical value 21.1. It pulls the correction toward its coordinates; "
        "check them.",
    ),
    (
        "included, refused",
        {"name": "T05", "reason": "it is another object."},
        "T05 is used because include names it. Matching rejected it: it is another object.",
    ),
]


@pytest.mark.parametrize(("key", "values", "sentence"), CATALOGUE)
def test_each_statement_has_its_sentence(key, values, sentence):
    "As the screen and the report show it"
    assert Statement(key, values=values).sentence(CHOICES) == sentence


def test_no_sentence_is_missing_from_the_catalogue():
    "Every choice is read"
    assert {key for key, _, _ in CATALOGUE} == CHOICES.keys()
