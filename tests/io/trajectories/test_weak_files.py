"""Weak stretches as files of a GIS and of a spreadsheet."""

import csv
import json

import numpy as np
import pytest

from mlscorr.io.trajectories import write_weak
from tests.beds.reports import START, drive

STRETCH = {
    "from": START + 10.0,
    "to": START + 20.0,
    "length_m": 60.0,
    "chainage": 60.0,
    "sigma": 0.4,
    "why": "pass without control point",
}


def test_a_stretch_lies_where_the_trajectory_ran(tmp_path):
    "Its ends on the map in the table, its line in longitude and latitude, to a millimetre"
    from pyproj import Transformer

    trajectory = drive()
    names = write_weak(tmp_path, [STRETCH], trajectory, "EPSG:32650")
    assert names == ["weak.csv", "weak.geojson"]
    (row,) = csv.DictReader((tmp_path / "weak.csv").read_text().splitlines())
    assert float(row["chainage_to"]) == 120.0 and row["why"] == STRETCH["why"]
    feature = json.loads((tmp_path / "weak.geojson").read_text())["features"][0]
    assert feature["properties"] == STRETCH
    to_map = Transformer.from_crs("EPSG:4326", "EPSG:32650", always_xy=True)
    line = np.column_stack(to_map.transform(*np.transpose(feature["geometry"]["coordinates"])))
    ends = trajectory.at([STRETCH["from"], STRETCH["to"]]).position[:, :2]
    assert line[[0, -1]] == pytest.approx(ends, abs=0.002)
    table = [
        [float(row[f"{axis}_{end}"]) for axis in ("easting", "northing")] for end in ("from", "to")
    ]
    assert np.array(table) == pytest.approx(ends, abs=0.001)


def test_without_a_crs_there_is_the_table_alone_and_without_stretches_they_are_empty(tmp_path):
    "A script always finds weak.csv, and reads no stretch where control holds everything"
    assert write_weak(tmp_path, [STRETCH], drive(), None) == ["weak.csv"]
    assert not (tmp_path / "weak.geojson").exists()
    write_weak(tmp_path, [], drive(), "EPSG:32650")
    assert len((tmp_path / "weak.csv").read_text().splitlines()) == 1
    assert json.loads((tmp_path / "weak.geojson").read_text())["features"] == []
