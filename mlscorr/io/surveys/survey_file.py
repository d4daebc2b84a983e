"""survey.toml and the files it names, as one Survey.

Surveyed points in ground distances are scaled, and checked to be near the drive.
"""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from mlscorr.io.clouds import (
    converted,
    crs_conflict,
    is_foreign,
    read_chunks,
    read_layout,
    spread_records,
)
from mlscorr.io.store import as_path, input_file, is_folder, is_there, read_toml
from mlscorr.io.surveys.crs_checks import crs_notes
from mlscorr.io.surveys.point_owners import check_belongings, mounted_scanners, scanner_notes
from mlscorr.io.surveys.survey_paths import SurveyPaths, files_of
from mlscorr.io.surveys.survey_sections import PlannedSurveyFile, SurveyFile
from mlscorr.io.tables import (
    NOTHING_SURVEYED,
    ControlList,
    ControlSection,
    check_together,
    holds_points,
    read_control,
)
from mlscorr.io.trajectories import (
    ADJUSTMENT,
    Sessions,
    check_crs,
    map_factors,
    match_times,
    read_sessions,
)
from mlscorr.survey import (
    NOISE_CLASSES,
    CloudFile,
    InputFile,
    Pos,
    Scanner,
    Survey,
    SurveyFileError,
    Trajectory,
)

FILE_NAME = "survey.toml"
UNKNOWN_POS = (
    f"The accuracy of the POS is not given: {Pos.position_sigma} m with a correlation time of "
    f"{Pos.correlation_time:.0f} s are assumed. Add sigmas to the trajectory, or set [pos]."
)


def read_survey(path: str | Path, planned: bool = False) -> Survey:
    """Read the Survey of a survey.toml, with all data except the points.

    Parameters
    ----------
    path : path
        survey.toml, or its folder.
    planned : bool
        True if it may have no cloud.

    Returns
    -------
    Survey
        Without a section [control], or with a file without points, control and check are empty.

    Raises
    ------
    ValueError
        For any fault in survey.toml, in the files it names, or between them (times, coordinates).
    FileNotFoundError
        For files that aren't there.

    >>> import mlscorr, numpy as np, tempfile
    >>> from mlscorr.simulate import Scenario, simulate
    >>> folder = tempfile.mkdtemp()
    >>> short = Scenario(drive={"duration": 4.0}, targets={"control": 3, "check": 1})
    >>> simulate(short, np.random.default_rng(1)).write(folder)
    >>> survey = mlscorr.read_survey(folder)
    >>> len(survey.control), len(survey.trajectory)
    (3, 401)
    """
    path = survey_toml(path)
    settings = read_survey_file(path, planned)
    files = files_of(path, settings)
    parts = read_parts(path, settings, files)  # trajectory and control
    clouds = [parts.cloud_file(cloud) for cloud in files.clouds]
    return parts.survey(clouds)


