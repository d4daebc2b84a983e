"""Paths that a simulated vehicle follows, from files of several kinds.

A path is moved to where the simulation wants it, so only its shape, its attitude and its timing
matter. An attitude is taken only from files whose convention is known (our own CSV, SBET);
for all others it is left to the course over ground.
"""

from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from mlscorr.io.sbet import SBET_FIELDS
from mlscorr.io.tables import ENCODING, read_header
from mlscorr.io.trajectory import SBET_SUFFIXES, read_trajectory

MICROSECONDS = 1e13  # a time beyond this counts microseconds: seconds would be 300 000 years
POS_COLUMNS = ("time", "latitude", "longitude", "height")  # then sigmas, of a .pos
LAYOUTS = (  # time, east, north, up of CSV files with an attitude of unknown convention
    ("gpstime", "easting", "northing", "altitude"),  # pyboreas
    ("gps_time", "x", "y", "z"),  # NovAtel as SensorsCalibration exports it
)


@dataclass(frozen=True)
class Poses:
    """Positions over time, with attitudes R_P^G where the file has them in a known convention.

    gps_time (n,) in s, position (n, 3) easting, northing, height in m, attitude Rotation or None.
    """

    gps_time: np.ndarray
    position: np.ndarray
    attitude: Rotation | None = None

    def __len__(self):
        return len(self.gps_time)


def read_poses(path):
    """Poses of a trajectory CSV, an SBET, a GNSS .pos, or a CSV of pyboreas or NovAtel.

    Geographic files are brought into the UTM zone of their own first position. Raises ValueError
    for an unknown layout, times that don't increase, or values that are not numbers.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix in SBET_SUFFIXES:
        return _with_attitude(read_trajectory(path, _sbet_zone(path)))
    if suffix == ".pos":
        return _checked(path, *_read_pos(path))
    if suffix != ".csv":
        raise ValueError(
            f"{path} has the unknown suffix '{path.suffix}'; a path is .csv, .pos or SBET "
            f"({', '.join(SBET_SUFFIXES)})."
        )
    header, skip = read_header(path)
    for layout in LAYOUTS:
        if set(layout) <= set(header):
            return _checked(path, *_read_layout(path, skip, [header.index(n) for n in layout]))
    return _with_attitude(read_trajectory(path))


def _with_attitude(trajectory):
    return Poses(trajectory.gps_time, trajectory.position, trajectory.attitude)


def _checked(path, gps_time, position):
    """Poses without attitude, in increasing time."""
    table = np.column_stack([gps_time, position])
    bad = ~np.isfinite(table).all(axis=1)
    if bad.any() or len(table) < 2:
        raise ValueError(
            f"{path} has {len(table)} epochs, of which {bad.sum()} hold values that are not "
            "numbers; a path needs at least 2 epochs and numbers only."
        )
    if (np.diff(gps_time) <= 0).any():
        first = int(np.argmax(np.diff(gps_time) <= 0))
        raise ValueError(
            f"The times of {path} must increase: {(np.diff(gps_time) <= 0).sum()} epochs do not "
            f"come after the one before (first: epoch {first + 2})."
        )
    return Poses(gps_time, position)


def _read_pos(path):
    """Times and positions of rows `time latitude longitude height ...`, degrees and m."""
    try:
        table = np.loadtxt(path, usecols=range(4), ndmin=2, encoding=ENCODING, comments=("%", "#"))
    except ValueError as error:
        raise ValueError(
            f"{path} is not a table of {', '.join(POS_COLUMNS)} (s, deg, deg, m): {error}"
        ) from None
    if not len(table) or np.abs(table[:, 1]).max() > 90 or np.abs(table[:, 2]).max() > 360:
        raise ValueError(
            f"{path} is not a table of {', '.join(POS_COLUMNS)} (s, deg, deg, m): its second and "
            "third columns are no latitude and longitude in degrees."
        )
    from pyproj import Transformer

    zone = _utm_zone(*table[0, 1:3])
    to_map = Transformer.from_crs("EPSG:4326", zone, always_xy=True)
    easting, northing = to_map.transform(table[:, 2], table[:, 1])
    return table[:, 0], np.column_stack([easting, northing, table[:, 3]])


def _sbet_zone(path):
    """UTM zone of an SBET's first position; any for a broken file, which the reader will name."""
    record = np.fromfile(path, dtype="<f8", count=len(SBET_FIELDS))
    if len(record) < len(SBET_FIELDS) or not np.isfinite(record[1:3]).all():
        return "EPSG:32631"
    return _utm_zone(*np.degrees(record[1:3]))


def _utm_zone(latitude, longitude):
    """EPSG code of the WGS 84 UTM zone of a place in degrees.

    >>> _utm_zone(30.46, 114.47), _utm_zone(-33.9, 151.2)
    ('EPSG:32650', 'EPSG:32756')
    """
    zone = int(np.floor((longitude + 180.0) / 6.0)) % 60 + 1
    return f"EPSG:{(32600 if latitude >= 0 else 32700) + zone}"


def _read_layout(path, skip, columns):
    """Times (s) and positions of a CSV whose columns have been found."""
    times, rows = [], []
    with path.open(encoding=ENCODING) as file:
        for number, line in enumerate(file, start=1):
            cells = line.strip().split(",")
            if number <= skip or cells == [""]:
                continue
            try:
                times.append(_seconds(cells[columns[0]]))
                rows.append([float(cells[column]) for column in columns[1:]])
            except (ValueError, IndexError):
                raise ValueError(
                    f"Line {number} of {path} is no row of time, east, north and up: "
                    f"'{line.strip()[:60]}'."
                ) from None
    times = np.array(times)
    return times, np.array(rows).reshape(-1, 3)


def _seconds(cell):
    """Time (s) of a cell in seconds, in microseconds, or as year-month-day-h-m-s-ms.

    >>> _seconds("1628184886518266"), _seconds("1970-01-02-00-00-00-029")
    (1628184886.518266, 86400.029)
    """
    if cell.count("-") == 6:
        day, milliseconds = cell.rsplit("-", 1)
        elapsed = datetime.strptime(day, "%Y-%m-%d-%H-%M-%S") - datetime(1970, 1, 1)
        return elapsed.total_seconds() + float(milliseconds) / 1e3
    time = float(cell)
    return time / 1e6 if time > MICROSECONDS else time
