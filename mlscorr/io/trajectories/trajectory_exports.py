"""Trajectories for other programs, as SBET with its smrmsg and as TUM, and their weak stretches."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from pyproj import Transformer

from mlscorr.frames import angles_from_attitude, attitude_from_angles
from mlscorr.io.store import output_file
from mlscorr.io.tables import write_csv
from mlscorr.io.trajectories._motion import motion_columns
from mlscorr.io.trajectories.projection import check_crs, to_geographic
from mlscorr.io.trajectories.sbet import SBET_FIELDS, SMRMSG_FIELDS
from mlscorr.survey import AXES, Trajectory

SUFFIXES = (".sbet", ".out", ".tum")


def check_exports(names: Sequence[str], crs: str | None = None, is_read: bool = False) -> None:
    """Refuse names of files that can't be written beside the results.

    Parameters
    ----------
    names : sequence of str
    crs : str, optional
        Of the survey, which an SBET needs.
    is_read : bool
        Whether the survey is read, so that it has a crs or has none.

    Raises
    ------
    ValueError
        For folders, unknown suffixes, and an SBET without a crs.
    """
    for name in names:
        suffix = Path(name).suffix.lower()
        if Path(name).name != name or suffix not in SUFFIXES:
            raise ValueError(
                f"--trajectory {name}: give the name of a file without a folder, which ends with "
                f"{', '.join(SUFFIXES[:-1])} (SBET) or {SUFFIXES[-1]} (TUM)."
            )
        if is_read and suffix != SUFFIXES[-1]:
            if crs is None:
                raise ValueError(f"An SBET ({name}) is geographic: set crs in survey.toml.")
            check_crs(crs)


def export_trajectory(path: str | Path, trajectory: Trajectory, crs: str | None) -> list[str]:
    """Write a trajectory as its suffix says; files appear whole or not at all.

    The wander angle of an SBET is zero: its velocities are north, west, up. Velocities, and
    accelerations and rates about the body axes forward, right, down, are derivatives of the
    trajectory, which cross no gap. Beside it stands smrmsg_NAME.out, where the trajectory has
    sigmas: at each epoch, for a second is long beside a target. TUM's quaternions are of the body
    axes right, forward, up.

    Parameters
    ----------
    path : path
    trajectory : Trajectory
    crs : str or None
        Needed for an SBET.

    Returns
    -------
    list of str
        Names of the files.

    Raises
    ------
    ValueError
        For a crs that can't be left for latitude and longitude.
    """
    path = Path(path)
    if path.suffix.lower() == SUFFIXES[-1]:
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
    """Records of float64, zero where a field is not given."""
    table = np.zeros((len(columns["gps_time"]), len(fields)), "<f8")
    for name, values in columns.items():
        table[:, fields.index(name)] = values
    with output_file(path) as part:
        table.tofile(part)


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
