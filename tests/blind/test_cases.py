"""One case of a blind check: mechanisms of no library, and refusals."""

import pytest

from mlscorr.blind.cases import load_mechanisms


def test_a_file_without_its_units_is_refused(tmp_path):
    "A file of mechanisms needs functions, words and units of the same names"
    path = tmp_path / "mechanisms.py"
    path.write_text("MECHANISMS = {'lift': None}\nLEADS = {'lift': ()}\nUNITS = {}\n")
    with pytest.raises(ValueError, match="has no UNITS with the names of its MECHANISMS"):
        load_mechanisms(path)
    path.write_text("MECHANISMS = {'lift': None}\nLEADS = {'lift': ()}\nUNITS = {'lift': ()}\n")
    assert list(load_mechanisms(path)) == ["lift"]


def test_a_missing_file_is_named(tmp_path):
    "The sentence says which file, and what it should hold"
    with pytest.raises(FileNotFoundError, match=r"none.py does not exist; it should hold MECH"):
        load_mechanisms(tmp_path / "none.py")
