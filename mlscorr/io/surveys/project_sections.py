"""What stands in project.toml, section by section."""

import re
from collections import Counter
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from mlscorr.io.store import TomlSection
from mlscorr.io.surveys import survey_sections

FOLDER_NAME = re.compile(r"[^\\/:*?\"<>|\x00-\x1f.][^\\/:*?\"<>|\x00-\x1f]*")  # on any system
SHARED_TILES = "tiles"  # folder of the corrected files of more than one drive
RESERVED = ("tasks", SHARED_TILES, "log.txt", "project.json", "project.html")  # beside the drives


class TilesSection(TomlSection):
    """All cloud files of the project, the system of their times, and which points are noise."""

    files: Annotated[list[str], Field(min_length=1)] | None = None
    gps_time: Literal["auto", "week", "standard"] = "auto"
    noise_classes: survey_sections.NoiseClasses


class DriveSection(TomlSection):
    """A drive: a survey.toml, or files and a trajectory."""

    name: Annotated[str, Field(min_length=1)] | None = None
    survey: str | None = None
    files: Annotated[list[str], Field(min_length=1)] | None = None
    point_source_ids: Annotated[list[survey_sections.PointSource], Field(min_length=1)] | None = (
        None
    )
    trajectory: survey_sections.Trajectories | None = None
    mounting: survey_sections.CalibratedMountingSection | None = None
    scanner: survey_sections.Scanners | None = None

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        own = ("files", "trajectory", "mounting", "scanner")
        given = [name for name in own if getattr(self, name) is not None]
        if self.survey is not None and given:
            raise ValueError(
                f"a drive is a survey.toml or has {given[0]} of its own, not both: say it there"
            )
        if self.survey is None and (self.files is None or self.trajectory is None):
            raise ValueError(
                "give a drive its survey (a survey.toml), or files and [drive.trajectory]"
            )
        return self


class ProjectFile(survey_sections.CommonSections):
    """What stands in project.toml, in its own units (deg)."""

    cloud: TilesSection = TilesSection()
    drive: Annotated[list[DriveSection], Field(min_length=1)]

    @model_validator(mode="after")
    def _names_drives(self) -> Self:
        names = [name for name, _ in self.drives]
        count = Counter(map(str.casefold, names))
        if doubled := [name for name, number in count.items() if number > 1]:
            raise ValueError(
                f"the {len(names)} [[drive]] need names of their own, as each is a folder of the "
                f"results: {len(doubled)} in use twice or more (first: {doubled[0]})"
            )
        if wrong := [n for n in names if n.casefold() in RESERVED or not FOLDER_NAME.fullmatch(n)]:
            raise ValueError(
                f"{len(wrong)} of the {len(names)} drives have a name that can't be a folder of "
                f"the results (first: {wrong[0]!r})"
            )
        return self

    @property
    def drives(self) -> list[tuple[str, DriveSection]]:
        """Each [[drive]] with its name, or that of its folder, or its number from 1."""
        return [
            (section.name or _folder(section) or f"drive-{number}", section)
            for number, section in enumerate(self.drive, start=1)
        ]


def _folder(section):
    """Name of the folder of a drive's survey.toml."""
    path = Path(section.survey or "")
    if path.suffix:
        return path.parent.name
    return path.name
