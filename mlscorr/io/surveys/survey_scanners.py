"""Which scanner measured which of a survey's points: files of its own, or ids in those of all."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from mlscorr.io.clouds import count_sources, read_layout
from mlscorr.io.surveys.survey_paths import own_clouds
from mlscorr.io.surveys.survey_sections import PlannedSurveyFile, ScannerSection
from mlscorr.survey import CloudFile, MountedScanner, SurveyFileError


def mounted_scanners(
    path: Path, settings: PlannedSurveyFile, clouds: tuple[CloudFile, ...]
) -> tuple[MountedScanner, ...]:
    """The scanners of a survey: one or more.

    Where point_source_ids tell them apart, the points of each id are counted.

    Parameters
    ----------
    path : Path
        Of survey.toml.
    settings : PlannedSurveyFile
    clouds : tuple of CloudFile
        None of a survey that is planned.

    Raises
    ------
    ValueError
        Where a file or an id is of no scanner, or of more than one, for files that are none of
        these, and for ids that no point has.
    FileNotFoundError
        For files that don't exist.
    """
    if isinstance(settings.scanner, ScannerSection):
        mounting = _mounting(settings.mounting)
        return (MountedScanner("", settings.scanner.scanner(), mounting, clouds),)
    if clouds:
        measured = _measured(path, settings.scanners, clouds)
    else:
        measured = {}
    return tuple(
        MountedScanner(
            name, section.scanner(), _mounting(section.mounting), tuple(measured.get(name, ()))
        )
        for name, section in settings.scanners
    )


def clouds_of(
    scanners: Sequence[MountedScanner], clouds: Sequence[CloudFile]
) -> tuple[CloudFile, ...]:
    """The clouds of several scanners in the order of a survey's files.

    Parameters
    ----------
    scanners : sequence of MountedScanner
    clouds : sequence of CloudFile
        The files.
    """
    parts = [part for scanner in scanners for part in scanner.clouds]
    return tuple(part for cloud in clouds for part in parts if part.path == cloud.path)


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
            f"{len(wrong)} of the {len(clouds)} files of [cloud] in {path} are not of exactly one "
            f"[[scanner]]: {', '.join(wrong)}. Name each in the files of the one that wrote it, or "
            "the point_source_ids of each scanner in it."
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
    """Pairs (name, CloudFile) of the scanners that measured a file, by the ids of each."""
    if None in own.values():
        return [(name, cloud) for name in own]
    ids = [number for numbers in own.values() for number in set(numbers)]
    doubled = sorted({number for number in ids if ids.count(number) > 1})
    if doubled:
        owners = [name for name, numbers in own.items() if doubled[0] in numbers]
        raise SurveyFileError(
            f"point_source_id {doubled[0]} of {cloud.path.name} is of scanners "
            f"{' and '.join(owners)} in {path}: each point is of one."
        )
    counts = count_sources(read_layout(cloud.path))
    other = np.setdiff1d(np.flatnonzero(counts), ids)
    if len(other):
        raise SurveyFileError(
            f"{counts[other].sum()} of the {cloud.points} points of {cloud.path.name} have a "
            f"point_source_id that no [[scanner]] of {path} names ({_listed(other)}; those named "
            f"are {_listed(ids)}). Add each to the scanner that measured these points."
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
    """The first ids in words."""
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
