"""Whether points lie within the trajectories that survey.toml says they belong to."""

import warnings
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mlscorr.io.clouds import read_layout, timed_records
from mlscorr.io.settings import SETTINGS
from mlscorr.io.surveys.survey_paths import own_clouds
from mlscorr.io.trajectories import SessionFile, SessionSection
from mlscorr.survey import CloudFile, SurveyFileError, Trajectory


def check_belongings(
    path: Path,
    sessions: Sequence[SessionFile],
    parts: Sequence[Trajectory],
    clouds: Sequence[CloudFile],
) -> None:
    """Compare times of points with the trajectories whose files or point_source_ids they are.

    The time of a point tells its trajectory in any case; this finds files under the wrong one.

    Parameters
    ----------
    path : Path
        Of survey.toml.
    sessions : sequence of SessionFile
    parts : sequence of Trajectory
        Of these.
    clouds : sequence of CloudFile

    Raises
    ------
    ValueError
        Where most points that were looked at in a file lie outside, and for files that are none
        of the survey.

    Warns
    -----
    UserWarning
        Where some do.
    """
    stated = [
        (session.path.name, part, section.point_source_ids, own)
        for session, part in zip(sessions, parts, strict=True)
        if clouds and isinstance(section := session.section, SessionSection)
        if section.files or section.point_source_ids
        for own in [own_clouds(path, "trajectory.files", section.files, clouds)]
    ]
    for cloud in clouds if stated else ():
        records = timed_records(read_layout(cloud.path))
        times = cloud.trajectory_time(records["gps_time"])
        belongs = np.zeros(len(times), bool)
        inside = np.zeros(len(times), bool)
        names = []
        for name, part, ids, own in stated:
            rows = np.isin(records["point_source_id"], ids or records["point_source_id"])
            rows &= cloud in own
            belongs |= rows
            inside |= rows & (times >= part.gps_time[0]) & (times <= part.gps_time[-1])
            names += [name] if rows.any() else []
        outside = belongs & ~inside & np.isfinite(times)
        if outside.any():
            _say(path, cloud, names, times, outside, belongs.sum())


def _say(path, cloud, names, times, outside, count):
    """Refuse or warn of points outside their trajectories."""
    sentence = (
        f"{outside.sum()} of {count} points sampled from {cloud.path.name} lie outside "
        f"{' and '.join(names)}, to which {path.name} says they belong (first: "
        f"{times[np.argmax(outside)]:.3f} s)"
    )
    if outside.sum() > (1 - SETTINGS.covered_share) * count:
        raise SurveyFileError(
            f"{sentence}: another trajectory is theirs, or it is of another time system. Correct "
            "files or point_source_ids under [[trajectory]], or leave them out: the time of a "
            "point tells its trajectory."
        )
    warnings.warn(
        f"{sentence}: the trajectory that covers their times is taken, where one does.",
        stacklevel=4,
    )
