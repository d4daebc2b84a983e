"""Simulated clouds of a survey: a survey folder, a folder of files, or a file."""

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np

from mlscorr.io.clouds import crs_conflict, read_layout
from mlscorr.io.surveys.survey_file import FILE_NAME, cloud_file, read_survey
from mlscorr.survey import Survey

SUFFIXES = (".las", ".laz")
NEAREST = 1.0  # m between two trajectories of one survey: ten times a typical POS error


def simulated_survey(path: Path | str, survey: Survey) -> Survey:
    """Return the survey with the simulated clouds instead of its own.

    Parameters
    ----------
    path : path
        survey.toml or its folder, a folder with LAS or LAZ files, or such a file.
    survey : Survey
        Survey that was simulated.

    Raises
    ------
    ValueError
        For clouds of another time, trajectory or CRS.
    FileNotFoundError
        If there are none.
    """
    path = Path(path)
    clouds = _clouds_of(path, survey)
    if survey.crs is not None:
        for cloud in clouds:
            if conflict := crs_conflict(read_layout(cloud), survey.crs):
                raise ValueError(
                    f"Transform the simulated clouds to the CRS of the survey. {conflict}"
                )
    with warnings.catch_warnings(action="ignore"):  # of the CRS, which agrees
        try:
            given = survey.trajectory, "auto", survey.crs, None, survey.clouds[0].noise_classes
            files = [cloud_file(cloud, *given)[0] for cloud in clouds]
        except ValueError as error:
            raise ValueError(
                f"The simulated clouds of {path} can't be compared; change their times, not "
                f"survey.toml. {error}"
            ) from None
    return replace(survey, name=path.name, path=path, clouds=tuple(files))


def _clouds_of(path, survey):
    """Paths of the simulated cloud files."""
    if path.name == FILE_NAME or (path / FILE_NAME).is_file():
        simulated = read_survey(path)
        _check_crs(simulated, survey)
        _check_trajectory(simulated, survey)
        return simulated.cloud_paths
    if not path.exists():
        raise FileNotFoundError(
            f"{path} does not exist. Give the simulated clouds or their folder."
        )
    files = [path] if path.is_file() else sorted(path.iterdir())
    clouds = [file for file in files if file.suffix.lower() in SUFFIXES]
    if not clouds:
        raise FileNotFoundError(f"{path} contains no LAS or LAZ file and no {FILE_NAME}.")
    return clouds


def _check_crs(simulated, survey):
    if None not in (simulated.crs, survey.crs) and simulated.crs != survey.crs:
        raise ValueError(
            f"{simulated.path} is in {simulated.crs}, {survey.path} in {survey.crs}. Simulate in "
            "the CRS of the survey."
        )


def _check_trajectory(simulated, survey):
    """Refuse a simulated survey that was driven elsewhere or at other times."""
    recorded = survey.trajectory
    other = simulated.trajectory
    inside = other.gps_time[recorded.segment(other.gps_time) >= 0]
    if len(inside) < 0.5 * len(other):
        start, end = other.gps_time[[0, -1]]
        first, last = recorded.gps_time[[0, -1]]
        raise ValueError(
            f"{simulated.path} is a simulation of another survey: its trajectory covers "
            f"{start:.1f} to {end:.1f} s, that of {survey.path} {first:.1f} to {last:.1f} s."
        )
    offset = other.at(inside).position - recorded.at(inside).position
    distance = float(np.median(np.linalg.norm(offset, axis=1)))
    if distance > NEAREST:
        raise ValueError(
            f"{simulated.path} is a simulation of another survey, or in another CRS: the median "
            f"distance of its trajectory from that of {survey.path} is {distance:.1f} m."
        )
