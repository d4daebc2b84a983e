"""Surveyed points of a survey: read, scaled if in ground distances, and near its drive."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from mlscorr.io.tables import (
    NOTHING_SURVEYED,
    ControlList,
    ControlSection,
    check_together,
    holds_points,
    read_control,
)
from mlscorr.io.trajectories import map_factors
from mlscorr.survey import SurveyFileError, Trajectory


def read_surveyed(
    path: Path | None, section: ControlSection, trajectory: Trajectory, crs: str | None = None
) -> ControlList:
    """Points of a list that lies near a trajectory; none of none, and of an empty file.

    Parameters
    ----------
    path : Path or None
    section : ControlSection
    trajectory : Trajectory
    crs : str, optional
        Of the survey, for control in ground distances.

    Raises
    ------
    ValueError
        As of read_control and check_together.
    """
    if path is None or not holds_points(path):
        return NOTHING_SURVEYED
    points = scaled(read_control(path, section, trajectory), section, crs)
    check_together(path, points.control + points.check, trajectory)
    return points


def scaled(points: ControlList, section: ControlSection, crs: str | None) -> ControlList:
    """Points whose eastings and northings are multiplied as [control] says, about its origin.

    Parameters
    ----------
    points : ControlList
    section : ControlSection
        Without a scale_origin it is the middle of the control points (of all, where all are check
        points), which then stays where it is.
    crs : str or None
        Of the survey.

    Raises
    ------
    SurveyFileError
        For ground distances without a CRS.
    """
    if section.scale_factor is None:
        return points
    if len(points.control):
        about = points.control
    else:
        about = points.check
    middle = about.position.mean(axis=0)
    origin = np.array([*(section.scale_origin or middle[:2]), 0.0])
    if section.scale_factor == "ground":
        if crs is None:
            raise SurveyFileError(
                'scale_factor = "ground" under [control] takes the scale of the map, and '
                "survey.toml has no crs: add it, or give scale_factor as a number."
            )
        ground = map_factors(crs, middle)
        factor = ground.combined
        words = f", from ground distances to {crs}: {ground}"
    else:
        factor = float(section.scale_factor)
        words = ""
    sentence = (
        f"Eastings and northings of the control were multiplied by {factor:.7f} about E "
        f"{origin[0]:.3f}, N {origin[1]:.3f} m (scale_factor under [control]{words})."
    )
    control, check = (
        replace(part, position=origin + (part.position - origin) * [factor, factor, 1.0])
        for part in (points.control, points.check)
    )
    return ControlList(control, check, " ".join(filter(None, [points.layout, sentence])))
