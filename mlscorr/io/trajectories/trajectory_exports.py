"""Exports for other programs: SBET with its smrmsg, TUM, and layers for a GIS."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mlscorr.frames import angles_from_attitude, attitude_from_angles
from mlscorr.io.store import output_file
from mlscorr.io.tables import write_csv
from mlscorr.io.trajectories._motion import motion_columns
from mlscorr.io.trajectories.features import (
    FEATURE_SUFFIXES,
    GEOJSON,
    target_layer,
    to_lonlat,
    trajectory_layers,
    write_features,
)
from mlscorr.io.trajectories.projection import check_crs, to_geographic
from mlscorr.io.trajectories.sbet import SBET_FIELDS, SMRMSG_FIELDS
from mlscorr.survey import AXES, Trajectory

SUFFIXES = (".sbet", ".out", ".tum", *FEATURE_SUFFIXES)
TUM = ".tum"
WEAK_INTERVALS = "weak.geojson"  # is always written


def check_exports(names: Sequence[str], crs: str | None = None, is_read: bool = False) -> None:
    """Refuse names of files that cannot be written next to the results.

    Parameters
    ----------
    names : sequence of str
    crs : str, optional
        CRS of the survey, required for all except TUM.
    is_read : bool
        True if the survey is read, so that its crs is known.

    Raises
    ------
    ValueError
        For folders, unknown suffixes, and all except TUM without a crs.
    """
    for name in names:
        suffix = _suffix(name, "--trajectory", SUFFIXES, ".sbet, .out (SBET), .tum (TUM)")
        if is_read and suffix != TUM:
            _require_crs(name, suffix, crs)


def check_target_exports(
    names: Sequence[str], crs: str | None = None, is_read: bool = False
) -> None:
    """Refuse names of files for targets that cannot be written next to the results.

    Parameters
    ----------
    names, crs, is_read
        See check_exports.

    Raises
    ------
    ValueError
        For folders, unknown suffixes, and a survey without a crs.
    """
    for name in names:
        suffix = _suffix(name, "--targets", FEATURE_SUFFIXES)
        if is_read:
            _require_crs(name, suffix, crs)


def check_distinct(names: Sequence[str]) -> None:
    """Refuse names of exports if one file would replace another.

    Parameters
    ----------
    names : sequence of str
        All requested names.

    Raises
    ------
    ValueError
    """
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ValueError(
            f"{twice[0]} is requested twice, so one file would replace the other. Give each "
            "export its own name."
        )


def _suffix(name, option, known, others=""):
    """Suffix of an export's name, if it can be written."""
    suffix = Path(name).suffix.lower()
    if Path(name).name != name or suffix not in known or name.lower() == WEAK_INTERVALS:
        kinds = ", ".join(filter(None, [others, "or .gpkg (GeoPackage)"]))
        raise ValueError(
            f"{option} {name}: give a file name without a folder that ends with "
            f"{kinds.removeprefix('or ')} or {GEOJSON} (GeoJSON), other than {WEAK_INTERVALS}."
        )
    return suffix


def _require_crs(name, suffix, crs):
    """Refuse formats that require a valid CRS if the survey has none."""
    if crs is None and suffix in FEATURE_SUFFIXES:
        raise ValueError(f"A GIS needs the CRS of {name}: set crs in survey.toml.")
    if crs is None:
        raise ValueError(f"An SBET ({name}) is geographic: set crs in survey.toml.")
    check_crs(crs)


def export_targets(
    path: str | Path, targets: Sequence[dict[str, Any]], kinds: dict[str, str], crs: str
) -> list[str]:
    """Write surveyed points as a GeoPackage or GeoJSON, depending on the suffix.

    Parameters
    ----------
    path : path
    targets : sequence of dict
        ``targets`` of report.json.
    kinds : dict
        Kind of each surveyed point by its name.
    crs : str

    Returns
    -------
    list of str
        Name of the file.
    """
    write_features(path, [target_layer(targets, kinds)], crs)
    return [Path(path).name]