@dataclass(frozen=True)
class SurveyParts:
    """All parts of a survey except its clouds.

    Parameters
    ----------
    path : Path
        Path of the file that defines it.
    settings : PlannedSurveyFile
    files : SurveyPaths
    recorded : Sessions
    surveyed : ControlList
        Control and check points, and the interpretation of their list.
    inputs : tuple of InputFile
    """

    path: Path
    settings: PlannedSurveyFile
    files: SurveyPaths
    recorded: Sessions
    surveyed: ControlList
    inputs: tuple[InputFile, ...]

    @property
    def system(self) -> str:
        """Stated time system of the clouds."""
        if self.settings.cloud:
            return self.settings.cloud.gps_time
        return "auto"

    @property
    def noise_classes(self) -> tuple[int, ...]:
        """Noise classes of the clouds' points."""
        cloud = self.settings.cloud
        if cloud is None:
            return NOISE_CLASSES
        return tuple(cloud.noise_classes)

    def cloud_file(self, cloud: Path) -> tuple[CloudFile, str]:
        """Return the CloudFile of a path; see the function of this name."""
        given = self.recorded.trajectory, self.system, self.settings.crs
        return cloud_file(cloud, *given, noise_classes=self.noise_classes)

    def survey(self, read: Sequence[tuple[CloudFile, str]]) -> Survey:
        """Make the survey of these parts and of clouds.

        Parameters
        ----------
        read : sequence of (CloudFile, str)
            Each with a sentence on its time system.

        Raises
        ------
        ValueError
            If clouds, trajectories and scanners do not match.
        """
        path = self.path
        settings = self.settings
        recorded = self.recorded
        trajectory = recorded.trajectory

        clouds = tuple(file for file, _ in read)
        check_belongings(path, self.files.sessions, recorded.parts, clouds)
        scanners = mounted_scanners(path, settings, clouds)
        parts = [part for scanner in scanners for part in scanner.clouds]
        clouds = tuple(part for file in clouds for part in parts if part.path == file.path)
        on_scanners = scanner_notes(scanners)
        if len(scanners) == 1:
            scanner = scanners[0].scanner
            mounting = scanners[0].mounting
            scanners = ()  # only if there are several
        else:
            scanner = Scanner()
            mounting = None

        layouts = [*recorded.layouts, *filter(None, [self.surveyed.layout])]
        layouts += [converted(file.path).note for file, _ in read if is_foreign(file.path)]
        notes = crs_notes(settings.crs, trajectory, recorded.is_sbet)
        notes += [*recorded.notes, *(note for _, note in read), *on_scanners, *layouts]
        if trajectory.position_sigma is None and "pos" not in settings.model_fields_set:
            notes.append(UNKNOWN_POS)

        survey = Survey(
            name=settings.name or path.absolute().parent.name,
            path=path,
            crs=settings.crs,
            clouds=clouds,
            trajectory=trajectory,
            mounting=mounting,
            control=self.surveyed.control,
            check=self.surveyed.check,
            scanner=scanner,
            pos=settings.pos.pos(),
            reference=self.files.reference,
            search_radius=settings.matching.search_radius,
            use_ties=settings.ties.use == "auto",
            notes=tuple(notes),
            layouts=tuple(layouts),
            inputs=self.inputs,
            scanners=scanners,
            corrected_by=tuple(n for part in settings.trajectories for n in part.corrected_by),
            is_remounted=settings.cloud is not None and settings.cloud.mounting == "recorded",
            project=settings.project.names(),
        )
        if settings.control is None:
            return survey
        return survey.choosing(settings.control.exclude, settings.control.include)


def read_parts(path: Path, settings: PlannedSurveyFile, files: SurveyPaths) -> SurveyParts:
    """Read all parts of a survey except its clouds.

    Parameters
    ----------
    path : Path
        Path of the file that defines it.
    settings : PlannedSurveyFile
        For errors see read_survey.
    files : SurveyPaths
        Files named there.
    """
    inputs = tuple(input_file(*named) for named in [("survey", path), *files.named])
    recorded = read_sessions(files.sessions, settings.crs, stated_pos(settings))
    surveyed = read_surveyed(files.control, settings.control, recorded.trajectory, settings.crs)
    return SurveyParts(path, settings, files, recorded, surveyed, inputs)


def stated_pos(settings: PlannedSurveyFile) -> Pos | None:
    """Contents of [pos]; None if it is missing.

    Parameters
    ----------
    settings : PlannedSurveyFile
    """
    if "pos" in settings.model_fields_set:
        return settings.pos.pos()
    return None


def read_survey_file(path: str | Path, planned: bool = False) -> PlannedSurveyFile:
    """Read the contents of a survey.toml; no other file is opened.

    Parameters
    ----------
    path : path
        survey.toml, or its folder.
    planned : bool
        True if it may have no cloud.

    Returns
    -------
    SurveyFile, or PlannedSurveyFile for a planned survey

    Raises
    ------
    ValueError
        Names the line of invalid TOML, or every key that is unknown (with the most similar one),
        missing, or of the wrong type.
    """
    sections = PlannedSurveyFile if planned else SurveyFile
    settings = read_toml(survey_toml(path), sections, "it")
    if settings.crs is not None:
        check_crs(settings.crs)
    return settings


def input_files(path: str | Path, planned: bool = False) -> list[Path]:
    """Paths of a survey.toml and of every file it names, all of which exist.

    Parameters
    ----------
    path : path
    planned : bool

    Returns
    -------
    list of Path

    Raises
    ------
    ValueError
        See read_survey_file.
    FileNotFoundError
        For files that aren't there.
    """
    path = survey_toml(path)
    return [path, *(file for _, file in files_of(path, read_survey_file(path, planned)).named)]


