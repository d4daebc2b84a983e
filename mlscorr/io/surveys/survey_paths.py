"""Paths of the files named in a survey.toml."""

import glob
import os
import warnings
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from mlscorr.io.clouds import find_copies, written_name
from mlscorr.io.settings import SETTINGS
from mlscorr.io.store import files_like, is_folder, is_remote, is_there, nearest, resolved, sibling
from mlscorr.io.surveys.folder_roles import RESULTS
from mlscorr.io.surveys.survey_sections import PlannedSurveyFile
from mlscorr.io.trajectories import SessionFile, TrajectorySection
from mlscorr.wording import counted


@dataclass(frozen=True)
class SurveyPaths:
    """Paths of the files that a survey.toml names.

    Parameters
    ----------
    clouds : list of Path
    sessions : list of SessionFile
        One trajectory, or several.
    control, reference : Path or None
    """

    clouds: list[Path]
    sessions: list[SessionFile]
    control: Path | None
    reference: Path | None

    @property
    def named(self) -> list[tuple[str, Path]]:
        """Pairs (description, path) of all files."""
        named = [("cloud", cloud) for cloud in self.clouds]
        for session in self.sessions:
            named += [("trajectory", session.path), ("trajectory accuracy", session.accuracy)]
        named += [("control", self.control), ("reference", self.reference)]
        return [(what, file) for what, file in named if file is not None]


def files_of(path: Path, settings: PlannedSurveyFile, key: str = "cloud.files") -> SurveyPaths:
    """Find the files named in a survey.toml.

    Parameters
    ----------
    path : Path
        Of survey.toml.
    settings : PlannedSurveyFile
    key : str
        Key that names the clouds.

    Raises
    ------
    FileNotFoundError
        For those that don't exist.
    ValueError
        If a file is named twice, or two clouds have the same name.
    """
    clouds = []
    if settings.cloud:
        for name in settings.cloud.files:
            clouds += matching(path, key, name)
    if clouds:
        check_distinct(path, clouds, key)
    sessions = [session_file(path, section) for section in settings.trajectories]
    check_sessions(path, sessions)
    control = None
    if settings.control is not None:
        control = given_file(path, "control.file", settings.control.file)
    reference = given_file(path, "scene.reference", settings.scene.reference)
    return SurveyPaths(clouds, sessions, control, reference)


def session_file(path: Path, section: TrajectorySection) -> SessionFile:
    """Find the files of a [trajectory] or of one of [[trajectory]].

    Parameters
    ----------
    path : Path
        Of survey.toml.
    section : TrajectorySection

    Raises
    ------
    FileNotFoundError
        For those that don't exist.
    """
    file = existing(path, "trajectory.file", section.file)
    return SessionFile(file, given_file(path, "trajectory.accuracy", section.accuracy), section)


def check_sessions(path: Path, sessions: Sequence[SessionFile]) -> None:
    """Refuse a trajectory that is named twice.

    Parameters
    ----------
    path : Path
        Of survey.toml.
    sessions : sequence of SessionFile

    Raises
    ------
    ValueError
    """
    file, count = Counter(resolved(session.path) for session in sessions).most_common(1)[0]
    if count > 1:
        raise ValueError(f"{count} of the [[trajectory]] of {path} name the file {file}.")


def matching(path: Path, key: str, name: str) -> list[Path]:
    """Paths of the files that a survey.toml names by a pattern, or of one by its name.

    Parameters
    ----------
    path : Path
        Of survey.toml.
    key : str
        Key that names them.
    name : str

    Raises
    ------
    FileNotFoundError
        If there is none.

    Warns
    -----
    UserWarning
        If folders with results are omitted from a pattern for all folders.
    """
    there = sibling(path, name)
    if not glob.has_magic(name) or is_there(there):
        return [existing(path, key, name)]
    matches = files_like(path.parent, name)
    if "**" in name:
        below = {file.parent for file in matches} - {path.parent}
        results = {folder for folder in below if _holds_results(folder)}
        matches = [file for file in matches if file.parent not in results]
        if results:
            warnings.warn(
                f"{key} of {path}: {name} excludes results of an earlier run in "
                f"{', '.join(sorted(map(str, results)))}.",
                stacklevel=2,
            )
    if not matches:
        raise FileNotFoundError(f"{key} of {path}: no file matches {there}.")
    return matches


def _holds_results(folder):
    """True if a folder contains results of a run or of a project."""
    documents = [folder / name for name in RESULTS] + [folder.parent / "project.json"]
    return any(is_there(path) for path in documents)


def given_file(path: Path, key: str, name: str | None) -> Path | None:
    """Path of an optional file in survey.toml; see existing. None without a name."""
    if name is None:
        return None
    return existing(path, key, name)


def existing(path: Path, key: str, name: str) -> Path:
    """Path of a file that a survey.toml names.

    Parameters
    ----------
    path : Path
        Of survey.toml.
    key : str
        Key that names it.
    name : str

    Raises
    ------
    FileNotFoundError
        If there is none.
    """
    there = sibling(path, name)
    if not is_there(there):
        raise FileNotFoundError(f"{key} of {path} names {there}, which {_lack(there)}.")
    return there


def _lack(there):
    """Explain why there is no file with a name, and suggest another."""
    if is_folder(there):
        return "is a folder: give a file in it, or its clouds as a pattern, such as FOLDER/*.laz"
    others = []
    if not is_remote(there) and there.parent.is_dir():
        others = os.listdir(there.parent)
    near = nearest(there.name, others)
    if near:
        return f"does not exist; the nearest existing name is {near}"
    return "does not exist"


def check_distinct(path: Path, clouds: list[Path], key: str = "cloud.files") -> None:
    """Refuse a cloud named twice or by a copy, and two with one name, because outputs keep names.

    Parameters
    ----------
    path : Path
        Of survey.toml.
    clouds : list of Path
    key : str
        Key that names them.

    Raises
    ------
    ValueError
    """
    places = [str(resolved(cloud)) for cloud in clouds]
    place, count = Counter(places).most_common(1)[0]
    if count > 1:
        raise ValueError(f"{key} of {path} lists the file {place} {count} times. List it once.")
    if copies := find_copies(clouds):
        raise ValueError(_copies_sentence(path, key, copies))
    written = [written_name(cloud).casefold() for cloud in clouds]
    name, count = Counter(written).most_common(1)[0]
    if count > 1:
        homonyms = {place for place, own in zip(places, written, strict=True) if own == name}
        raise ValueError(
            f"{key} of {path} has {count} files whose results would have the same name, {name}: "
            f"{', '.join(sorted(homonyms)[:4])}. Rename them."
        )


def _copies_sentence(path: Path, key: str, copies: dict[Path, Path]) -> str:
    """Sentence on clouds with the points of others, and on which to remove."""
    limit = SETTINGS.named_faults
    pairs = [f"{copy}, a copy of {first}" for copy, first in list(copies.items())[:limit]]
    surplus = len(copies) - len(pairs)
    more = f"; and {surplus} more" if surplus else ""
    pronoun = "it" if len(copies) == 1 else "them"
    return (
        f"{key} of {path} lists {counted(len(copies), 'copy')} of other clouds (same number, "
        f"bounds and times of points): {'; '.join(pairs)}{more}. Remove {pronoun} from {key}: "
        "each point would count twice, as a separate pass."
    )
