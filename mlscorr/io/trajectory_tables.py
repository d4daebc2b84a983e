"""Trajectories in tables: our own columns, those of Inertial Explorer and others, and TUM's.

TUM's rows are `time x y z qx qy qz qw` without a header, parted by blanks.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from mlscorr.io.column_names import ANGLES, AXES, TRAJECTORY_NAMES, UNITS, plain
from mlscorr.io.conventions import (
    QUATERNION,
    UNIT_TOLERANCE,
    Conventions,
    attitude_of_quaternions,
    in_our_conventions,
)
from mlscorr.io.layout_search import NUMBER
from mlscorr.io.layouts import TableLayout
from mlscorr.io.open_places import OpenPlace, OpenQuestion
from mlscorr.io.survey_sections import TrajectorySection
from mlscorr.io.table_rows import read_numbers
from mlscorr.io.tables import read_layout
from mlscorr.io.trj import read_trj

COLUMNS = ("gps_time", *AXES, *ANGLES)
POSITION_SIGMAS = ("sigma_easting", "sigma_northing", "sigma_height")
ATTITUDE_SIGMAS = ("sigma_roll", "sigma_pitch", "sigma_heading")
SESSION = ("session",)  # of the POS, in a trajectory that was joined of several
GRID, TRUE = "clockwise from grid north", "clockwise from true north"
FROM_EAST = "counterclockwise from east"
TUM = ("gps_time", *AXES, *QUATERNION)
TRUE_NORTH_USUAL = {"hell", "hdngsd", "eastsd"}  # columns of Inertial Explorer and POSPac alone
HINTS = {
    ("easting", "x"): " Say under [trajectory.columns] in survey.toml which of X and Y is easting, "
    "or longitude where they are angles.",
    ("heading", "yaw"): (
        " Its yaw is a heading by convention only: say under [trajectory] in survey.toml how "
        f'it counts, as heading = "{FROM_EAST}" or "{GRID}".'
    ),
}
HINT_PLACES = {
    ("heading", "yaw"): OpenPlace(
        ("trajectory", "heading"), (FROM_EAST, GRID), "direction in which the yaw counts"
    ),
}


def read_table(
    path: Path, section: TrajectorySection, crs: str | None
) -> tuple[dict[str, np.ndarray], str | None]:
    """Columns of a trajectory in our names, units and conventions, and what was understood.

    Parameters
    ----------
    path : Path
    section : TrajectorySection
    crs : str or None

    Returns
    -------
    table : dict
        Name of a column to an (n,) array. Units: s, m, deg.
    layout : str or None
        A sentence; None for our own columns without conventions of others.

    Raises
    ------
    ValueError
        For missing columns, cells that are no numbers, and conventions that are not known.
    """

    def lacking(names: Collection[str]) -> list[str]:
        is_projected = "latitude" not in names or {"easting", "northing"} <= set(names)
        place = AXES if is_projected else ("latitude", "longitude", "height")
        angles = ("roll", "pitch", "yaw" if section.heading and "yaw" in names else "heading")
        return [name for name in ("gps_time", *place, *angles) if name not in names]

    groups, chosen = (POSITION_SIGMAS, ATTITUDE_SIGMAS, SESSION), section.columns.chosen
    layout = read_layout(
        path, COLUMNS, groups, TRAJECTORY_NAMES, lacking, chosen, tum_columns, HINTS, HINT_PLACES
    )
    layout = layout if layout.is_own else _used(layout)
    if section.angles:
        angles = (*ANGLES, "yaw", *ATTITUDE_SIGMAS)
        factors = {name: UNITS[section.angles] for name in angles if name in layout.columns}
        layout = replace(layout, factors=layout.factors | factors)
    table = _place_in_degrees(path, layout, read_numbers(layout).T, section.angles)
    if "qw" in layout.columns:
        table, axes = attitude_of_quaternions(path, table, section.axes)
        return table, f"{layout}; body axes {axes}{layout.not_used}."
    if "yaw" in table:
        table["heading"] = table.pop("yaw")
    conventions = Conventions.of(section, _usual_heading(layout, section))
    given = section.model_fields_set & {"angles", "heading", "pitch", "roll"}
    if layout.is_own and not given:
        return table, None
    table = in_our_conventions(path, table, conventions, crs)
    degrees = "" if "roll" in layout.factors else ", angles in degrees"
    where = (
        f"; latitude and longitude in the datum of {crs}" if "latitude" in layout.columns else ""
    )
    return table, f"{layout}{where}; {conventions}{degrees}{layout.not_used}."


def read_terrascan(
    path: Path, section: TrajectorySection, crs: str | None
) -> tuple[dict[str, np.ndarray], str]:
    """Columns of a TerraScan trajectory in our conventions, and what was understood.

    Parameters
    ----------
    path, section, crs
        See read_table.

    Returns
    -------
    table : dict
    layout : str
    """
    conventions = Conventions.of(section, GRID)
    table = in_our_conventions(path, read_trj(path), conventions, crs)
    return table, f"{path.name} was read as a TerraScan trajectory; {conventions}."


def tum_columns(cells: Sequence[str]) -> Mapping[str, int]:
    """Columns of a row in TUM's layout: eight numbers, the last four a unit quaternion.

    Parameters
    ----------
    cells : sequence of str

    Returns
    -------
    mapping
        Empty for a row in another layout.
    """
    if len(cells) != len(TUM) or not all(map(NUMBER.fullmatch, cells)):
        return {}
    length = np.linalg.norm([float(cell.replace(",", ".")) for cell in cells[4:]])
    is_attitude = abs(length - 1.0) < UNIT_TOLERANCE
    return dict(zip(TUM, range(len(TUM)), strict=True)) if is_attitude else {}


def _used(layout: TableLayout) -> TableLayout:
    """The layout with the columns that are used: one kind of place, sigmas of all axes or none."""
    columns = layout.columns
    needless = {"x", "y"}
    needless |= {"latitude", "longitude"} if "easting" in columns else set()
    needless |= {"yaw"} if "heading" in columns else set()
    for group in (POSITION_SIGMAS, ATTITUDE_SIGMAS):
        needless |= set() if set(group) <= set(columns) else set(group)
    return replace(layout, columns={name: i for name, i in columns.items() if name not in needless})


def _place_in_degrees(path, layout, values, angles):
    """The table, with latitude and longitude in degrees where all angles are said to be radians."""
    table = dict(zip(layout.columns, values, strict=True))
    place = {name: table[name] for name in ("latitude", "longitude") if name in table}
    if not place or not all(np.abs(degrees).max() <= np.pi for degrees in place.values()):
        return table  # within 3.14 deg of 0, 0 there is no land
    if angles != "rad":
        raise OpenQuestion(
            f"{path} has latitudes and longitudes that seem to be radians: none exceeds pi. If so, "
            'write angles = "rad" under [trajectory] in survey.toml, or the unit behind the names '
            "of these columns alone, as Lat [rad].",
            [OpenPlace(("trajectory", "angles"), ("rad",), "unit of the angles")],
        )
    return table | {name: np.degrees(radians) for name, radians in place.items()}


def _usual_heading(layout, section):
    """How headings count where survey.toml doesn't say: from true north beside a latitude."""
    if "latitude" in layout.columns:
        return TRUE
    if not section.heading and set(map(plain, layout.header)) & TRUE_NORTH_USUAL:
        raise OpenQuestion(
            f"{layout.path} was exported by Inertial Explorer, or by POSPac, whose headings count "
            "from true north unless the export takes the convergence off. Say which under "
            f'[trajectory] in survey.toml: heading = "{TRUE}" or "{GRID}".',
            [OpenPlace(("trajectory", "heading"), (TRUE, GRID), "direction of headings")],
        )
    return GRID
