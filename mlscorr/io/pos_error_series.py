"""Error series of a real POS against a better one, as OB_GINS writes them (.err)."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

COLUMNS = 10  # time; N, E, D error; N, E, D velocity error; roll, pitch, yaw error


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


def read_pos_error_series(path):
    """PosErrorSeries of an .err file: time (s), N, E, D (m), velocities, roll, pitch, yaw (deg).

    Raises ValueError for a file that is not such a table of numbers, or whose times don't
    increase.
    """
    path = Path(path)
    try:
        table = np.loadtxt(path, ndmin=2, comments="#")
    except (ValueError, UnicodeDecodeError) as error:
        raise ValueError(f"{path} is not a table of numbers: {error}.") from None
    if len(table) < 2 or table.shape[1] != COLUMNS:
        raise ValueError(
            f"{path} has {len(table)} rows of {table.shape[-1]} columns; at least 2 rows of "
            f"{COLUMNS} are expected: time, N, E, D, three velocities, roll, pitch, yaw."
        )
    bad = ~np.isfinite(table).all(axis=1)
    if bad.any():
        raise ValueError(
            f"{bad.sum()} of {len(table)} rows of {path} hold values that are not numbers "
            f"(first: row {np.argmax(bad) + 1})."
        )
    gps_time, north, east, down = table[:, :4].T
    if (np.diff(gps_time) <= 0).any():
        row = int(np.argmax(np.diff(gps_time) <= 0)) + 2
        raise ValueError(f"The times of {path} don't increase (first in row {row}).")
    return PosErrorSeries(
        gps_time, np.column_stack([east, north, -down]), np.radians(table[:, 7:10])
    )
