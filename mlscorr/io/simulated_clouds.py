"""Clouds that a simulator made of a survey: a survey folder, a folder of files, or a file."""

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np

from mlscorr.correction import Correction
from mlscorr.io.las_checks import read_layout
from mlscorr.io.las_crs import crs_conflict
from mlscorr.io.survey_file import FILE_NAME, cloud_file, read_survey
from mlscorr.survey import Survey, Trajectory

SUFFIXES = (".las", ".laz")
NEAREST = 1.0  # m between two trajectories of one survey: ten times a usual POS's error


def simulated_survey(path: Path | str, survey: Survey) -> tuple[Survey, Correction]:
    """The survey with simulated clouds instead of its own, and what puts these on its trajectory.

    A simulated POS errs in its own way, which is slow and common to all points, so that no
    resampling of the cloud shows it: as the survey's trajectory puts them, points of twins differ
    by the scanner's noise alone. Clouds without a trajectory of their own stay where they are.

    Parameters
    ----------
    path : path
        survey.toml or its folder, a folder with LAS or LAZ files, or such a file.
    survey : Survey
        Of which they are simulated.

    Raises
    ------
    ValueError
        For clouds of another time, trajectory or CRS.
    FileNotFoundError
        Where there are none.
    """
    path = Path(path)
    clouds, trajectory = _clouds_of(path, survey)
    if survey.crs is not None:
        for cloud in clouds:
            if conflict := crs_conflict(read_layout(cloud), survey.crs):
                raise ValueError(f"The simulated clouds can't be compared. {conflict}")
    with warnings.catch_warnings(action="ignore"):  # of the CRS, which agrees
        files = [cloud_file(cloud, survey.trajectory, "auto", survey.crs)[0] for cloud in clouds]
    placed = Correction(trajectory, survey.trajectory.at(trajectory.gps_time))
    return replace(survey, name=path.name, path=path, clouds=tuple(files)), placed


def _clouds_of(path, survey):
    """Paths of the simulated cloud files, and their Trajectory within the survey's."""
    if path.name == FILE_NAME or (path / FILE_NAME).is_file():
        simulated = read_survey(path)
        return simulated.cloud_paths, _shared_trajectory(simulated, survey)
    if not path.exists():
        raise FileNotFoundError(f"{path} does not exist; give the simulated clouds, or a folder.")
    files = [path] if path.is_file() else sorted(path.iterdir())
    clouds = [file for file in files if file.suffix.lower() in SUFFIXES]
    if not clouds:
        raise FileNotFoundError(
            f"{path} holds no LAS or LAZ file and no {FILE_NAME}: nothing was simulated there."
        )
    return clouds, survey.trajectory


def _shared_trajectory(simulated, survey) -> Trajectory:
    """The simulated trajectory within the survey's; refused in another CRS, place or time."""
    if None not in (simulated.crs, survey.crs) and simulated.crs != survey.crs:
        raise ValueError(
            f"{simulated.path} is in {simulated.crs}, {survey.path} in {survey.crs}: simulate in "
            "the survey's CRS."
        )
    recorded, other = survey.trajectory, simulated.trajectory
    shared = other.select(recorded.segment(other.gps_time) >= 0)
    if len(shared) < 0.5 * len(other):
        start, end = other.gps_time[[0, -1]]
        first, last = recorded.gps_time[[0, -1]]
        raise ValueError(
            f"{simulated.path} simulates another survey: its trajectory runs from {start:.1f} to "
            f"{end:.1f} s, that of {survey.path} from {first:.1f} to {last:.1f} s."
        )
    apart = shared.position - recorded.at(shared.gps_time).position
    distance = float(np.median(np.linalg.norm(apart, axis=1)))
    if distance > NEAREST:
        raise ValueError(
            f"{simulated.path} simulates another survey, or is in another CRS: its trajectory lies "
            f"{distance:.1f} m from that of {survey.path} in the median."
        )
    return shared
