"""Files of positions that are no trajectory: without attitude, or in geocentric coordinates.

GNSS alone gives positions; the attitude of a scanner comes from a GNSS/INS. Columns of RTKLIB are
those of its manual, appendix B.1 (solution file).
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from mlscorr.io.tables import (
    NUMBER,
    TRAJECTORY_NAMES,
    find_layout,
    find_meanings,
    likely_header,
    plain,
    read_numbers,
)
from mlscorr.io.trajectories.conventions import QUATERNION
from mlscorr.survey import AXES

POSITION_SUFFIX = ".pos"
RTKLIB = {"q", "ns", "ratio"}  # plain names: quality, number of satellites, ratio of ambiguities
RADII = (6.34e6, 6.40e6)  # m, from the Earth's center to its surface (6 357 to 6 378 km) and above
LARGEST_HEIGHT = 2e4  # m, of any vehicle; geocentric Z is less only within 0.2 deg of the equator
PLACES = (("latitude", "longitude"), ("easting", "northing"), ("x", "y"))
EXPORTS = (
    "Export the GNSS/INS solution: an SBET (POSPac, Qinertia), or text with GPSTime, Easting, "
    "Northing, H-Ell, Roll, Pitch and Heading (Inertial Explorer, POSPac)."
)
PROJECTED = (
    "Export easting, northing and height in the projected CRS of cloud and control, or latitude, "
    "longitude and ellipsoidal height (an SBET of POSPac has these)."
)


def position_file(path: Path) -> str:
    """The sentences on a file of positions alone, or of geocentric ones; empty for any other.

    Parameters
    ----------
    path : Path
        A table in which columns of a trajectory are missing.
    """
    header = likely_header(path, TRAJECTORY_NAMES)
    if header and all(map(NUMBER.fullmatch, header)):
        if path.suffix.lower() != POSITION_SUFFIX:
            return ""
        return (
            f"{path} is a position file without names of columns ({len(header)} numbers a row, as "
            "time, latitude, longitude, height and their sigmas), and without roll, pitch and "
            f"heading. {EXPORTS}"
        )
    known = find_meanings(header, TRAJECTORY_NAMES)
    words = set(map(plain, header))
    is_rtklib = words >= RTKLIB
    is_oriented = not {"roll", "pitch", "heading", "yaw", *QUATERNION}.isdisjoint(known)
    is_geocentric = any("ecef" in word for word in words) or _is_geocentric_table(path, known)
    if is_geocentric and is_oriented:
        return f"{path} has geocentric coordinates X, Y, Z (ECEF). {PROJECTED}"
    used = {place for places in known.values() for place in places}
    is_placed = is_geocentric or any(set(names) <= set(known) for names in PLACES)
    is_whole = "gps_time" in known and used == set(range(len(header)))
    if is_oriented or not (is_rtklib or (is_placed and (is_whole or is_geocentric))):
        return ""
    if is_rtklib:
        kind = "an RTKLIB position file"
    else:
        kind = "a file of positions"
    if is_geocentric:
        frame = ", in geocentric coordinates X, Y, Z (ECEF)"
    else:
        frame = ""
    return f"{path} is {kind} without attitude (roll, pitch, heading){frame}. {EXPORTS}"


def check_projected(path: Path, table: dict[str, np.ndarray]) -> None:
    """Refuse geocentric coordinates in columns of easting, northing and height.

    Parameters
    ----------
    path : Path
        For messages.
    table : dict
        Name of a column to an (n,) array. Units: m.

    Raises
    ------
    ValueError
        States the distance from the Earth's center.
    """
    if set(AXES) <= set(table) and _is_geocentric([table[name] for name in AXES]):
        raise ValueError(
            f"{path} has geocentric coordinates (ECEF): its epochs lie "
            f"{_radius([table[name] for name in AXES]) / 1e3:.0f} km from the Earth's center, with "
            f"heights of {np.median(table['height']) / 1e3:.0f} km. {PROJECTED}"
        )


def _is_geocentric_table(path, known):
    """Return True if X, Y and Z of a table are geocentric by their size."""
    columns = ("x", "y", "height")
    if not set(columns) <= set(known):
        return False
    try:
        layout = find_layout(
            path, TRAJECTORY_NAMES, lambda names: [name for name in columns if name not in names]
        )
        places = {name: layout.columns[name] for name in columns}
        return _is_geocentric(read_numbers(replace(layout, columns=places)).T)
    except ValueError:  # which its reader says
        return False


def _is_geocentric(places):
    """Return True if geocentric places (x, y, z; m) lie near the Earth's surface."""
    is_far = np.abs(np.median(places[2])) > LARGEST_HEIGHT
    return bool(is_far and RADII[0] < _radius(places) < RADII[1])


def _radius(places):
    """Median distance from the origin. Units: m."""
    return float(np.median(np.linalg.norm(places, axis=0)))
