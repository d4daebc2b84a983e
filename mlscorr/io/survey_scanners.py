"""Which scanner wrote which of a survey's cloud files."""

from pathlib import Path

from mlscorr.io.survey_paths import matching
from mlscorr.io.survey_sections import PlannedSurveyFile, ScannerSection
from mlscorr.survey import CloudFile, MountedScanner


def mounted_scanners(
    path: Path, settings: PlannedSurveyFile, clouds: tuple[CloudFile, ...]
) -> tuple[MountedScanner, ...]:
    """The scanners of a survey: one or more.

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
        Where a file is of no scanner, or of more than one, and for files that are none of these.
    FileNotFoundError
        For files that don't exist.
    """
    if isinstance(settings.scanner, ScannerSection):
        mounting = _mounting(settings.mounting)
        return (MountedScanner("", settings.scanner.scanner(), mounting, clouds),)
    written = _names(path, settings.scanners, clouds) if clouds else {}
    return tuple(
        MountedScanner(
            name,
            section.scanner(),
            _mounting(section.mounting),
            tuple(cloud for cloud in clouds if name in written[cloud]),
        )
        for name, section in settings.scanners
    )


def _mounting(section):
    return None if section is None else section.mounting()


def _names(path, sections, clouds):
    """Name of the scanner that wrote each cloud file, in a set."""
    names = {cloud: set() for cloud in clouds}
    for name, section in sections:
        for pattern in section.files:
            there = {file.resolve() for file in matching(path, "scanner.files", pattern)}
            own = [cloud for cloud in clouds if cloud.path.resolve() in there]
            if not own:
                raise ValueError(
                    f"scanner.files of {path}: {pattern} of scanner {name} is none of the "
                    f"{len(clouds)} files of [cloud]."
                )
            for cloud in own:
                names[cloud].add(name)
    wrong = [
        f"{cloud.path.name} ({', '.join(sorted(writers)) or 'of none'})"
        for cloud, writers in names.items()
        if len(writers) != 1
    ]
    if wrong:
        raise ValueError(
            f"{len(wrong)} of the {len(clouds)} files of [cloud] in {path} are not of exactly one "
            f"[[scanner]]: {', '.join(wrong)}. Name each in the files of the one that wrote it."
        )
    return names


def scanner_notes(scanners: tuple[MountedScanner, ...]) -> list[str]:
    """Sentences on several scanners, for the report.

    Parameters
    ----------
    scanners : tuple of MountedScanner
    """
    if len(scanners) < 2:
        return []
    wrote = "; ".join(
        f"{mounted.name} wrote {', '.join(cloud.path.name for cloud in mounted.clouds)}"
        for mounted in scanners
    )
    return [
        f"The survey has {len(scanners)} scanners: {wrote}. Whether ties tell of a wrong mounting "
        "is tested for one scanner only: mlscorr calibrate takes each in turn."
    ]
