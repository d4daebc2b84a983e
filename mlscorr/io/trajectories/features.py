"""Points and lines for a GIS: GeoPackage in the survey's CRS, GeoJSON in WGS 84 (RFC 7946).

A GeoPackage is an SQLite file with three tables of its own (OGC 12-128r19), which Python's standard
library writes in a page of code. GDAL's bindings would write it too, but bring a second PROJ and
100 MB beside pyproj's for these two layers.
"""

import json
import math
import sqlite3
import struct
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pyproj import CRS, Transformer

from mlscorr.io.store import output_file
from mlscorr.io.trajectories.projection import check_crs, crs_code
from mlscorr.survey import AXES, Trajectory

GEOPACKAGE = ".gpkg"
GEOJSON = ".geojson"
FEATURE_SUFFIXES = (GEOPACKAGE, GEOJSON)
APPLICATION = 0x47504B47  # "GPKG", which marks the SQLite file
VERSION = 10300  # GeoPackage 1.3.0
OWN_SRS = 100_000  # number of a CRS without a code of its own, as GDAL counts them
WKB = {"POINT": 1001, "LINESTRING": 1002}  # types with Z, ISO 13249-3
TYPES = {bool: "BOOLEAN", int: "INTEGER", float: "DOUBLE", str: "TEXT"}
VERTEX = 1.0  # m of the way between vertices of a line, as in weak.geojson
DIGITS = 8  # of degrees: 1 mm
TARGET_VECTORS = ("surveyed", "observed", "sigma", "before", "after")
TABLES = """
CREATE TABLE gpkg_spatial_ref_sys (srs_name TEXT NOT NULL, srs_id INTEGER PRIMARY KEY,
  organization TEXT NOT NULL, organization_coordsys_id INTEGER NOT NULL,
  definition TEXT NOT NULL, description TEXT);
CREATE TABLE gpkg_contents (table_name TEXT PRIMARY KEY, data_type TEXT NOT NULL,
  identifier TEXT UNIQUE, description TEXT DEFAULT '',
  last_change DATETIME NOT NULL DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ', 'now')),
  min_x DOUBLE, min_y DOUBLE, max_x DOUBLE, max_y DOUBLE,
  srs_id INTEGER REFERENCES gpkg_spatial_ref_sys(srs_id));
CREATE TABLE gpkg_geometry_columns (
  table_name TEXT PRIMARY KEY REFERENCES gpkg_contents(table_name), column_name TEXT NOT NULL,
  geometry_type_name TEXT NOT NULL,
  srs_id INTEGER NOT NULL REFERENCES gpkg_spatial_ref_sys(srs_id),
  z TINYINT NOT NULL, m TINYINT NOT NULL);
"""


@dataclass(frozen=True)
class FeatureLayer:
    """Features of one kind, with the same attributes each.

    Parameters
    ----------
    name : str
    kind : str
        ``POINT`` or ``LINESTRING``.
    geometry : sequence of (k, 3) array
        E, N, H of each feature. Units: m.
    types : dict
        Type of each attribute, bool, int, float or str, by its name.
    rows : sequence of dict
        Attributes of each feature; None where one is not known.
    """

    name: str
    kind: str
    geometry: Sequence[np.ndarray]
    types: dict[str, type]
    rows: Sequence[dict[str, Any]]


def write_features(path: str | Path, layers: Sequence[FeatureLayer], crs: str) -> None:
    """Write layers as the suffix says; the file appears whole or not at all.

    A GeoPackage has one table a layer, with E, N, H in the survey's CRS. A GeoJSON has the first
    layer alone, in longitude and latitude by WGS 84, into which pyproj transforms; heights stand in
    its attributes, as those of RFC 7946 are above the ellipsoid.

    Parameters
    ----------
    path : path
        ``.gpkg`` or ``.geojson``.
    layers : sequence of FeatureLayer
    crs : str
        See check_crs.
    """
    path = Path(path)
    projected = check_crs(crs)
    with output_file(path) as part:
        if path.suffix.lower() == GEOPACKAGE:
            with closing(sqlite3.connect(part)) as package, package:
                _fill(package, layers, projected)
        else:
            text = json.dumps(_collection(layers[0], projected), allow_nan=False)
            part.write_text(text + "\n", encoding="utf-8")


