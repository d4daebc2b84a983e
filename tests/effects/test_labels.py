"""Labels of a diagnosis in the words of the field."""

import pytest

from mlscorr.effects import family, known_effects, lowered, meaning, parameter_title, title, titles

NAMES = [kind.name for kind in known_effects()]


@pytest.mark.parametrize("name", NAMES)
def test_no_effect_is_called_by_its_name_in_code(name):
    "Title, sentence on it and parameter are words: no underscore, a capital first"
    for words in (title(name), meaning(name), parameter_title(f"{name} easting")):
        assert "_" not in words and words[0].isupper()
    assert family(name) in ("effect", "noise")


def test_several_are_joined_as_in_a_sentence():
    "One capital, abbreviations stay as they are, and the last is joined by and"
    names = ["position_step", "range_bias", "time_offset"]
    assert titles(names) == "GNSS jump, range bias and scanner clock offset"
    assert lowered(titles(names[1:])) == "range bias and scanner clock offset"
    assert title("range_bias+unknown") == "Range bias and something unknown"
