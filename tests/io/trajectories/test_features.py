"""Targets and trajectories for a GIS: GeoPackage in the survey's CRS, GeoJSON in WGS 84."""

import json
import sqlite3
import struct
from contextlib import closing

import numpy as np
import pytest
from pyproj import Transformer

from mlscorr.io.trajectories import (
    check_distinct,
    check_exports,
    check_target_exports,
    export_targets,
    export_trajectory,
)
from mlscorr.survey import Trajectory
from tests.io.trajectories.test_trajectory_files import CRS
from tests.io.trajectories.test_trajectory_io import drive

PLACE = [532_011.3794, 3_373_979.7859, 44.4329]
SEEN = {
    "name": "T01",
    "pass": 1,
    "gps_time": 413_201.25,
    "role": "control",
    "surveyed": PLACE,
    "observed": [532_011.2794, 3_373_979.7859, 44.4329],
    "sigma": [0.004, 0.005, 0.006],
    "before": [0.1, 0.0, 0.0],
    "after": [0.002, 0.0, 0.0],
    "used": True,
    "reason": None,
}
UNSEEN = SEEN | {
    "name": "T'02",
    "pass": None,
    "gps_time": None,
    "observed": None,
    "sigma": None,
    "before": None,
    "after": None,
    "used": False,
    "reason": 'nothing was scanned "there"',
}


def table_of(path, name):
    "Rows of a table of a GeoPackage, as dicts"
    with closing(sqlite3.connect(path)) as package:
        package.row_factory = sqlite3.Row
        return [dict(row) for row in package.execute(f"SELECT * FROM {name}")]


def places_of(blob):
    "Number of the CRS, and places (n, 3) of a geometry"
    assert blob[:4] == b"GP\0\1"
    number, order, kind = struct.unpack_from("<iBI", blob, 4)
    assert order == 1 and kind in (1001, 1002)
    return number, np.frombuffer(blob, "<f8", offset=13 + 4 * (kind == 1002)).reshape(-1, 3)


def with_gap():
    "A drive of two parts, corrected by 3, 4 and 12 cm"
    whole = drive(800)
    time = whole.gps_time + np.where(np.arange(800) < 400, 0.0, 60.0)
    sigmas = np.full((800, 3), 0.01), whole.attitude_sigma
    recorded = Trajectory(time, whole.position, whole.attitude, *sigmas)
    place = np.add(whole.position, [0.03, 0.04, 0.12])
    return recorded, Trajectory(time, place, whole.attitude, *sigmas)


def test_a_geopackage_has_targets_in_the_crs_of_the_survey(tmp_path):
    "Coordinates are those of the survey to the last bit, attributes those of the report"
    path = tmp_path / "targets.gpkg"
    assert export_targets(path, [SEEN, UNSEEN], {"T01": "circle"}, CRS) == ["targets.gpkg"]
    first, second = table_of(path, "targets")
    number, place = places_of(first["geom"])
    assert number == 32650 and place.tolist() == [PLACE]
    assert (first["name"], first["pass"], first["role"], first["kind"]) == (
        "T01",
        1,
        "control",
        "circle",
    )
    assert (first["used"], first["before_easting"], first["after_easting"]) == (1, 0.1, 0.002)
    assert (second["name"], second["pass"], second["before_easting"]) == ("T'02", None, None)
    assert second["used"] == 0 and second["reason"] == UNSEEN["reason"]
    assert path.read_bytes()[68:72] == b"GPKG"
    (layer,) = table_of(path, "gpkg_contents")
    assert (layer["table_name"], layer["data_type"], layer["srs_id"]) == (
        "targets",
        "features",
        32650,
    )
    systems = {row["srs_id"]: row["definition"] for row in table_of(path, "gpkg_spatial_ref_sys")}
    assert set(systems) == {-1, 0, 4326, 32650} and "UTM zone 50N" in systems[32650]


def test_a_trajectory_is_a_line_for_each_part_between_gaps(tmp_path):
    "Two lines with their sigma and the size of the correction (13 cm), and a point each second"
    recorded, corrected = with_gap()
    path = tmp_path / "drive.gpkg"
    assert export_trajectory(path, corrected, CRS, recorded) == ["drive.gpkg"]
    lines = table_of(path, "trajectory")
    assert [line["part"] for line in lines] == [1, 2]
    for line, rows in zip(lines, (slice(400), slice(400, 800)), strict=True):
        _, place = places_of(line["geom"])
        assert np.abs(place[[0, -1]] - corrected.position[rows][[0, -1]]).max() == 0.0
        assert abs(line["length_m"] - 0.45 * 399) < 0.01  # m
        assert abs(line["mean_correction"] - 0.13) < 1e-9
        assert abs(line["mean_sigma"] - 0.01 * np.sqrt(3)) < 1e-9
        assert np.linalg.norm(np.diff(place, axis=0), axis=1).max() < 2.0  # a vertex a meter
    points = table_of(path, "seconds")
    assert len(points) == 40 and abs(points[7]["correction_height"] - 0.12) < 1e-9


def test_geojson_is_in_wgs_84(tmp_path):
    "Longitude and latitude (RFC 7946) lead back to the places on the map within 2 mm"
    back = Transformer.from_crs("EPSG:4326", CRS, always_xy=True)
    export_targets(tmp_path / "t.geojson", [SEEN, UNSEEN], {}, CRS)
    export_trajectory(tmp_path / "d.geojson", with_gap()[1], CRS)
    targets, lines = (
        json.loads((tmp_path / name).read_text())["features"] for name in ("t.geojson", "d.geojson")
    )
    east, north = back.transform(*targets[0]["geometry"]["coordinates"])
    assert np.hypot(east - PLACE[0], north - PLACE[1]) < 2e-3
    assert targets[1]["properties"]["reason"] == UNSEEN["reason"]
    assert [line["geometry"]["type"] for line in lines] == ["LineString"] * 2
    assert lines[0]["properties"]["mean_correction"] is None  # without the recorded trajectory
    start = back.transform(*lines[0]["geometry"]["coordinates"][0])
    assert np.abs(start - with_gap()[1].position[0, :2]).max() < 2e-3


def test_a_compound_crs_is_kept_whole(tmp_path):
    "UTM with heights above a geoid has no single code: its definition names both parts"
    export_targets(tmp_path / "t.gpkg", [SEEN], {}, "EPSG:32650+5773")
    (row,) = (
        row
        for row in table_of(tmp_path / "t.gpkg", "gpkg_spatial_ref_sys")
        if row["srs_id"] == 100_000
    )
    assert "COMPD_CS" in row["definition"] and "5773" in row["definition"]
    (target,) = table_of(tmp_path / "t.gpkg", "targets")
    assert places_of(target["geom"])[0] == 100_000


def test_layers_that_can_not_be_written_are_refused_before_the_work():
    "Folders, unknown suffixes, a survey without a CRS, one file twice, a result's own name"
    for name in ("a/t.gpkg", "t.shp", "weak.geojson"):
        with pytest.raises(ValueError, match=f"^--targets {name}: give a file name"):
            check_target_exports([name])
    check_target_exports(["t.gpkg", "t.geojson"], CRS, is_read=True)
    check_exports(["d.gpkg", "d.geojson"], CRS, is_read=True)
    for check in (check_exports, check_target_exports):
        with pytest.raises(ValueError, match=r"needs the CRS of a\.gpkg: set crs in survey\.toml"):
            check(["a.gpkg"], None, is_read=True)
    with pytest.raises(ValueError, match=r"a\.gpkg is requested twice"):
        check_distinct(["a.gpkg", "b.gpkg", "a.gpkg"])