def export_trajectory(
    path: str | Path,
    trajectory: Trajectory,
    crs: str | None,
    recorded: Trajectory | None = None,
) -> list[str]:
    """Write a trajectory in the format of its suffix; files are written atomically.

    The wander angle of an SBET is zero: its velocities are north, west, up. Velocities, and
    accelerations and rates about the body axes forward, right, down, are derivatives of the
    trajectory, which do not cross gaps. smrmsg_NAME.out is added if the trajectory has sigmas, with
    one row per epoch, because a second is too long near a target. TUM's quaternions refer to the
    body axes right, forward, up.

    Parameters
    ----------
    path : path
    trajectory : Trajectory
    crs : str or None
        Required for all except TUM.
    recorded : Trajectory, optional
        With the same epochs; adds the size of the correction to a GeoPackage or GeoJSON.

    Returns
    -------
    list of str
        Names of the files.

    Raises
    ------
    ValueError
        If the crs cannot be converted to latitude and longitude.
    """
    path = Path(path)
    if path.suffix.lower() in FEATURE_SUFFIXES:
        write_features(path, trajectory_layers(trajectory, recorded), crs)
        return [path.name]
    if path.suffix.lower() == TUM:
        table = trajectory.file_time, trajectory.position, trajectory.attitude.as_quat()
        with output_file(path) as part:
            np.savetxt(part, np.column_stack(table), fmt=["%.6f"] + ["%.5f"] * 3 + ["%.10f"] * 4)
        return [path.name]
    place, convergence = to_geographic(crs, trajectory.position)
    roll, pitch, heading = angles_from_attitude(trajectory.attitude)
    true_heading = np.mod(heading + convergence, 2 * np.pi)
    angles = dict(zip(("roll", "pitch", "heading"), (roll, pitch, true_heading), strict=True))
    true_attitude = attitude_from_angles(roll, pitch, true_heading)
    motion = motion_columns(trajectory, place, true_attitude, check_crs(crs))
    columns = {"gps_time": trajectory.file_time, **place, **angles, **motion}
    _write_records(path, SBET_FIELDS, columns)
    if trajectory.position_sigma is None or trajectory.attitude_sigma is None:
        return [path.name]
    sigmas = np.hstack([trajectory.position_sigma, np.degrees(trajectory.attitude_sigma) * 60])
    names = ("east", "north", "down", "roll", "pitch", "heading")  # m, arc-minutes
    columns = dict(zip(names, sigmas.T, strict=True))
    companion = path.with_name(f"smrmsg_{path.stem}.out")
    _write_records(companion, SMRMSG_FIELDS, {"gps_time": trajectory.file_time, **columns})
    return [path.name, companion.name]


def _write_records(path, fields, columns):
    """Write records of float64, with zero for missing fields."""
    table = np.zeros((len(columns["gps_time"]), len(fields)), "<f8")
    for name, values in columns.items():
        table[:, fields.index(name)] = values
    with output_file(path) as part:
        table.tofile(part)


def write_weak(
    folder: Path, intervals: Sequence[dict[str, Any]], trajectory: Trajectory, crs: str | None
) -> list[str]:
    """Write weak.csv into a folder, and weak.geojson if the CRS is known.

    Parameters
    ----------
    folder : Path
    intervals : sequence of dict
        ``weak[]`` of report.json.
    trajectory : Trajectory
        Corrected trajectory, which contains all intervals.
    crs : str or None

    Returns
    -------
    list of str
        Names of the files.
    """
    names = [f"{axis}_{end}" for end in ("from", "to") for axis in AXES]
    rows = [("from", "to", "chainage_from", "chainage_to", "length_m", "sigma", *names, "why")]
    for row in intervals:
        times = [row["from"], row["to"]]
        lengths = row["chainage"], row["chainage"] + row["length_m"], row["length_m"]
        cells = [f"{value:.3f}" for value in times] + [f"{value:.1f}" for value in lengths]
        ends = [f"{value:.3f}" for value in trajectory.at(times).position.ravel()]
        rows.append((*cells, f"{row['sigma']:.4f}", *ends, row["why"]))
    write_csv(folder / "weak.csv", rows)
    if crs is None:
        return ["weak.csv"]
    text = json.dumps(_features(intervals, trajectory, crs), allow_nan=False)
    (folder / "weak.geojson").write_text(text + "\n", encoding="utf-8")
    return ["weak.csv", "weak.geojson"]


def _features(intervals, trajectory, crs):
    """Line features of all intervals, in longitude and latitude in WGS 84 (RFC 7946)."""
    features = []
    for row in intervals:
        count = 2 + int(row["length_m"])  # a vertex per meter
        position = trajectory.at(np.linspace(row["from"], row["to"], count)).position
        line = to_lonlat(check_crs(crs), position)
        geometry = {"type": "LineString", "coordinates": line.tolist()}
        features.append({"type": "Feature", "properties": dict(row), "geometry": geometry})
    return {"type": "FeatureCollection", "features": features}