def to_lonlat(crs: CRS, position: np.ndarray) -> np.ndarray:
    """Longitude and latitude (k, 2) by WGS 84 of places (k, 2 or 3) on the map. Units: deg.

    Parameters
    ----------
    crs : CRS
    position : (k, 2) or (k, 3) array
        E, N. Units: m.
    """
    to_degrees = Transformer.from_crs(crs.to_2d(), "EPSG:4326", always_xy=True)
    return np.round(np.column_stack(to_degrees.transform(*position[:, :2].T)), DIGITS)


def _collection(layer, crs):
    """A layer as a FeatureCollection of RFC 7946."""
    features = []
    for place, row in zip(layer.geometry, layer.rows, strict=True):
        coordinates = to_lonlat(crs, place).tolist()
        if layer.kind == "POINT":
            geometry = {"type": "Point", "coordinates": coordinates[0]}
        else:
            geometry = {"type": "LineString", "coordinates": coordinates}
        features.append({"type": "Feature", "properties": row, "geometry": geometry})
    return {"type": "FeatureCollection", "features": features}


def _fill(package, layers, crs):
    """Write the tables of a GeoPackage."""
    package.execute(f"PRAGMA application_id = {APPLICATION}")
    package.execute(f"PRAGMA user_version = {VERSION}")
    package.executescript(TABLES)
    number = _state_crs(package, crs)
    for layer in layers:
        columns = "".join(f', "{name}" {TYPES[kind]}' for name, kind in layer.types.items())
        package.execute(
            f'CREATE TABLE "{layer.name}" (fid INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, '
            f"geom {layer.kind}{columns})"
        )
        corners = [None] * 4
        if layer.geometry:
            places = np.vstack(layer.geometry)[:, :2]
            corners = [*places.min(axis=0).tolist(), *places.max(axis=0).tolist()]
        package.execute(
            "INSERT INTO gpkg_contents (table_name, data_type, identifier, min_x, min_y, max_x, "
            "max_y, srs_id) VALUES (?, 'features', ?, ?, ?, ?, ?, ?)",
            (layer.name, layer.name, *corners, number),
        )
        package.execute(
            "INSERT INTO gpkg_geometry_columns VALUES (?, 'geom', ?, ?, 1, 0)",
            (layer.name, layer.kind, number),
        )
        marks = ", ".join("?" * (2 + len(layer.types)))
        package.executemany(
            f'INSERT INTO "{layer.name}" VALUES ({marks})',
            (
                (None, _blob(layer.kind, place, number), *(row[name] for name in layer.types))
                for place, row in zip(layer.geometry, layer.rows, strict=True)
            ),
        )


def _state_crs(package, crs):
    """Write the survey's CRS and those that every GeoPackage has; the number of the former."""
    authority, _, code = (crs_code(crs) or "").partition(":")
    if authority == "EPSG" and code.isdigit():
        number = int(code)
        owner = ("EPSG", number)
    else:  # a compound CRS has two codes
        number = OWN_SRS
        owner = ("NONE", OWN_SRS)
    wgs84 = CRS("EPSG:4326").to_wkt("WKT1_GDAL")
    rows = [
        ("Undefined Cartesian SRS", -1, "NONE", -1, "undefined", None),
        ("Undefined geographic SRS", 0, "NONE", 0, "undefined", None),
        ("WGS 84", 4326, "EPSG", 4326, wgs84, None),
        (crs.name, number, *owner, crs.to_wkt("WKT1_GDAL"), None),
    ]
    package.executemany("INSERT INTO gpkg_spatial_ref_sys VALUES (?, ?, ?, ?, ?, ?)", rows)
    return number


def _blob(kind, place, number):
    """A geometry as GeoPackage has it: a head without an envelope, and ISO WKB with Z."""
    head = b"GP" + struct.pack("<BBi", 0, 1, number) + struct.pack("<BI", 1, WKB[kind])
    if kind == "LINESTRING":
        head += struct.pack("<I", len(place))
    return head + np.ascontiguousarray(place, "<f8").tobytes()


