"""Assignment of a survey's points to sessions and scanners.

survey.toml assigns them by files, or by the point_source_ids in files of several.
"""

import warnings
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from mlscorr.io.clouds import count_sources, read_layout, timed_records
from mlscorr.io.settings import SETTINGS
from mlscorr.io.store import resolved
from mlscorr.io.surveys.survey_paths import matching
from mlscorr.io.surveys.survey_sections import PlannedSurveyFile, ScannerSection
from mlscorr.io.trajectories import SessionFile, SessionSection
from mlscorr.survey import CloudFile, MountedScanner, SurveyFileError, Trajectory


def own_clouds(
    path: Path,
    key: str,
    patterns: Sequence[str] | None,
    clouds: Sequence[CloudFile],
    owner: str = "",
) -> list[CloudFile]:
    """Select the clouds of a survey that patterns name; all without patterns.

    Parameters
    ----------
    path : Path
        Of survey.toml.
    key : str
        Key with the patterns.
    patterns : sequence of str, optional
    clouds : sequence of CloudFile
    owner : str
        Owner of the patterns, in words.

    Raises
    ------
    ValueError
        If a pattern matches none of them.
    FileNotFoundError
        If there is no such file.
    """
    if patterns is None:
        return [*clouds]
    own = []
    for pattern in patterns:
        there = {resolved(file) for file in matching(path, key, pattern)}
        named = [cloud for cloud in clouds if resolved(cloud.path) in there]
        if not named:
            raise SurveyFileError(
                f"{key} of {path}: {pattern}{owner} is not among the {len(clouds)} files of "
                "[cloud]."
            )
        own += named
    return own


def check_belongings(
    path: Path,
    sessions: Sequence[SessionFile],
    parts: Sequence[Trajectory],
    clouds: Sequence[CloudFile],
) -> None:
    """Compare times of points with the trajectories to which survey.toml assigns them.

    The time of a point determines its trajectory in any case; this check finds files assigned to
    the wrong one.

    Parameters
    ----------
    path : Path
        Of survey.toml.
    sessions : sequence of SessionFile
    parts : sequence of Trajectory
        Their trajectories.
    clouds : sequence of CloudFile

    Raises
    ------
    ValueError
        If most sampled points of a file are outside, or a file is not part of the survey.

    Warns
    -----
    UserWarning
        If some are outside.
    """
    if not clouds:
        return
    stated = []
    for session, part in zip(sessions, parts, strict=True):
        section = session.section
        if isinstance(section, SessionSection) and (section.files or section.point_source_ids):
            own = own_clouds(path, "trajectory.files", section.files, clouds)
            stated.append((session.path.name, part, section.point_source_ids, own))
    if not stated:
        return
    for cloud in clouds:
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
            if rows.any():
                names.append(name)
        outside = belongs & ~inside & np.isfinite(times)
        if not outside.any():
            continue
        sentence = (
            f"{outside.sum()} of {belongs.sum()} points sampled from {cloud.path.name} are "
            f"outside {' and '.join(names)}, to which {path.name} assigns them (first: "
            f"{times[np.argmax(outside)]:.3f} s)"
        )
        if outside.sum() > (1 - SETTINGS.covered_share) * belongs.sum():
            raise SurveyFileError(
                f"{sentence}. They belong to another trajectory or time system. Correct files or "
                "point_source_ids under [[trajectory]], or omit them to assign points by time."
            )
        warnings.warn(
            f"{sentence}. The trajectory that covers their times is used instead, where there is "
            "one.",
            stacklevel=3,
        )


