"""Error series of a real POS against a better one, as OB_GINS writes them (.err)."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mlscorr.io.tables import check_finite, check_increasing

COLUMNS = ("time", "N", "E", "D", "velocity N", "velocity E", "velocity D", "roll", "pitch", "yaw")


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
    """Errors of an .err file: time (s), N, E, D (m), three velocities, roll, pitch, yaw (deg).

    Parameters
    ----------
    path : path

    Returns
    -------
    PosErrorSeries

    Raises
    ------
    ValueError
        For a file that is not such a table of numbers, or whose times don't increase.
    """
    try:
        table = np.loadtxt(path, ndmin=2, comments="#")
    except (ValueError, UnicodeDecodeError) as error:
        raise ValueError(f"{path} is not a table of numbers: {str(error).rstrip('.')}.") from None
    if len(table) < 2 or table.shape[1] != len(COLUMNS):
        raise ValueError(
            f"{path} has {len(table)} rows of {table.shape[-1]} columns; at least 2 rows of "
            f"{len(COLUMNS)} are expected: {', '.join(COLUMNS)}."
        )
    check_finite(path, table, "row")
    gps_time, north, east, down = table[:, :4].T
    check_increasing(path, gps_time, "row")
    return PosErrorSeries(
        gps_time, np.column_stack([east, north, -down]), np.radians(table[:, -3:])
    )
