"""Sections of survey.toml, in its own units (deg)."""

from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Discriminator, Field, Tag, model_validator
from scipy.spatial.transform import Rotation

from mlscorr.io.store import Degrees, Meters, PointSource, Positive, Share, Six, Three, TomlSection
from mlscorr.io.tables import ControlSection
from mlscorr.io.trajectories import SessionSection, TrajectorySection
from mlscorr.survey import (
    NOISE_CLASSES,
    SEARCH_RADIUS,
    Mounting,
    Pos,
    ProjectNames,
    Scanner,
)

NoiseClasses = Annotated[
    list[Annotated[int, Field(ge=0, le=255)]],  # 8 bits of a LAS point
    Field(default_factory=partial(list, NOISE_CLASSES)),
]


class CloudSection(TomlSection):
    """Cloud files, their time system, and their noise classes."""

    files: Annotated[list[str], Field(min_length=1)]
    gps_time: Literal["auto", "week", "standard"] = "auto"
    noise_classes: NoiseClasses  # whose points are not used in measurements
    mounting: Literal["stated", "recorded"] = "stated"  # used for georeferencing the points


class MountingSection(TomlSection):
    """Lever arm (m: right, forward, up) and boresight (deg, about x, y, z)."""

    lever_arm: Annotated[list[Meters], Three]
    boresight: Annotated[list[Degrees], Three]

    def mounting(self) -> Mounting:
        """Return the mounting with R_L^P = Rz(c) Ry(b) Rx(a) for the boresight [a, b, c]."""
        boresight = Rotation.from_euler("xyz", self.boresight, degrees=True)
        return Mounting(np.array(self.lever_arm, dtype=float), boresight)


class CalibratedMountingSection(MountingSection):
    """Mounting with its accuracy from a calibration, or from measurement."""

    lever_arm_sigma: Annotated[list[Positive], Three] | None = None  # m
    boresight_sigma: Annotated[list[Positive], Three] | None = None  # deg: right, forward, up
    correlation: Annotated[list[Annotated[list[Share], Six]], Six] | None = None

    @model_validator(mode="after")
    def _can_be(self) -> Self:
        if self.correlation is not None:
            if self.lever_arm_sigma is None or self.boresight_sigma is None:
                raise ValueError("correlation needs both lever_arm_sigma and boresight_sigma")
            matrix = np.array(self.correlation)
            rounding = 0.5e-6 * len(matrix)  # of an eigenvalue with six decimals
            if not np.array_equal(matrix, matrix.T) or np.linalg.eigvalsh(matrix)[0] < -rounding:
                raise ValueError(
                    "correlation is not a correlation matrix: it is not symmetric "
                    "or not positive semidefinite"
                )
        return self

    def mounting(self) -> Mounting:
        """Return the Mounting with its covariance, and the sigmas of measured values."""
        mounting = super().mounting()
        unknown = [np.nan] * 3
        sigma = np.append(self.lever_arm_sigma or unknown, self.boresight_sigma or unknown)
        sigma[3:] = np.radians(sigma[3:])
        if self.correlation is None and not np.isnan(sigma).all():
            mounting = replace(mounting, measured=sigma)
        if np.isnan(sigma).any():
            return mounting
        correlation = np.eye(6)
        if self.correlation is not None:
            correlation = np.array(self.correlation)
        return replace(mounting, covariance=correlation * np.outer(sigma, sigma))


def left_out(section: TomlSection, names: Iterable[str]) -> tuple[str, ...]:
    """Keys of a section that the file omits, so that their defaults apply.

    Parameters
    ----------
    section : TomlSection
    names : iterable of str
    """
    return tuple(name for name in names if name not in section.model_fields_set)


class ScannerSection(TomlSection):
    """Assumed properties of the scanner."""

    range_noise: Positive = Scanner.range_noise  # m
    angle_noise: Positive = float(np.degrees(Scanner.angle_noise))  # deg
    lines_per_second: Positive = Scanner.lines_per_second

    def scanner(self) -> Scanner:
        """Return the Scanner, in radians."""
        noises = self.range_noise, np.radians(self.angle_noise)
        assumed = left_out(self, ("range_noise", "angle_noise"))
        return Scanner(*noises, self.lines_per_second, assumed)


