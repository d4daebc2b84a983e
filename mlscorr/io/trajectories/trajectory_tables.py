"""Trajectories in tables: our own columns, those of Inertial Explorer and others, and TUM's.

TUM's rows are `time x y z qx qy qz qw` without a header, separated by blanks. With a header, its
names define the columns, because other programs write qw first. Files with only positions are
refused, because GNSS gives no attitude (for RTKLIB's columns see its manual, appendix B.1), and so
are geocentric coordinates, which are not map coordinates.
"""

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from mlscorr.io.store import OpenPlace, OpenQuestion, shown
from mlscorr.io.tables import (
    ANGLES,
    NUMBER,
    TRAJECTORY_NAMES,
    UNITS,
    TableLayout,
    find_layout,
    find_meanings,
    likely_header,
    plain,
    read_layout,
    read_numbers,
)
from mlscorr.io.trajectories._trj import read_trj
from mlscorr.io.trajectories.conventions import (
    QUATERNION,
    UNIT_TOLERANCE,
    Conventions,
    TrajectorySection,
    attitude_of_quaternions,
    in_our_conventions,
)
from mlscorr.io.trajectories.time_systems import counting_on
from mlscorr.survey import AXES, SurveyFileError

POSITION_SUFFIX = ".pos"
_RTKLIB = {"q", "ns", "ratio"}  # plain names: quality, number of satellites, ambiguity ratio
_RADII = (6.34e6, 6.40e6)  # m, from the Earth's center to its surface (6 357 to 6 378 km) and above
_LARGEST_HEIGHT = 2e4  # m, of any vehicle; geocentric Z is less only within 0.2 deg of the equator
_PLACES = (("latitude", "longitude"), ("easting", "northing"), ("x", "y"))
_EXPORTS = (
    "Export the GNSS/INS solution: an SBET (POSPac, Qinertia), or text with GPSTime, Easting, "
    "Northing, H-Ell, Roll, Pitch and Heading (Inertial Explorer, POSPac)."
)
_PROJECTED = (
    "Export easting, northing and height in the projected CRS of cloud and control, or latitude, "
    "longitude and ellipsoidal height (an SBET of POSPac has these)."
)
COLUMNS = ("gps_time", *AXES, *ANGLES)
POSITION_SIGMAS = ("sigma_easting", "sigma_northing", "sigma_height")
ATTITUDE_SIGMAS = ("sigma_roll", "sigma_pitch", "sigma_heading")
SESSION = ("session",)  # of the POS, in a trajectory joined from several
GRID = "clockwise from grid north"
TRUE = "clockwise from true north"
FROM_EAST = "counterclockwise from east"
TUM = ("gps_time", *AXES, *QUATERNION)
ORDER = re.compile(r"q.{0,3}|.*(quat|orient|rot).*|w")  # plain names of a quaternion's columns
TIME_UNITS = {"nanoseconds": 1e-9, "microseconds": 1e-6, "milliseconds": 1e-3}  # s
EARLIEST = 1e8  # s since 1970: 1973
LATEST = 1e11  # s since 1970: 5138; 1000 times more, so that units do not overlap
TRUE_NORTH_USUAL = {"hell", "hdngsd", "eastsd"}  # columns only in Inertial Explorer and POSPac
HINTS = {
    ("easting", "x"): (
        " Set under [trajectory.columns] in survey.toml which of X and Y is easting, or "
        "longitude if they are angles.",
        (),
    ),
    ("heading", "yaw"): (
        f' A yaw column may count in different directions: set heading = "{FROM_EAST}" or '
        f'"{GRID}" under [trajectory] in survey.toml.',
        (
            OpenPlace(
                ("trajectory", "heading"), (FROM_EAST, GRID), "direction in which the yaw counts"
            ),
        ),
    ),
}