def target_layer(rows: Sequence[dict[str, Any]], kinds: dict[str, str]) -> FeatureLayer:
    """Surveyed points as a layer: where they were surveyed, a point for each pass.

    Parameters
    ----------
    rows : sequence of dict
        ``targets`` of report.json.
    kinds : dict
        Kind of each surveyed point by its name.
    """
    types: dict[str, type] = {"name": str, "pass": int, "gps_time": float, "role": str, "kind": str}
    types |= {f"{vector}_{axis}": float for vector in TARGET_VECTORS for axis in AXES}
    types |= {"used": bool, "reason": str}
    places = []
    features = []
    for row in rows:
        place = row["surveyed"] or row["observed"]
        if place is None:
            continue
        values = {name: row.get(name) for name in types}
        values["kind"] = kinds.get(row["name"])
        for vector in TARGET_VECTORS:
            parts = row[vector] or (None,) * len(AXES)
            names = (f"{vector}_{axis}" for axis in AXES)
            values |= dict(zip(names, map(_finite, parts), strict=True))
        places.append(np.array([place], float))
        features.append(values)
    return FeatureLayer("targets", "POINT", places, types, features)


def trajectory_layers(
    trajectory: Trajectory, recorded: Trajectory | None = None
) -> list[FeatureLayer]:
    """A line for each part between gaps with a vertex a meter, and a point each second.

    Parameters
    ----------
    trajectory : Trajectory
        The corrected one.
    recorded : Trajectory, optional
        With the same epochs; the correction is not known without.
    """
    sigma = np.full((len(trajectory), 3), np.nan)
    if trajectory.position_sigma is not None:
        sigma = trajectory.position_sigma
    change = np.full((len(trajectory), 3), np.nan)
    if recorded is not None:
        change = trajectory.position - recorded.position
    segment = trajectory.segment(trajectory.gps_time)
    parts = [np.flatnonzero(segment == number) for number in np.unique(segment)]
    parts = [rows for rows in parts if len(rows) > 1]
    lines = [_line(number, trajectory, sigma, change, rows) for number, rows in enumerate(parts, 1)]
    names = ("gps_time", *(f"{name}_{axis}" for name in ("sigma", "correction") for axis in AXES))
    second = np.floor(trajectory.gps_time)
    first = np.flatnonzero(np.diff(second, prepend=second[0] - 1) > 0)
    values = np.column_stack([trajectory.gps_time, sigma, change])[first]
    points = [dict(zip(names, map(_finite, row), strict=True)) for row in values.tolist()]
    return [
        FeatureLayer(
            "trajectory", "LINESTRING", [place for place, _ in lines], LINE, [r for _, r in lines]
        ),
        FeatureLayer(
            "seconds",
            "POINT",
            list(trajectory.position[first][:, None]),
            dict.fromkeys(names, float),
            points,
        ),
    ]


LINE: dict[str, type] = {
    "part": int,
    "from": float,
    "to": float,
    "length_m": float,
    "mean_sigma": float,
    "largest_sigma": float,
    "mean_correction": float,
    "largest_correction": float,
}


def _line(number, trajectory, sigma, change, rows):
    """Places of a line, and its attributes; sigma and correction are 3D, in m."""
    place = trajectory.position[rows]
    way = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(place, axis=0), axis=1)))
    kept = np.flatnonzero(np.diff(np.floor(way / VERTEX), prepend=-1) > 0)
    kept = np.union1d(kept, [0, len(place) - 1])
    numbers = [number, *trajectory.gps_time[rows[[0, -1]]].tolist(), float(way[-1])]
    for vectors in (sigma, change):
        size = np.linalg.norm(vectors[rows], axis=1)
        numbers += [_finite(float(size.mean())), _finite(float(size.max()))]
    return place[kept], dict(zip(LINE, numbers, strict=True))


def _finite(value):
    """A number, None for what is none."""
    if value is None or not math.isfinite(value):
        return None
    return float(value)