class MountedScannerSection(ScannerSection):
    """One of several scanners: its points, assumed properties, and mounting."""

    name: Annotated[str, Field(min_length=1)] | None = None
    files: Annotated[list[str], Field(min_length=1)] | None = None
    point_source_ids: Annotated[list[PointSource], Field(min_length=1)] | None = None
    mounting: CalibratedMountingSection | None = None

    @model_validator(mode="after")
    def _has_points(self) -> Self:
        if self.files is None and self.point_source_ids is None:
            raise ValueError(
                "files is missing: list the files of the scanner, or its point_source_ids if "
                "files contain points of several"
            )
        return self


def _kind_of_section(document):
    if isinstance(document, list | tuple):
        return _LIST
    return _TABLE


# Names of the alternatives, omitted from keys in sentences because they are blank
_TABLE = ""
_LIST = " "
Scanners = Annotated[
    Annotated[ScannerSection, Tag(_TABLE)]
    | Annotated[list[MountedScannerSection], Field(min_length=1), Tag(_LIST)],
    Discriminator(_kind_of_section),
]
Trajectories = Annotated[
    Annotated[TrajectorySection, Tag(_TABLE)]
    | Annotated[list[SessionSection], Field(min_length=1), Tag(_LIST)],
    Discriminator(_kind_of_section),
]


class PosSection(TomlSection):
    """Assumed accuracy of the POS, used if the trajectory has no sigmas."""

    position_sigma: Positive = Pos.position_sigma  # m
    attitude_sigma: Annotated[list[Positive], Three] = np.degrees(Pos().attitude_sigma).tolist()
    correlation_time: Positive = Pos.correlation_time  # s

    def pos(self) -> Pos:
        """Return the Pos, in radians."""
        return Pos(
            self.position_sigma,
            np.radians(self.attitude_sigma),
            self.correlation_time,
            assumed=left_out(self, ("position_sigma", "attitude_sigma", "correlation_time")),
        )


class MatchingSection(TomlSection):
    """Search radius of targets around their surveyed points."""

    search_radius: Annotated[float, Field(gt=0, le=100)] = SEARCH_RADIUS  # m


class TiesSection(TomlSection):
    """Use of tie features in a correction."""

    use: Literal["auto", "off"] = "auto"


class SceneSection(TomlSection):
    """Reference surface."""

    reference: str | None = None


class ProjectSection(TomlSection):
    """Names that head the report and the certificate."""

    title: str | None = None
    client: str | None = None
    project: str | None = None
    instrument: str | None = None
    operator: str | None = None

    def names(self) -> ProjectNames:
        """Return the ProjectNames, with blanks around names removed."""
        stripped = {key: (value or "").strip() for key, value in self.model_dump().items()}
        return ProjectNames(**stripped)


class CommonSections(TomlSection):
    """Sections common to the survey.toml of a drive and the project.toml of several drives."""

    name: str | None = None
    crs: str | None = None
    mounting: CalibratedMountingSection | None = None
    control: ControlSection | None = None
    scanner: Scanners = ScannerSection()
    pos: PosSection = PosSection()
    matching: MatchingSection = MatchingSection()
    ties: TiesSection = TiesSection()


class PlannedSurveyFile(CommonSections):
    """Contents of the survey.toml of a planned survey, which may have no cloud."""

    cloud: CloudSection | None = None
    trajectory: Trajectories
    scene: SceneSection = SceneSection()
    project: ProjectSection = ProjectSection()

    @model_validator(mode="after")
    def _parts_scanners(self) -> Self:
        names = [name for name, _ in self.scanners]
        if names and self.mounting is not None:
            raise ValueError(
                "[mounting] applies to a single scanner; with several, give each its own "
                "[scanner.mounting] below its [[scanner]]"
            )
        if len(names) > len(set(names)):
            raise ValueError(
                f"the {len(names)} [[scanner]] need unique names, and these are "
                f"{', '.join(names)} (the number is used if there is no name)"
            )
        return self

    @property
    def trajectories(self) -> list[TrajectorySection]:
        """Section [trajectory], or each [[trajectory]]."""
        if isinstance(self.trajectory, list):
            return [*self.trajectory]
        return [self.trajectory]

    @property
    def scanners(self) -> list[tuple[str, MountedScannerSection]]:
        """Name and section of each [[scanner]], numbered from 1 by default; empty with one
        [scanner].
        """
        if isinstance(self.scanner, list):
            sections = self.scanner
        else:
            sections = []
        return [(section.name or str(n), section) for n, section in enumerate(sections, start=1)]


class SurveyFile(PlannedSurveyFile):
    """Contents of survey.toml, in its own units (deg)."""

    cloud: CloudSection