def mounted_scanners(
    path: Path, settings: PlannedSurveyFile, clouds: tuple[CloudFile, ...]
) -> tuple[MountedScanner, ...]:
    """Make the scanners of a survey: one or more.

    If point_source_ids separate them, the points of each ID are counted.

    Parameters
    ----------
    path : Path
        Of survey.toml.
    settings : PlannedSurveyFile
    clouds : tuple of CloudFile
        Empty for a planned survey.

    Raises
    ------
    ValueError
        If a file or an ID belongs to no scanner or to several, a file is not part of the survey, or
        no point has an ID.
    FileNotFoundError
        For files that don't exist.
    """
    if isinstance(settings.scanner, ScannerSection):
        mounting = _mounting(settings.mounting)
        return (MountedScanner("", settings.scanner.scanner(), mounting, clouds),)
    measured = {}
    if clouds:
        measured = _measured(path, settings.scanners, clouds)
    return tuple(
        MountedScanner(
            name, section.scanner(), _mounting(section.mounting), tuple(measured.get(name, ()))
        )
        for name, section in settings.scanners
    )


def _mounting(section):
    if section is None:
        return None
    return section.mounting()


def _measured(path, sections, clouds):
    """CloudFiles of each scanner by its name."""
    claims = {cloud: {} for cloud in clouds}
    for name, section in sections:
        key = "scanner.files"
        for cloud in own_clouds(path, key, section.files, clouds, f" of scanner {name}"):
            claims[cloud][name] = section.point_source_ids
    wrong = [
        f"{cloud.path.name} ({', '.join(sorted(own)) or 'of none'})"
        for cloud, own in claims.items()
        if not own or (len(own) > 1 and None in own.values())
    ]
    if wrong:
        raise SurveyFileError(
            f"{len(wrong)} of the {len(clouds)} files of [cloud] in {path} do not belong to "
            f"exactly one [[scanner]]: {', '.join(wrong)}. List each file under its scanner, or "
            "give the point_source_ids of each scanner in it."
        )
    measured = {name: [] for name, _ in sections}
    for cloud, own in claims.items():
        for name, part in _parts(path, cloud, own):
            measured[name].append(part)
    for name, section in sections:
        if not measured[name]:
            files = ", ".join(cloud.path.name for cloud, own in claims.items() if name in own)
            raise SurveyFileError(
                f"No point of {files} has a point_source_id of scanner {name} in {path} "
                f"({_listed(section.point_source_ids)})."
            )
    return measured


def _parts(path, cloud, own):
    """Pairs (name, CloudFile) of the scanners that measured a file, by the IDs of each."""
    if None in own.values():
        return [(name, cloud) for name in own]
    ids = [number for numbers in own.values() for number in set(numbers)]
    doubled = sorted({number for number in ids if ids.count(number) > 1})
    if doubled:
        owners = [name for name, numbers in own.items() if doubled[0] in numbers]
        raise SurveyFileError(
            f"point_source_id {doubled[0]} of {cloud.path.name} is assigned to scanners "
            f"{' and '.join(owners)} in {path}. Assign it to one."
        )
    counts = count_sources(read_layout(cloud.path))
    other = np.setdiff1d(np.flatnonzero(counts), ids)
    if len(other):
        raise SurveyFileError(
            f"{counts[other].sum()} of the {cloud.points} points of {cloud.path.name} have a "
            f"point_source_id that no [[scanner]] of {path} lists ({_listed(other)}; listed are "
            f"{_listed(ids)}). Add each to the scanner that measured these points."
        )
    parts = [
        (name, replace(cloud, points=int(n), point_source_ids=tuple(sorted(set(numbers)))))
        for name, numbers in own.items()
        if (n := counts[sorted(set(numbers))].sum())
    ]
    if len(parts) > 1:
        return parts
    return [(name, cloud) for name, _ in parts]


def _listed(ids):
    """List the first IDs in words."""
    first = ", ".join(map(str, sorted(ids)[:10]))
    if len(ids) <= 10:
        return first
    return f"{first} and {len(ids) - 10} more"


def scanner_notes(scanners: tuple[MountedScanner, ...]) -> list[str]:
    """Sentences on several scanners, for the report.

    Parameters
    ----------
    scanners : tuple of MountedScanner
    """
    if len(scanners) < 2:
        return []
    wrote = "; ".join(
        f"{mounted.name} wrote {', '.join(cloud.name for cloud in mounted.clouds)}"
        for mounted in scanners
    )
    return [f"The survey has {len(scanners)} scanners: {wrote}."]
