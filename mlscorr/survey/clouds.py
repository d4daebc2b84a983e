"""Points as they pass in chunks, and the files that hold them."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mlscorr.survey.columns import Columns


@dataclass(frozen=True, repr=False)
class PointCloud(Columns):
    """One chunk of points.

    Parameters
    ----------
    xyz : (n, 3) array
        Units: m.
    gps_time : (n,) array
        In the trajectory's time system. Units: s.
    intensity : (n,) array
    """

    xyz: np.ndarray
    gps_time: np.ndarray
    intensity: np.ndarray


@dataclass(frozen=True)
class CloudFile:
    """A LAS or LAZ file.

    Parameters
    ----------
    path : Path
    points : int
    time_constant : float
        Added to the file's gps_time, it gives the trajectory's. Units: s.
    time_system : str
    """

    path: Path
    points: int
    time_constant: float
    time_system: str
