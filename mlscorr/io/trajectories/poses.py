"""Data from a real POS for a simulated one: the path, and series of its errors.

The simulation moves a path to its own location, so only shape, attitude and timing matter. An
attitude is read only from files with a known convention (our own CSV, SBET); for all others it
follows the course over ground.
"""

from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np
from pyproj import Transformer
from scipy.spatial.transform import Rotation

from mlscorr.io.settings import SETTINGS
from mlscorr.io.store import ENCODING
from mlscorr.io.tables import TableLayout, check_finite, check_increasing, read_header, read_numbers
from mlscorr.io.trajectories.sbet import SBET_FIELDS
from mlscorr.io.trajectories.time_systems import count_on
from mlscorr.io.trajectories.trajectory import SBET_SUFFIXES, read_trajectory

_SERIES_COLUMNS = ("time", *"NED", *(f"velocity {axis}" for axis in "NED"), "roll", "pitch", "yaw")
_POS_COLUMNS = ("time", "latitude", "longitude", "height")  # then sigmas, of a .pos
_LAYOUTS = (  # time, east, north, up of CSV files with an unknown attitude convention
    ("gpstime", "easting", "northing", "altitude"),  # pyboreas
    ("gps_time", "x", "y", "z"),  # NovAtel as exported by SensorsCalibration
)


@dataclass(frozen=True)
class Poses:
    """Positions over time, with attitudes if the file has them in a known convention.

    Parameters
    ----------
    gps_time : (n,) array
        Units: s.
    position : (n, 3) array
        Easting, northing, height. Units: m.
    attitude : Rotation, optional
        R_P^G.
    """

    gps_time: np.ndarray
    position: np.ndarray
    attitude: Rotation | None = None

    def __len__(self) -> int:
        return len(self.gps_time)


def read_poses(path: str | Path) -> Poses:
    """Read poses from a trajectory CSV, an SBET, a GNSS .pos, or a CSV of pyboreas or NovAtel.

    Geographic files are converted to the UTM zone of their first position.

    Parameters
    ----------
    path : path

    Returns
    -------
    Poses

    Raises
    ------
    ValueError
        If the layout is unknown, times do not increase, or values are not numbers.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix == ".pos":
        return _checked(path, _read_pos(path))
    if suffix == ".csv":
        header, lines = read_header(path)
        for layout in _LAYOUTS:
            if set(layout) <= set(header):
                columns = {name: header.index(name) for name in layout}
                table = TableLayout(path, tuple(header), lines, columns, is_own=True)
                return _checked(path, read_numbers(table, {columns[layout[0]]: _seconds}))
    elif suffix not in SBET_SUFFIXES:
        raise ValueError(
            f"{path} has the unknown suffix '{path.suffix}'; a path is .csv, .pos or SBET "
            f"({', '.join(SBET_SUFFIXES)})."
        )
    crs = None
    if suffix in SBET_SUFFIXES:
        crs = _sbet_zone(path)
    trajectory = read_trajectory(path, crs)
    return Poses(trajectory.gps_time, trajectory.position, trajectory.attitude)


def _checked(path, table):
    """Poses of a table (n, 4) of times and positions, without attitude."""
    check_finite(path, table, "epoch")
    if len(table) < 2:
        raise ValueError(f"{path} has {len(table)} epochs; a path needs at least 2.")
    gps_time, _ = count_on(table[:, 0])
    check_increasing(path, gps_time, "epoch")
    return Poses(gps_time, table[:, 1:])


def _read_pos(path):
    """Read times and map positions (n, 4) of rows `time latitude longitude height ...`, deg and
    m.
    """
    try:
        table = np.loadtxt(path, usecols=range(4), ndmin=2, encoding=ENCODING, comments=("%", "#"))
        if not len(table) or np.abs(table[:, 1]).max() > 90 or np.abs(table[:, 2]).max() > 360:
            raise ValueError(
                "its second and third columns are not latitude and longitude in degrees."
            )
    except ValueError as error:
        raise ValueError(
            f"{path} is not a table of {', '.join(_POS_COLUMNS)} (s, deg, deg, m): {error}"
        ) from None
    to_map = Transformer.from_crs("EPSG:4326", utm_zone(*table[0, 1:3]), always_xy=True)
    table[:, 1], table[:, 2] = to_map.transform(table[:, 2], table[:, 1])
    return table


def _sbet_zone(path):
    """UTM zone of an SBET's first position; any for a broken file, which the reader reports."""
    record = np.fromfile(path, dtype="<f8", count=len(SBET_FIELDS))
    if len(record) < len(SBET_FIELDS) or not np.isfinite(record[1:3]).all():
        return "EPSG:32631"
    return utm_zone(*np.degrees(record[1:3]))


def utm_zone(latitude: float, longitude: float) -> str:
    """EPSG code of the WGS 84 UTM zone of a position.

    Parameters
    ----------
    latitude, longitude : float
        Units: deg.

    Examples
    --------
    >>> utm_zone(30.46, 114.47), utm_zone(-33.9, 151.2)
    ('EPSG:32650', 'EPSG:32756')
    """
    zone = int(np.floor((longitude + 180.0) / 6.0)) % 60 + 1
    if latitude >= 0:
        return f"EPSG:326{zone:02d}"
    return f"EPSG:327{zone:02d}"


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
    if time > SETTINGS.microseconds:
        return time / 1e6
    return time


@dataclass(frozen=True)
class PosErrorSeries:
    """Recorded minus true pose over time.

    Parameters
    ----------
    gps_time : (n,) array
        Increasing. Units: s.
    position : (n, 3) array
        E, N, H. Units: m.
    attitude : (n, 3) array
        Roll, pitch, heading. Units: rad.
    """

    gps_time: np.ndarray
    position: np.ndarray
    attitude: np.ndarray


def read_pos_error_series(path: str | Path) -> PosErrorSeries:
    """Read errors of an .err file: time (s), N, E, D (m), three velocities, roll, pitch, yaw (deg).

    Parameters
    ----------
    path : path

    Returns
    -------
    PosErrorSeries

    Raises
    ------
    ValueError
        If the file is not such a table of numbers, or its times do not increase.
    """
    try:
        table = np.loadtxt(path, ndmin=2, comments="#")
    except (ValueError, UnicodeDecodeError) as error:
        raise ValueError(f"{path} is not a table of numbers: {str(error).rstrip('.')}.") from None
    if len(table) < 2 or table.shape[1] != len(_SERIES_COLUMNS):
        raise ValueError(
            f"{path} has {len(table)} rows of {table.shape[-1]} columns; at least 2 rows of "
            f"{len(_SERIES_COLUMNS)} columns are expected: {', '.join(_SERIES_COLUMNS)}."
        )
    check_finite(path, table, "row")
    gps_time, north, east, down = table[:, :4].T
    check_increasing(path, gps_time, "row")
    return PosErrorSeries(
        gps_time, np.column_stack([east, north, -down]), np.radians(table[:, -3:])
    )
