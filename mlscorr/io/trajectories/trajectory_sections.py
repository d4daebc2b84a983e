"""What survey.toml may state of a trajectory."""

from typing import Annotated, Literal

from pydantic import Field

from mlscorr.io.store import Column, PointSource, TomlSection
from mlscorr.io.tables import PlaceColumns


class TrajectoryColumns(PlaceColumns):
    """Which column of a trajectory is what."""

    gps_time: Column = None
    latitude: Column = None
    longitude: Column = None
    roll: Column = None
    pitch: Column = None
    heading: Column = None
    qx: Column = None
    qy: Column = None
    qz: Column = None
    qw: Column = None
    sigma_easting: Column = None
    sigma_northing: Column = None
    sigma_height: Column = None
    sigma_roll: Column = None
    sigma_pitch: Column = None
    sigma_heading: Column = None


class TrajectorySection(TomlSection):
    """The trajectory's file, the accuracy of an SBET, columns and conventions of others."""

    file: str
    accuracy: str | None = None
    time_constant: Annotated[float, Field(allow_inf_nan=False)] = 0.0  # s, added to its times
    columns: TrajectoryColumns = TrajectoryColumns()
    angles: Literal["deg", "rad", "gon"] | None = None
    heading: (
        Literal[
            "clockwise from grid north", "clockwise from true north", "counterclockwise from east"
        ]
        | None
    ) = None
    pitch: Literal["nose up", "nose down"] | None = None
    roll: Literal["right side down", "right side up"] | None = None
    axes: Literal["right-forward-up", "forward-left-up", "forward-right-down"] | None = None
    corrected_by: list[str] = Field(default_factory=list)  # names of control points


class SessionSection(TrajectorySection):
    """One of several trajectories, and the points that it belongs to."""

    files: Annotated[list[str], Field(min_length=1)] | None = None
    point_source_ids: Annotated[list[PointSource], Field(min_length=1)] | None = None
