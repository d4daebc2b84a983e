"""survey.toml and the files it names, as one Survey."""

import glob
from collections import Counter
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator
from scipy.spatial.transform import Rotation

from mlscorr.io.control import NO_POINTS, holds_points, read_control
from mlscorr.io.las import sample_gps_times
from mlscorr.io.sbet import check_crs, describe_projection
from mlscorr.io.settings import read_settings_file
from mlscorr.io.time_systems import match_times
from mlscorr.io.trajectory import SBET_SUFFIXES, read_trajectory
from mlscorr.survey import CloudFile, Mounting, Pos, Scanner, Survey

FILE_NAME = "survey.toml"
ROUNDING = 1e-5  # of correlations written with six decimals
NEAR = 1e3  # m, a survey's control lies within this distance of the trajectory
FAR = 5e3  # m, beyond which control and trajectory can't belong together

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Meters = Annotated[float, Field(ge=-100, le=100, allow_inf_nan=False)]
Degrees = Annotated[float, Field(ge=-360, le=360, allow_inf_nan=False)]
Three = Field(min_length=3, max_length=3)
Six = Field(min_length=6, max_length=6)
Share = Annotated[float, Field(ge=-1, le=1, allow_inf_nan=False)]


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class CloudSection(_Section):
    files: Annotated[list[str], Field(min_length=1)]
    gps_time: Literal["auto", "week", "standard"] = "auto"


class TrajectorySection(_Section):
    file: str
    accuracy: str | None = None


class MountingSection(_Section):
    lever_arm: Annotated[list[Meters], Three]  # m: right, forward, up
    boresight: Annotated[list[Degrees], Three]  # deg, about x, y, z
    lever_arm_sigma: Annotated[list[Positive], Three] | None = None  # m
    boresight_sigma: Annotated[list[Positive], Three] | None = None  # deg: right, forward, up
    correlation: Annotated[list[Annotated[list[Share], Six]], Six] | None = None

    @model_validator(mode="after")
    def _has_both_sigmas(self):
        known = [v is not None for v in (self.lever_arm_sigma, self.boresight_sigma)]
        if any(known) != all(known) or (self.correlation is not None and not all(known)):
            raise ValueError("lever_arm_sigma and boresight_sigma are needed both, or neither")
        if self.correlation is not None:
            matrix = np.array(self.correlation)
            if not np.array_equal(matrix, matrix.T) or np.linalg.eigvalsh(matrix)[0] < -ROUNDING:
                raise ValueError("correlation is no correlation matrix: lopsided, or impossible")
        return self

    def mounting(self):
        """R_L^P = Rz(c) Ry(b) Rx(a) for the boresight [a, b, c]."""
        return Mounting(
            np.array(self.lever_arm),
            Rotation.from_euler("xyz", self.boresight, degrees=True),
            None if self.lever_arm_sigma is None else self._covariance(),
        )

    def _covariance(self):
        sigma = np.append(self.lever_arm_sigma, np.radians(self.boresight_sigma))
        correlation = np.eye(6) if self.correlation is None else np.array(self.correlation)
        return correlation * np.outer(sigma, sigma)


class ControlSection(_Section):
    file: str


class ScannerSection(_Section):
    range_noise: Positive = Scanner.range_noise  # m
    angle_noise: Positive = float(np.degrees(Scanner.angle_noise))  # deg
    lines_per_second: Positive = Scanner.lines_per_second

    def scanner(self):
        return Scanner(self.range_noise, np.radians(self.angle_noise), self.lines_per_second)


class PosSection(_Section):
    position_sigma: Positive = Pos.position_sigma  # m
    attitude_sigma: Annotated[list[Positive], Three] = np.degrees(Pos().attitude_sigma).tolist()
    correlation_time: Positive = Pos.correlation_time  # s

    def pos(self):
        sigma = np.radians(self.attitude_sigma)
        return Pos(self.position_sigma, sigma, self.correlation_time)


class SceneSection(_Section):
    reference: str | None = None


class Settings(_Section):
    """What stands in survey.toml, in its own units (deg)."""

    name: str | None = None
    crs: str | None = None
    cloud: CloudSection
    trajectory: TrajectorySection
    mounting: MountingSection | None = None
    control: ControlSection | None = None
    scanner: ScannerSection = ScannerSection()
    pos: PosSection = PosSection()
    scene: SceneSection = SceneSection()


class PlannedSettings(Settings):
    """The same of a survey that isn't driven yet: it may have no cloud."""

    cloud: CloudSection | None = None


