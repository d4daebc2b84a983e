"""Points and lines for a GIS: GeoPackage in the survey's CRS, GeoJSON in WGS 84 (RFC 7946).

A GeoPackage is an SQLite file with three tables of its own (OGC 12-128r19), which a page of code
with Python's standard library can write. GDAL's bindings could do it, too, but would add a second
PROJ and 100 MB for these two layers.
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
OWN_SRS = 100_000  # number of a CRS without a code, as in GDAL
WKB = {"POINT": 1001, "LINESTRING": 1002}  # types with Z, ISO 13249-3
TYPES = {bool: "BOOLEAN", int: "INTEGER", float: "DOUBLE", str: "TEXT"}
VERTEX = 1.0  # m along the path between vertices of a line, as in weak.geojson
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
    """Features of one kind, with the same attributes.

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
        Attributes of each feature; None if unknown.
    """

    name: str
    kind: str
    geometry: Sequence[np.ndarray]
    types: dict[str, type]
    rows: Sequence[dict[str, Any]]


def write_features(path: str | Path, layers: Sequence[FeatureLayer], crs: str) -> None:
    """Write layers in the format of the suffix; the file is written atomically.

    A GeoPackage has one table per layer, with E, N, H in the survey's CRS. A GeoJSON has only the
    first layer, in longitude and latitude in WGS 84, transformed by pyproj; heights are attributes,
    because those of RFC 7946 are ellipsoidal.

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
    """Convert map positions (k, 2 or 3) to longitude and latitude (k, 2) in WGS 84. Units: deg.

    Parameters
    ----------
    crs : CRS
    position : (k, 2) or (k, 3) array
        E, N. Units: m.
    """
    to_degrees = Transformer.from_crs(crs.to_2d(), "EPSG:4326", always_xy=True)
    return np.round(np.column_stack(to_degrees.transform(*position[:, :2].T)), DIGITS)


def _collection(layer, crs):
    """Layer as a FeatureCollection of RFC 7946."""
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
    """Write the survey's CRS and those of every GeoPackage; return the number of the former."""
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
    """Geometry in GeoPackage format: a header without an envelope, and ISO WKB with Z."""
    head = b"GP" + struct.pack("<BBi", 0, 1, number) + struct.pack("<BI", 1, WKB[kind])
    if kind == "LINESTRING":
        head += struct.pack("<I", len(place))
    return head + np.ascontiguousarray(place, "<f8").tobytes()


def target_layer(rows: Sequence[dict[str, Any]], kinds: dict[str, str]) -> FeatureLayer:
    """Make a layer of surveyed points at their surveyed positions, a point for each pass.

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
    """Make a line for each gap-free segment with a vertex per meter, and a point each second.

    Parameters
    ----------
    trajectory : Trajectory
        Corrected trajectory.
    recorded : Trajectory, optional
        With the same epochs; needed for the correction.
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
    """Positions of a line, and its attributes; sigma and correction are 3D, in m."""
    place = trajectory.position[rows]
    chainage = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(place, axis=0), axis=1)))
    kept = np.flatnonzero(np.diff(np.floor(chainage / VERTEX), prepend=-1) > 0)
    kept = np.union1d(kept, [0, len(place) - 1])
    numbers = [number, *trajectory.gps_time[rows[[0, -1]]].tolist(), float(chainage[-1])]
    for vectors in (sigma, change):
        size = np.linalg.norm(vectors[rows], axis=1)
        numbers += [_finite(float(size.mean())), _finite(float(size.max()))]
    return place[kept], dict(zip(LINE, numbers, strict=True))


def _finite(value):
    """Finite number, otherwise None."""
    if value is None or not math.isfinite(value):
        return None
    return float(value)
