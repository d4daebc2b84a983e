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
        check_distinct(path, clouds)
    others = single_files(settings).items()
    return clouds, *(None if name is None else existing(path, key, name) for key, name in others)


def single_files(settings: PlannedSurveyFile) -> dict[str, str | None]:
    """Names of trajectory, accuracy, control and reference by the keys that hold them.

    Parameters
    ----------
    settings : PlannedSurveyFile
    """
    control = None if settings.control is None else settings.control.file
    return {
        "trajectory.file": settings.trajectory.file,
        "trajectory.accuracy": settings.trajectory.accuracy,
        "control.file": control,
        "scene.reference": settings.scene.reference,
    }


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
        return [existing(path, key, name)]
    matches = sorted(folder / match for match in glob.glob(name, root_dir=folder, recursive=True))
    if not matches:
        raise FileNotFoundError(f"{key} of {path}: no file is like {folder / name}.")
    return matches


def existing(path: Path, key: str, name: str) -> Path:
    """Path of a file that a survey.toml names.

    Parameters
    ----------
    path : Path
        Of survey.toml.
    key : str
        That names it.
    name : str

    Raises
    ------
    FileNotFoundError
        Where there is none.
    """
    there = path.parent / name
    if not there.is_file():
        raise FileNotFoundError(f"{key} of {path} names {there}, which does not exist.")
    return there


def check_distinct(path: Path, clouds: list[Path]) -> None:
    """Refuse a cloud file that is named twice, and two of one name: outputs keep the names.

    Parameters
    ----------
    path : Path
        Of survey.toml.
    clouds : list of Path

    Raises
    ------
    ValueError
    """
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
