"""Choice of control and CRS in a folder: a single one is taken, several are listed."""

import warnings
from collections.abc import Mapping
from pathlib import Path

from mlscorr.io.clouds import cloud_box, crs_conflict, stated_crs
from mlscorr.io.store import PLACE_OF_CRS, OpenQuestion
from mlscorr.io.surveys import FileRole, check_area
from mlscorr.io.tables import (
    ControlList,
    ControlSection,
    check_together,
    far_cloud,
    holds_points,
    read_control,
)
from mlscorr.io.trajectories import check_crs, crs_code, crs_name
from mlscorr.pipeline.drives import Cloud, Drive, ambiguous
from mlscorr.survey import Trajectory


def choose_control(
    roles: list[FileRole], trajectory: Trajectory | None, given: Mapping
) -> tuple[Path | None, ControlList | None, dict[Path, str]]:
    """Choose the control list near the trajectory, if any, with reasons against others.

    Parameters
    ----------
    roles : list of FileRole
        Roles of point lists, and of otherwise unknown tables.
    trajectory : Trajectory or None
        None if unknown: no list is then far from it.
    given : mapping
        Given contents of [control].

    Raises
    ------
    ValueError
        If several are possible, the only one is unusable, or none is certain.
    """
    points = {}
    problems = {}
    refusals = {}
    for path in [role.path for role in roles if role.role == "control" and holds_points(role.path)]:
        section = ControlSection.model_validate({**given, "file": path.name})
        try:
            with warnings.catch_warnings(action="ignore"):
                read = read_control(path, section, trajectory)
        except ValueError as error:
            problems[path] = error
            continue
        try:
            if trajectory is not None:
                check_together(path, read.control + read.check, trajectory)
            points[path] = read
        except ValueError as error:
            refusals[path] = str(error)
    if len(points) + len(problems) > 1:
        states = {path: str(error) for path, error in problems.items()}
        question = ambiguous("control", dict.fromkeys(points, "usable") | states)
        sentence = f"{question} Combine those that belong together, with a column role."
        raise OpenQuestion(sentence, question.places)
    if points:
        path, read = next(iter(points.items()))
        return path, read, refusals
    if problems and not refusals:
        raise next(iter(problems.values()))
    if problems or refusals:
        raise ValueError(" ".join((*map(str, problems.values()), *refusals.values())))
    tables = [role for role in roles if role.role == "table"]
    if tables:
        raise ValueError(
            f"{tables[0].path.name} is neither a trajectory nor a list of control points: "
            f"{tables[0].reason}. Name its columns name, easting, northing, height; if it is not "
            "control, move it out of the folder."
        )
    return None, None, {}


def choose_crs(clouds: list[Cloud], drive: Drive, given: str | None) -> tuple[str | None, str]:
    """Choose the CRS of a folder, with its source; None if it is unknown and not needed.

    Parameters
    ----------
    clouds : list of Cloud
    drive : Drive
    given : str or None

    Raises
    ------
    ValueError
        If clouds and trajectory disagree, or their CRS is unusable.
    """
    stated = [(cloud, stated_crs(cloud.layout)) for cloud in clouds]
    stated = [(cloud, crs) for cloud, crs in stated if crs is not None]
    if given is not None:
        crs = given
        reason = "as given"
    elif stated:
        cloud, own = stated[0]
        crs = crs_code(own) or own.to_wkt()
        reason = f"by the VLRs of {cloud.name}"
    elif drive.is_geographic:
        crs = drive.zone
        reason = f"UTM zone of {drive.name}; no cloud states a CRS"
    elif drive.lack:
        raise OpenQuestion(drive.lack, [PLACE_OF_CRS])
    else:
        _check_clouds(clouds, drive.recorded.trajectory, "map coordinates", "no file states a CRS")
        return None, "no file states it"
    projected = check_crs(crs)
    for cloud in clouds:
        conflict = crs_conflict(cloud.layout, crs, f"the crs {reason}")
        if conflict:
            raise ValueError(conflict)
    trajectory = drive.read(crs)
    with warnings.catch_warnings(action="error"):
        try:
            check_area(projected, trajectory)
        except UserWarning as warning:
            raise ValueError(
                f"The crs {crs_name(projected)} ({reason}) and the trajectory {drive.name} "
                f"disagree. {warning} Set the right one with --set 'crs = \"EPSG:...\"'."
            ) from None
    _check_clouds(clouds, trajectory, crs, reason)
    return crs, f"{projected.name}, {reason}"


def _check_clouds(clouds, trajectory, crs, reason):
    """Refuse clouds far from the trajectory."""
    for cloud in clouds:
        sentence, _ = far_cloud(cloud.name, cloud_box(cloud.layout)[:, :2], trajectory)
        if sentence:
            raise ValueError(
                f"{sentence} The trajectory is assumed to be in {crs} ({reason}); if not, add "
                "--set 'crs = \"EPSG:...\"'."
            )
