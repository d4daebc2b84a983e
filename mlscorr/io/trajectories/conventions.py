"""Conversion of attitudes from other conventions, stated in survey.toml, to our own."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field
from scipy.spatial.transform import Rotation

from mlscorr.frames import angles_from_attitude
from mlscorr.io.settings import SETTINGS
from mlscorr.io.store import PLACE_OF_CRS, Column, OpenPlace, OpenQuestion, PointSource, TomlSection
from mlscorr.io.tables import ANGLES, PlaceColumns
from mlscorr.io.trajectories._course import heading_and_course, median_difference
from mlscorr.io.trajectories.projection import convergence_at, project
from mlscorr.survey import AXES

QUATERNION = ("qx", "qy", "qz", "qw")
UNIT_TOLERANCE = 1e-3  # of a quaternion's length, with three decimals
OUR_AXES = {  # right, forward and up in foreign body axes, as columns
    "right-forward-up": np.eye(3),
    "forward-left-up": np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
    "forward-right-down": np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]),
}


class TrajectoryColumns(PlaceColumns):
    """Columns of a trajectory."""

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
    """File of the trajectory, accuracy of an SBET, foreign columns and conventions."""

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
    """One of several trajectories, and its points."""

    files: Annotated[list[str], Field(min_length=1)] | None = None
    point_source_ids: Annotated[list[PointSource], Field(min_length=1)] | None = None


@dataclass(frozen=True)
class Conventions:
    """Conventions of the angles in a file, in words.

    Parameters
    ----------
    heading, pitch, roll : str
        See TrajectorySection.
    """

    heading: str
    pitch: str
    roll: str

    @classmethod
    def of(cls, section: TrajectorySection, heading: str) -> "Conventions":
        """Make the conventions named in survey.toml, otherwise ours with this heading.

        Parameters
        ----------
        section : TrajectorySection
        heading : str
        """
        return cls(
            section.heading or heading,
            section.pitch or "nose up",
            section.roll or "right side down",
        )

    def __str__(self) -> str:
        """Half a sentence on the conventions."""
        return f"heading {self.heading}, pitch {self.pitch}, roll {self.roll}"


def in_our_conventions(
    path: Path, table: dict[str, np.ndarray], conventions: Conventions, crs: str | None
) -> dict[str, np.ndarray]:
    """Convert a table to easting, northing and our angles.

    Parameters
    ----------
    path : Path
        For messages.
    table : dict
        Name of a column to an (n,) array. Units: s, m, deg.
    conventions : Conventions
    crs : str or None
        Required for latitude and longitude, and for headings from true north.

    Returns
    -------
    dict

    Raises
    ------
    ValueError
        If a required crs is missing.
    """
    table = dict(table)
    is_true = conventions.heading == "clockwise from true north"
    if "latitude" in table:
        table, convergence = _projected(path, table, crs)
    elif is_true:
        _check_crs(path, "headings from true north", crs)
        convergence = convergence_at(crs, table["easting"], table["northing"])
    if is_true:
        table["heading"] = table["heading"] - np.degrees(convergence)
    if conventions.heading == "counterclockwise from east":
        table["heading"] = 90.0 - table["heading"]
    if conventions.pitch == "nose down":
        table["pitch"] = -table["pitch"]
    if conventions.roll == "right side up":
        table["roll"] = -table["roll"]
    return table


def _check_crs(path, what, crs):
    """Refuse data that need the CRS of the map if survey.toml has none."""
    if crs is None:
        raise OpenQuestion(
            f"{path} has {what}: set crs in survey.toml to the projected CRS of cloud and control.",
            [PLACE_OF_CRS],
        )


def _projected(path, table, crs):
    """Table with easting and northing for latitude and longitude, and meridian convergence
    (rad).
    """
    _check_crs(path, "latitude and longitude", crs)
    record = {name: np.radians(table[name]) for name in ("latitude", "longitude", "height")}
    position, convergence = project(crs, record | {"height": table["height"]})
    rest = {name: v for name, v in table.items() if name not in ("latitude", "longitude")}
    return rest | dict(zip(AXES, position.T, strict=True)), convergence


def attitude_of_quaternions(
    path: Path, table: dict[str, np.ndarray], axes: str | None, crs: str | None = None
) -> tuple[dict[str, np.ndarray], str]:
    """Table with angles instead of quaternions, and the name of its body axes.

    Without a name, the axes are those with forward along the course and up pointing up.

    Parameters
    ----------
    path : Path
        For messages.
    table : dict
        With qx, qy, qz, qw from body axes into east, north, up; true east and north if there is a
        latitude.
    axes : str or None
        One of OUR_AXES.
    crs : str, optional
        Required for latitude and longitude.

    Returns
    -------
    table : dict
    axes : str

    Raises
    ------
    ValueError
        If the course does not determine the axes, or quaternions are invalid.
    """
    quaternion = np.column_stack([table[name] for name in QUATERNION])
    if not np.isclose(np.linalg.norm(quaternion, axis=1), 1.0, atol=UNIT_TOLERANCE).all():
        raise ValueError(
            f"{path} has quaternions whose length is not one, so they are not attitudes."
        )
    recorded = Rotation.from_quat(quaternion)
    convergence = 0.0
    if "latitude" in table:
        table, convergence = _projected(path, table, crs)
    position = np.column_stack([table["easting"], table["northing"]])
    tolerance = np.radians(SETTINGS.course_tolerance)
    fitting = []
    for name, our_axes in OUR_AXES.items():
        attitude = recorded * Rotation.from_matrix(our_axes)
        angles = np.column_stack(angles_from_attitude(attitude))
        angles[:, 2] -= convergence
        heading, course = heading_and_course(table["gps_time"], position, angles[:, 2])
        is_upright = (attitude.as_matrix()[:, 2, 2] > 0).all()
        is_along = len(course) and median_difference(heading, course) < tolerance
        if name == axes or (axes is None and is_upright and is_along):
            fitting.append((name, angles))
    if len(fitting) != 1:
        raise OpenQuestion(
            f"{path} has quaternions, and the course over ground does not identify their body "
            f"axes. Set axes under [trajectory] in survey.toml to one of {', '.join(OUR_AXES)}.",
            [OpenPlace(("trajectory", "axes"), tuple(OUR_AXES), "body axes of the quaternions")],
        )
    name, angles = fitting[0]
    rest = {key: values for key, values in table.items() if key not in QUATERNION}
    return rest | dict(zip(ANGLES, np.degrees(angles).T, strict=True)), name