def read_table(
    path: Path, section: TrajectorySection, crs: str | None
) -> tuple[dict[str, np.ndarray], str | None]:
    """Columns of a trajectory in our names, units and conventions, and their interpretation.

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
        A sentence; None for our own columns and conventions.

    Raises
    ------
    ValueError
        For missing columns, cells that are not numbers, and unknown conventions.
    """
    groups = (POSITION_SIGMAS, ATTITUDE_SIGMAS, SESSION)
    chosen = section.columns.chosen

    def lacking(names: Collection[str]) -> list[str]:
        is_projected = "latitude" not in names or {"easting", "northing"} <= set(names)
        place = AXES
        if not is_projected:
            place = ("latitude", "longitude", "height")
        angles = ANGLES
        if section.heading and "yaw" in names:
            angles = ("roll", "pitch", "yaw")
        if _is_quaternion(names, chosen):
            angles = QUATERNION
            is_named = {"easting", "northing"} & set(names) or not is_projected
            if not (is_named or "x" not in names):
                place = ("x", "y", "height")
        return [name for name in ("gps_time", *place, *angles) if name not in names]

    try:
        layout = read_layout(
            path, COLUMNS, groups, TRAJECTORY_NAMES, lacking, chosen, tum_columns, HINTS
        )
    except ValueError as error:
        if isinstance(error, SurveyFileError) or not (other := position_file(path)):
            raise
        raise ValueError(other) from None
    _check_order(layout, lacking, chosen)
    if not layout.is_own:
        layout = _used(layout, _is_quaternion(layout.columns, chosen))
    if section.angles:
        angles = (*ANGLES, "yaw", *ATTITUDE_SIGMAS)
        factors = {name: UNITS[section.angles] for name in angles if name in layout.columns}
        layout = replace(layout, factors=layout.factors | factors)
    table = _place_in_degrees(path, layout, read_numbers(layout).T, section.angles)
    _check_projected(path, table)
    table, unit = _in_seconds(layout, table)
    table = counting_on(table)
    if "qw" in layout.columns:
        table, axes = attitude_of_quaternions(path, table, section.axes, crs)
        return table, f"{layout}{unit}; body axes {axes}{layout.not_used}."
    if "yaw" in table:
        table["heading"] = table.pop("yaw")
    conventions = Conventions.of(section, _usual_heading(layout, section))
    given = section.model_fields_set & {"angles", "heading", "pitch", "roll"}
    if layout.is_own and not given:
        if unit:
            return table, f"{layout}{unit}."
        return table, None
    table = in_our_conventions(path, table, conventions, crs)
    sentence = f"{layout}{unit}"
    if "latitude" in layout.columns:
        sentence += f"; latitude and longitude in the datum of {crs}"
    sentence += f"; {conventions}"
    if "roll" not in layout.factors:
        sentence += ", angles in degrees"
    return table, f"{sentence}{layout.not_used}."


