"""One case of a blind check: mechanisms of no library, and refusals."""

import pytest

from mlscorr.blind.cases import load_mechanisms


def test_a_file_without_its_units_is_refused(tmp_path):
    "A file of mechanisms needs functions, words and units of the same names"
    path = tmp_path / "mechanisms.py"
    path.write_text("MECHANISMS = {'lift': None}\nLEADS = {'lift': ()}\nUNITS = {}\n")
    with pytest.raises(ValueError, match=r"has no UNITS. A file of mechanisms"):
        load_mechanisms(path)
    path.write_text("MECHANISMS = {'lift': None}\nLEADS = {'lift': ()}\nUNITS = {'lift': ()}\n")
    assert list(load_mechanisms(path)) == ["lift"]


@pytest.mark.parametrize(
    ("text", "words"), [("1 +", r"\(line 1\): SyntaxError"), ("lift", "NameError: name 'lift'")]
)
def test_a_file_that_can_not_be_run_is_named(text, words, tmp_path):
    "Whatever a user's code raises: the file stands in the sentence, and what it is"
    path = tmp_path / "mechanisms.py"
    path.write_text(text)
    with pytest.raises(ValueError, match=rf"mechanisms\.py can't be run.*{words}"):
        load_mechanisms(path)


def test_a_missing_file_is_named(tmp_path):
    "The sentence says which file, and what it should hold"
    with pytest.raises(FileNotFoundError, match=r"none.py does not exist. It should define MECH"):
        load_mechanisms(tmp_path / "none.py")