def survey_toml(path: str | Path) -> Path:
    """Path of a survey.toml, or of the one in a folder.

    Parameters
    ----------
    path : path

    Raises
    ------
    FileNotFoundError
        If there is none.
    """
    path = as_path(path)
    if is_folder(path):
        path = path / FILE_NAME
    if not is_there(path):
        raise FileNotFoundError(
            f"{path} does not exist. A survey is a folder with {FILE_NAME}; mlscorr init creates "
            "one."
        )
    return path


def cloud_file(
    path: Path,
    trajectory: Trajectory,
    setting: str,
    crs: str | None,
    ids: tuple[int, ...] | None = None,
    noise_classes: tuple[int, ...] = NOISE_CLASSES,
) -> tuple[CloudFile, str]:
    """Make the CloudFile of a path, and the sentence on its time system.

    Parameters
    ----------
    path : Path
    trajectory : Trajectory
    setting : str
        cloud.gps_time of survey.toml.
    crs : str or None
        CRS of survey.toml, which must be valid.
    ids : tuple of int, optional
        Only points with these point_source_ids belong to the trajectory.
    noise_classes : tuple of int
        cloud.noise_classes of survey.toml.

    Raises
    ------
    ValueError
        If a file cannot be read, or its times do not match the trajectory's.

    Warns
    -----
    UserWarning
        If the file states another CRS.
    """
    layout = read_layout(path)
    file = CloudFile(path, layout.points, layout.time_offset, "", ids, noise_classes=noise_classes)
    if layout.scale.max() > 0.002:  # m, half of the accuracy of a scanner's ranges
        warnings.warn(
            f"The coordinates of {path.name} have a resolution of {layout.scale.max():g} m, "
            "which limits targets and corrected points. Export the cloud with a resolution of "
            "0.001 m.",
            stacklevel=2,
        )
    records = spread_records(layout)[1]
    times = records["gps_time"][file.rows(records["point_source_id"])] + layout.time_offset
    if not len(times):  # too few for a spread over the file
        chunk = next(read_chunks(file), None)
        if chunk is not None:
            times = chunk.gps_time
    match = match_times(
        path.name, times, layout.is_standard, trajectory, setting, layout.time_offset
    )
    if crs is not None:
        conflict = crs_conflict(layout, crs)
        if conflict:
            warnings.warn(conflict, stacklevel=3)
    constant = match.constant + layout.time_offset
    file = replace(
        file, time_constant=constant, time_system=match.cloud_system, new_week=match.new_week
    )
    taken = ""
    if layout.time_offset:
        taken = f"; stored minus {ADJUSTMENT + layout.time_offset:.0f} s, as stated in its header"
    return file, f"gps_time of {path.name}: {match}{taken}."


def read_surveyed(
    path: Path | None, section: ControlSection, trajectory: Trajectory, crs: str | None = None
) -> ControlList:
    """Read the points of a list and check that they are near a trajectory; empty without a list.

    Parameters
    ----------
    path : Path or None
    section : ControlSection
    trajectory : Trajectory
    crs : str, optional
        CRS of the survey, for control in ground distances.

    Raises
    ------
    ValueError
        See read_control and check_together.
    """
    if path is None or not holds_points(path):
        return NOTHING_SURVEYED
    points = _scaled(read_control(path, section, trajectory), section, crs)
    check_together(path, points.control + points.check, trajectory)
    return points


def _scaled(points, section, crs):
    """Scale eastings and northings about an origin as stated in [control].

    Without a scale_origin it is the middle of the control points (or of all points, if all are
    check points), which does not move.
    """
    if section.scale_factor is None:
        return points
    about = points.control if len(points.control) else points.check
    middle = about.position.mean(axis=0)
    origin = np.array([*(section.scale_origin or middle[:2]), 0.0])
    if section.scale_factor == "ground":
        if crs is None:
            raise SurveyFileError(
                'scale_factor = "ground" under [control] needs the map scale, and survey.toml '
                "has no crs. Add it, or give scale_factor as a number."
            )
        ground = map_factors(crs, middle)
        factor = ground.combined
        source = f"scale_factor under [control], from ground distances to {crs}: {ground}"
    else:
        factor = float(section.scale_factor)
        source = "scale_factor under [control]"
    sentence = (
        f"Eastings and northings of the control were multiplied by {factor:.7f} about E "
        f"{origin[0]:.3f}, N {origin[1]:.3f} m ({source})."
    )
    control, check = (
        replace(part, position=origin + (part.position - origin) * [factor, factor, 1.0])
        for part in (points.control, points.check)
    )
    return ControlList(control, check, " ".join(filter(None, [points.layout, sentence])))
