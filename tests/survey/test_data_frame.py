"""Data frames of rows and columns: a column for each number, missing ones NaN."""

import sys

import numpy as np
import pytest

from mlscorr.survey import rows_frame
from mlscorr.survey.columns import columns_frame
from tests.beds.tied_passes import tied_passes


def test_vectors_of_rows_become_three_columns_and_unknown_ones_nan():
    "A point without an observation has NaN in the columns that the others have"
    rows = [
        {"name": "T01", "observed": [532_000.0, 3.3e6, 8.0], "before": {"rmse": 0.5}, "why": None},
        {"name": "T02", "observed": None, "before": {"rmse": None}, "why": None},
    ]
    frame = rows_frame(rows)
    axes = ["observed_easting", "observed_northing", "observed_height"]
    assert list(frame) == ["name", *axes, "before_rmse", "why"]
    assert frame.loc[0, axes].tolist() == rows[0]["observed"]
    assert frame.loc[1, axes].isna().all()


def test_arrays_of_columns_become_a_column_for_each_number():
    "Vectors by axis, matrices by both axes, two views by number"
    frame = columns_frame({"time": np.arange(2.0), "place": np.ones((2, 2, 3)), "kind": ("a", "b")})
    places = [f"place_{i}_{axis}" for i in (1, 2) for axis in ("easting", "northing", "height")]
    assert list(frame) == ["time", *places, "kind"]


def test_records_give_a_row_each():
    "Observations and their surveyed points stand side by side, each column with what it is of"
    matched = tied_passes(1).matched
    frame = matched.to_frame()
    assert len(frame) == len(matched)
    misclosure = frame["surveyed_position_height"] - frame["observations_position_height"]
    assert np.allclose(misclosure, matched.misclosure[:, 2])


def test_without_pandas_a_sentence_says_what_to_install(monkeypatch):
    "pandas is optional: its absence is told where a data frame is asked for"
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ModuleNotFoundError, match="pip install pandas"):
        rows_frame([])
