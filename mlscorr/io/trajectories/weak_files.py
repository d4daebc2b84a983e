"""The weak stretches of a correction as files that a GIS or a spreadsheet opens."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from pyproj import Transformer

from mlscorr.io.tables import write_csv
from mlscorr.io.trajectories.projection import check_crs
from mlscorr.survey import AXES, Trajectory


def write_weak(
    folder: Path, stretches: Sequence[dict[str, Any]], trajectory: Trajectory, crs: str | None
) -> list[str]:
    """Write weak.csv, and weak.geojson where the CRS is known, into a folder.

    Parameters
    ----------
    folder : Path
    stretches : sequence of dict
        ``weak[]`` of report.json.
    trajectory : Trajectory
        The corrected one, in which every stretch lies.
    crs : str or None

    Returns
    -------
    list of str
        Names of the files.
    """
    names = [f"{axis}_{end}" for end in ("from", "to") for axis in AXES]
    rows = [("from", "to", "chainage_from", "chainage_to", "length_m", "sigma", *names, "why")]
    for row in stretches:
        times = [row["from"], row["to"]]
        lengths = row["chainage"], row["chainage"] + row["length_m"], row["length_m"]
        cells = [f"{value:.3f}" for value in times] + [f"{value:.1f}" for value in lengths]
        ends = [f"{value:.3f}" for value in trajectory.at(times).position.ravel()]
        rows.append((*cells, f"{row['sigma']:.4f}", *ends, row["why"]))
    write_csv(folder / "weak.csv", rows)
    if crs is None:
        return ["weak.csv"]
    text = json.dumps(_features(stretches, trajectory, crs), allow_nan=False)
    (folder / "weak.geojson").write_text(text + "\n", encoding="utf-8")
    return ["weak.csv", "weak.geojson"]


def _features(stretches, trajectory, crs):
    """A line for each stretch: RFC 7946, so longitude and latitude by WGS 84."""
    to_degrees = Transformer.from_crs(check_crs(crs).to_2d(), "EPSG:4326", always_xy=True)
    features = []
    for row in stretches:
        count = 2 + int(row["length_m"])  # a vertex a metre
        position = trajectory.at(np.linspace(row["from"], row["to"], count)).position
        line = np.round(np.column_stack(to_degrees.transform(*position[:, :2].T)), 8)  # 1 mm
        geometry = {"type": "LineString", "coordinates": line.tolist()}
        features.append({"type": "Feature", "properties": dict(row), "geometry": geometry})
    return {"type": "FeatureCollection", "features": features}
