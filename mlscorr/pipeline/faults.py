"""All faults of a survey's files at once, where reading would stop at the first."""

import warnings
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from mlscorr.io.clouds import crs_conflict, read_layout
from mlscorr.io.store import read_toml
from mlscorr.io.surveys import (
    SurveyFile,
    check_belongings,
    check_distinct,
    check_sessions,
    cloud_file,
    crs_notes,
    given_file,
    matching,
    mounted_scanners,
    session_file,
    stated_pos,
    survey_toml,
)
from mlscorr.io.tables import AxesError, ListError, check_together, holds_points, read_control
from mlscorr.io.trajectories import check_crs, read_sessions
from mlscorr.survey import SurveyFileError, Trajectory

Place = Literal["survey.toml", "data", "system"]


@dataclass(frozen=True)
class Fault:
    """Fault that stops a correction.

    Parameters
    ----------
    where : str
        In survey.toml (or in file names), in the data, or in the system.
    sentence : str
    number : int
        Number of faults in the sentence.
    """

    where: Place
    sentence: str
    number: int = 1


@dataclass
class Faults:
    """Faults and warnings, in order of occurrence, each once.

    Parameters
    ----------
    faults : list of Fault
    warnings : list of str
    """

    faults: list[Fault] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)

    def of(self, where: Place, function: Callable, *arguments: object) -> Any:
        """Call a function; return its result, or None for a fault, which is recorded.

        Parameters
        ----------
        where : str
            Location of a ValueError of the function.
        function : function
        *arguments
            Arguments of the function.
        """
        with warnings.catch_warnings(record=True, action="always") as caught:
            try:
                return function(*arguments)
            except ValueError as error:
                if isinstance(error, SurveyFileError):
                    where = "survey.toml"
                self.add(where, str(error), error.number if isinstance(error, ListError) else 1)
            except OSError as error:  # survey.toml names a missing file, or ...
                is_named = isinstance(error, FileNotFoundError) and error.errno is None
                self.add("survey.toml" if is_named else "system", str(error))
            finally:
                self.warn(*(str(warning.message) for warning in caught))
        return None

    def add(self, where: Place, sentence: str, number: int = 1) -> None:
        """Record a fault.

        Parameters
        ----------
        where, sentence, number
            See Fault.
        """
        if not any(sentence in fault.sentence for fault in self.faults):
            self.faults.append(Fault(where, sentence, number))

    def warn(self, *sentences: str) -> None:
        """Record warnings.

        Parameters
        ----------
        *sentences : str
        """
        for sentence in sentences:
            if sentence not in self.warnings:
                self.warnings.append(sentence)


def find_faults(path: str | Path, faults: Faults) -> None:
    """Find faults of a survey by reading its files one by one, clouds by their headers.

    Parameters
    ----------
    path : path
        survey.toml, or its folder.
    faults : Faults
        Collects the faults.
    """
    toml = faults.of("survey.toml", survey_toml, path)
    settings = toml and faults.of("survey.toml", read_toml, toml, SurveyFile, "it")
    if settings is None:
        return
    crs = None
    if settings.crs is not None and faults.of("survey.toml", check_crs, settings.crs):
        crs = settings.crs
    clouds = [
        cloud
        for name in settings.cloud.files
        for cloud in faults.of("survey.toml", matching, toml, "cloud.files", name) or ()
    ]
    if clouds:
        faults.of("survey.toml", check_distinct, toml, clouds)
    sessions = [
        faults.of("survey.toml", session_file, toml, section) for section in settings.trajectories
    ]
    named = settings.control and settings.control.file
    control = faults.of("survey.toml", given_file, toml, "control.file", named)
    faults.of("survey.toml", given_file, toml, "scene.reference", settings.scene.reference)
    recorded = _sessions(toml, settings, sessions, faults)
    trajectory = recorded and recorded.trajectory
    _control(control, settings.control, trajectory, faults)
    if trajectory is not None and crs is not None:
        faults.of("data", crs_notes, crs, trajectory, False)
    read = [_cloud(cloud, trajectory, settings, crs, faults) for cloud in dict.fromkeys(clouds)]
    if all(read):
        faults.of("survey.toml", mounted_scanners, toml, settings, tuple(read))
        if recorded is not None:
            faults.of("survey.toml", check_belongings, toml, sessions, recorded.parts, read)


def _sessions(toml, settings, sessions, faults):
    """Trajectory of all files, None if one is unreadable, or they do not belong together."""
    known = [session for session in sessions if session is not None]
    if known:
        faults.of("survey.toml", check_sessions, toml, known)
    single = [faults.of("data", read_sessions, [session], settings.crs) for session in known]
    if len(known) < len(sessions) or None in single:
        return None
    if len(single) == 1:
        return single[0]
    return faults.of("data", read_sessions, sessions, settings.crs, stated_pos(settings))


def _control(path, section, trajectory: Trajectory | None, faults):
    """Check the control, and its distance from the trajectory."""
    if path is None or not faults.of("data", holds_points, path):
        return
    if trajectory is None:  # which determines X and Y in a list without names
        faults.of("data", _read_alone, path, section)
        return
    points = faults.of("data", read_control, path, section, trajectory)
    if points is not None:
        faults.of("data", check_together, path, points.control + points.check, trajectory)


def _read_alone(path, section):
    """Read the control without a trajectory, which would determine which of X and Y is easting."""
    with suppress(AxesError):
        read_control(path, section)


def _cloud(path, trajectory, settings, crs, faults):
    """CloudFile of a path; None if it has a fault, or its time system is unknown without a
    trajectory.
    """
    layout = faults.of("data", read_layout, path)
    if layout is None:
        return None
    if crs is not None and (conflict := faults.of("data", crs_conflict, layout, crs)):
        faults.add("data", conflict)
    if trajectory is None:
        return None
    read = faults.of("data", cloud_file, path, trajectory, settings.cloud.gps_time, None)
    return read and read[0]