def read_survey(path, planned=False):
    """Survey of a survey.toml, or of a folder that holds one; a planned one may have no cloud.

    Without a section [control], or with a file that holds no point, control and check are empty.
    Raises ValueError for anything wrong in survey.toml, in the files it names, or between them
    (times, coordinates); FileNotFoundError for files that aren't there.
    """
    path = _survey_toml(path)
    settings = read_settings(path, planned)
    clouds, trajectory_file, accuracy, control_file, reference = _files(path, settings)
    crs = check_crs(settings.crs) if settings.crs else None
    trajectory = read_trajectory(trajectory_file, settings.crs, accuracy)
    control = check = NO_POINTS
    if control_file is not None and holds_points(control_file):
        control, check = read_control(control_file)
        _check_together(control_file, control + check, trajectory)
    notes = [f"Coordinates are in {settings.crs} ({crs.name})." if crs else "No CRS was given."]
    if trajectory_file.suffix.lower() in SBET_SUFFIXES:
        notes += describe_projection(settings.crs)
    files = []
    for cloud in clouds:
        file, note = _cloud_file(cloud, trajectory, settings.cloud.gps_time)
        files.append(file)
        notes.append(note)
    if trajectory.position_sigma is None and "pos" not in settings.model_fields_set:
        notes.append(
            f"Nothing says how well the POS is known: {Pos.position_sigma} m over "
            f"{Pos.correlation_time:.0f} s are assumed. Give the trajectory's sigmas, or [pos]."
        )
    return Survey(
        name=settings.name or path.absolute().parent.name,
        path=path,
        crs=settings.crs,
        clouds=tuple(files),
        trajectory=trajectory,
        mounting=settings.mounting.mounting() if settings.mounting else None,
        control=control,
        check=check,
        scanner=settings.scanner.scanner(),
        pos=settings.pos.pos(),
        reference=reference,
        notes=tuple(notes),
    )


def read_settings(path, planned=False):
    """Settings of a survey.toml, or of a folder that holds one; no other file is opened.

    Raises ValueError that names the line of bad TOML, or every key that is unknown (with the
    nearest known one), missing, or of the wrong type.
    """
    settings = read_settings_file(_survey_toml(path), PlannedSettings if planned else Settings)
    if settings.crs is not None:
        check_crs(settings.crs)
    return settings


def input_files(path, planned=False):
    """Paths of a survey.toml and of every file that it names, all of which exist.

    Raises as read_settings does, and FileNotFoundError for files that aren't there.
    """
    return [file for _, file in named_files(path, planned)]


def named_files(path, planned=False):
    """Pairs (what it is, path) of a survey.toml and of every file that it names.

    Raises as input_files does.
    """
    path = _survey_toml(path)
    clouds, *others = _files(path, read_settings(path, planned))
    files = [("survey", path), *(("cloud", cloud) for cloud in clouds)]
    files += zip(("trajectory", "trajectory accuracy", "control", "reference"), others, strict=True)
    return [(what, file) for what, file in files if file is not None]


def _survey_toml(path):
    path = Path(path)
    if path.is_dir():
        path = path / FILE_NAME
    if not path.is_file():
        raise FileNotFoundError(f"{path} does not exist; a survey is a folder with {FILE_NAME}.")
    return path


def _files(path, settings):
    """Paths of the clouds, trajectory, accuracy, control and reference; all of them exist."""
    folder = path.parent

    def existing(key, name):
        if name is None:
            return None
        if not (folder / name).is_file():
            raise FileNotFoundError(f"{key} of {path} names {folder / name}, which does not exist.")
        return folder / name

    clouds = []
    for name in settings.cloud.files if settings.cloud else ():
        if glob.has_magic(name) and not (folder / name).exists():
            found = sorted(
                folder / match for match in glob.glob(name, root_dir=folder, recursive=True)
            )
            if not found:
                raise FileNotFoundError(f"cloud.files of {path}: no file is like {folder / name}.")
            clouds += found
        else:
            clouds.append(existing("cloud.files", name))
    if clouds:
        _check_distinct(path, clouds)
    return (
        clouds,
        existing("trajectory.file", settings.trajectory.file),
        existing("trajectory.accuracy", settings.trajectory.accuracy),
        existing("control.file", settings.control and settings.control.file),
        existing("scene.reference", settings.scene.reference),
    )


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


def _cloud_file(path, trajectory, setting):
    """CloudFile of a path, and the sentence on its time system."""
    points, is_standard, times = sample_gps_times(path)
    match = match_times(path.name, times, is_standard, trajectory, setting)
    file = CloudFile(path, points, match.constant, match.cloud_system)
    return file, f"gps_time of {path.name}: {match}."


def _check_together(path, points, trajectory):
    """Refuse control that lies kilometres from the trajectory, as it stands or swapped."""
    distance = _distance(points.position[:, :2], trajectory)
    swapped = _distance(points.position[:, 1::-1], trajectory)
    if distance > NEAR and swapped < NEAR:
        raise ValueError(
            f"Easting and northing seem to be swapped in {path}: its nearest point lies "
            f"{distance / 1e3:.0f} km from the trajectory as it stands, {swapped:.0f} m when "
            "they are exchanged. Exchange the two columns."
        )
    if distance > FAR:
        raise ValueError(
            f"The control nearest to the trajectory lies {distance / 1e3:.1f} km from it "
            f"(limit {FAR / 1e3:.0f} km): {path} and the trajectory may be in different CRS or "
            "zones. Bring both into the crs of survey.toml."
        )


def _distance(position, trajectory):
    """Least horizontal distance of points (n, 2) from the trajectory's epochs. Units: m."""
    from scipy.spatial import cKDTree

    return cKDTree(trajectory.position[:, :2]).query(position)[0].min()
