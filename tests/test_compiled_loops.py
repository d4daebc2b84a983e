"""Compiled loops are kept somewhere on every machine."""

import os
import tempfile

import pytest

from mlscorr.compiled_loops import choose_folder


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    "The system's temporary folder, and no wish of the user's"
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setenv("NUMBA_CACHE_DIR", "")
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    return tmp_path


def test_loops_are_kept_where_numba_keeps_them(temporary):
    "A single usual folder that can be written is enough"
    choose_folder("/nonexistent", temporary)
    assert "NUMBA_CACHE_DIR" not in os.environ
    assert not list(temporary.iterdir())


def test_loops_are_kept_without_home_or_package_that_can_be_written(temporary):
    "They go to a folder of the user's own, the same each time, which nobody else can open"
    for _ in range(2):
        choose_folder("/nonexistent", "~")
        folder = os.environ.pop("NUMBA_CACHE_DIR")
        assert folder == str(temporary / f"mlscorr-{os.getuid()}")
        assert os.stat(folder).st_mode & 0o777 == 0o700


def test_a_folder_that_leads_elsewhere_is_not_trusted(temporary):
    "What lies in the folder is run, so a link in its place gives way to a folder made anew"
    (temporary / "elsewhere").mkdir()
    (temporary / f"mlscorr-{os.getuid()}").symlink_to(temporary / "elsewhere")
    choose_folder("/nonexistent")
    folder = os.path.realpath(os.environ["NUMBA_CACHE_DIR"])
    assert folder != str(temporary / "elsewhere")
    assert os.path.dirname(folder) == str(temporary)


def test_the_folder_that_a_user_names_stands(temporary, monkeypatch):
    "NUMBA_CACHE_DIR is left as it is"
    monkeypatch.setenv("NUMBA_CACHE_DIR", "/srv/loops")
    choose_folder("/nonexistent")
    assert os.environ["NUMBA_CACHE_DIR"] == "/srv/loops"
    assert not list(temporary.iterdir())
