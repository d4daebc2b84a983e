"""Trajectories for other programs: SBET with its smrmsg, and TUM."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mlscorr.frames import angles_from_attitude
from mlscorr.io.store import output_file
from mlscorr.io.trajectories.projection import check_crs, to_geographic
from mlscorr.io.trajectories.sbet import SBET_FIELDS, SMRMSG_FIELDS
from mlscorr.survey import Trajectory

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

    Velocities, accelerations, rates and the wander angle of an SBET are zero. Beside it stands
    smrmsg_NAME.out, where the trajectory has sigmas: at each epoch, for a second is long beside a
    target. TUM's quaternions are of the body axes right, forward, up.

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
    _write_records(path, SBET_FIELDS, {"gps_time": trajectory.file_time, **place, **angles})
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