def read_terrascan(
    path: Path, section: TrajectorySection, crs: str | None
) -> tuple[dict[str, np.ndarray], str]:
    """Columns of a TerraScan trajectory in our conventions, and their interpretation.

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
    table = in_our_conventions(path, counting_on(read_trj(path)), conventions, crs)
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
    if is_attitude:
        return dict(zip(TUM, range(len(TUM)), strict=True))
    return {}


def _is_quaternion(names, chosen):
    """True if a quaternion gives the attitude: it was chosen, or there are no angles."""
    is_there = not set(QUATERNION).isdisjoint(names)
    has_angles = {"roll", "pitch"} <= set(names) and not {"heading", "yaw"}.isdisjoint(names)
    return is_there and (not has_angles or not set(QUATERNION).isdisjoint(chosen))


def _check_order(layout, lacking, chosen):
    """Refuse a quaternion by position if a header names its columns in unknown words."""
    if layout.header or "qw" not in layout.columns or chosen:
        return
    header = likely_header(layout.path, TRAJECTORY_NAMES)
    if len(header) == len(TUM) and any(ORDER.fullmatch(plain(cell)) for cell in header):
        known = find_meanings(header, TRAJECTORY_NAMES)
        missing = lacking({*known, "qw"}) + ["qw"] * ("qw" not in known)
        raise ValueError(
            f"{layout.path} names its columns {', '.join(map(shown, header))}, so "
            f"{', '.join(missing)} can't be identified. Number all under [trajectory.columns] in "
            "survey.toml, as gps_time = 1, easting = 2, northing = 3, height = 4, qx = 5, qy = "
            "6, qz = 7, qw = 8."
        )


def _in_seconds(layout, table):
    """Table with times in seconds, and a phrase on the unit if it was deduced from their size."""
    known = np.abs(table["gps_time"][np.isfinite(table["gps_time"])])
    if "gps_time" in layout.factors or not len(known):
        return table, ""
    size = float(np.median(known))
    for unit, factor in TIME_UNITS.items():
        if EARLIEST <= size * factor < LATEST <= size:
            seconds = table | {"gps_time": table["gps_time"] * factor}
            return seconds, f"; times in {unit} by their size"
    return table, ""


def _used(layout: TableLayout, is_quaternion: bool) -> TableLayout:
    """Layout with the used columns: one kind of position, sigmas of all axes or none.

    With a quaternion, x is east and y north, because other axes would not be right-handed.
    """
    columns = layout.columns
    if is_quaternion and "easting" not in columns and "latitude" not in columns:
        horizontal = {"x": "easting", "y": "northing"}
        columns = {horizontal.get(name, name): place for name, place in columns.items()}
        factors = {horizontal.get(name, name): factor for name, factor in layout.factors.items()}
        layout = replace(layout, factors=factors)
    needless = {"x", "y"}
    if is_quaternion:
        needless.update(ANGLES, ["yaw"])
    else:
        needless.update(QUATERNION)
    if "easting" in columns:
        needless.update(("latitude", "longitude"))
    if "heading" in columns:
        needless.add("yaw")
    for group in (POSITION_SIGMAS, ATTITUDE_SIGMAS):
        if not set(group) <= set(columns):
            needless.update(group)
    return replace(layout, columns={name: i for name, i in columns.items() if name not in needless})


def _place_in_degrees(path, layout, values, angles):
    """Table with latitude and longitude in degrees, if all angles are stated in radians."""
    table = dict(zip(layout.columns, values, strict=True))
    place = {name: table[name] for name in ("latitude", "longitude") if name in table}
    if not place or not all(np.abs(degrees).max() <= np.pi for degrees in place.values()):
        return table  # there is no land within 3.14 deg of 0, 0
    if angles != "rad":
        raise OpenQuestion(
            f"The latitudes and longitudes of {path} seem to be radians: none exceeds pi. If so, "
            'set angles = "rad" under [trajectory] in survey.toml, or add the unit to the '
            "names of these columns, as Lat [rad].",
            [OpenPlace(("trajectory", "angles"), ("rad",), "unit of the angles")],
        )
    return table | {name: np.degrees(radians) for name, radians in place.items()}


def _usual_heading(layout, section):
    """Default heading convention: from true north if there is a latitude."""
    if "latitude" in layout.columns:
        return TRUE
    if not section.heading and set(map(plain, layout.header)) & TRUE_NORTH_USUAL:
        raise OpenQuestion(
            f"{layout.path} was exported by Inertial Explorer or POSPac. Their headings count "
            "from true north unless the convergence was removed on export: set heading = "
            f'"{TRUE}" or "{GRID}" under [trajectory] in survey.toml.',
            [OpenPlace(("trajectory", "heading"), (TRUE, GRID), "direction of headings")],
        )
    return GRID


def position_file(path: Path) -> str:
    """Sentences on a file of only positions, or of geocentric ones; empty for any other.

    Parameters
    ----------
    path : Path
        Table without some columns of a trajectory.
    """
    header = likely_header(path, TRAJECTORY_NAMES)
    if header and all(map(NUMBER.fullmatch, header)):
        if path.suffix.lower() != POSITION_SUFFIX:
            return ""
        return (
            f"{path} is a position file without column names ({len(header)} numbers per row, as "
            "time, latitude, longitude, height and their sigmas), and without roll, pitch and "
            f"heading. {_EXPORTS}"
        )
    known = find_meanings(header, TRAJECTORY_NAMES)
    words = set(map(plain, header))
    is_rtklib = words >= _RTKLIB
    is_oriented = not {"roll", "pitch", "heading", "yaw", *QUATERNION}.isdisjoint(known)
    is_geocentric = any("ecef" in word for word in words) or _is_geocentric_table(path, known)
    if is_geocentric and is_oriented:
        return f"{path} has geocentric coordinates X, Y, Z (ECEF). {_PROJECTED}"
    used = {place for places in known.values() for place in places}
    is_placed = is_geocentric or any(set(names) <= set(known) for names in _PLACES)
    is_whole = "gps_time" in known and used == set(range(len(header)))
    if is_oriented or not (is_rtklib or (is_placed and (is_whole or is_geocentric))):
        return ""
    kind = "an RTKLIB position file" if is_rtklib else "a file of positions"
    frame = ", in geocentric coordinates X, Y, Z (ECEF)" if is_geocentric else ""
    return f"{path} is {kind} without attitude (roll, pitch, heading){frame}. {_EXPORTS}"


def _check_projected(path, table):
    """Refuse geocentric coordinates in columns of easting, northing and height."""
    if not set(AXES) <= set(table):
        return
    places = [table[name] for name in AXES]
    if _is_geocentric(places):
        raise ValueError(
            f"{path} has geocentric coordinates (ECEF): its epochs are "
            f"{_radius(places) / 1e3:.0f} km from the Earth's center, with heights of "
            f"{np.median(table['height']) / 1e3:.0f} km. {_PROJECTED}"
        )


def _is_geocentric_table(path, known):
    """True if X, Y and Z of a table are geocentric, judged by their size."""
    columns = ("x", "y", "height")
    if not set(columns) <= set(known):
        return False
    try:
        layout = find_layout(
            path, TRAJECTORY_NAMES, lambda names: [name for name in columns if name not in names]
        )
        places = {name: layout.columns[name] for name in columns}
        return _is_geocentric(read_numbers(replace(layout, columns=places)).T)
    except ValueError:  # its reader reports the fault
        return False


def _is_geocentric(places):
    """True if geocentric positions (x, y, z; m) are near the Earth's surface."""
    is_far = np.abs(np.median(places[2])) > _LARGEST_HEIGHT
    return bool(is_far and _RADII[0] < _radius(places) < _RADII[1])


def _radius(places):
    """Median distance from the origin. Units: m."""
    return float(np.median(np.linalg.norm(places, axis=0)))
