"""Where the files are that a survey.toml names."""

import glob
from collections import Counter
from pathlib import Path

from mlscorr.io.survey_sections import PlannedSurveyFile


def files_of(path: Path, settings: PlannedSurveyFile) -> tuple:
    """Paths of the clouds, and of trajectory, accuracy, control and reference or None.

    Parameters
    ----------
    path : Path
        Of survey.toml.
    settings : PlannedSurveyFile

    Raises
    ------
    FileNotFoundError
        For those that don't exist.
    ValueError
        For a cloud file that is named twice, and for two of one name.
    """
    names = settings.cloud.files if settings.cloud else ()
    clouds = [cloud for name in names for cloud in matching(path, "cloud.files", name)]
    if clouds:
        _check_distinct(path, clouds)
    others = (
        ("trajectory.file", settings.trajectory.file),
        ("trajectory.accuracy", settings.trajectory.accuracy),
        ("control.file", settings.control and settings.control.file),
        ("scene.reference", settings.scene.reference),
    )
    return clouds, *(None if name is None else _existing(path, key, name) for key, name in others)


def matching(path: Path, key: str, name: str) -> list[Path]:
    """Paths of the files that a survey.toml names by a pattern, or of the one by its name.

    Parameters
    ----------
    path : Path
        Of survey.toml.
    key : str
        That names them.
    name : str

    Raises
    ------
    FileNotFoundError
        Where there is none.
    """
    folder = path.parent
    if not glob.has_magic(name) or (folder / name).exists():
        return [_existing(path, key, name)]
    matches = sorted(folder / match for match in glob.glob(name, root_dir=folder, recursive=True))
    if not matches:
        raise FileNotFoundError(f"{key} of {path}: no file is like {folder / name}.")
    return matches


def _existing(path, key, name):
    there = path.parent / name
    if not there.is_file():
        raise FileNotFoundError(f"{key} of {path} names {there}, which does not exist.")
    return there


def _check_distinct(path, clouds):
    """Refuse a cloud file that is named twice, and two of one name: outputs keep the names."""
    for kind, values in (
        ("names the file", [str(cloud.resolve()) for cloud in clouds]),
        (
            "has files of the same name in different folders, and outputs keep their names:",
            [cloud.name.casefold() for cloud in clouds],
        ),
    ):
        value, count = Counter(values).most_common(1)[0]
        if count > 1:
            raise ValueError(f"cloud.files of {path} {kind} {value} ({count} times).")
