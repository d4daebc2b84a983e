"""Points as they pass in chunks, and the files that hold them."""

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from mlscorr.survey.columns import Columns

WEEK = 604_800.0  # s
COORDINATE_ROUNDING = 0.0003  # m; one sigma of a coordinate at the usual LAS scale of 1 mm
NOISE_CLASSES = (7, 18)  # low point (noise) and high noise: ASPRS LAS 1.4 R15, point classes


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


class Correcting(Protocol):
    """Anything that moves points is a correction, a baseline too."""

    def apply(self, cloud: PointCloud) -> PointCloud:
        """The PointCloud, corrected."""


@dataclass(frozen=True)
class CloudFile:
    """A LAS or LAZ file, or the points in it that one of several scanners measured.

    Parameters
    ----------
    path : Path
    points : int
        Of the file, or of these.
    time_constant : float
        Added to the file's gps_time, it gives the trajectory's. Units: s.
    time_system : str
    point_source_ids : tuple of int, optional
        Of the points; without it all of the file.
    new_week : float
        Times of the file below it are of the week after that of the others, as its seconds of
        week start again. Units: s.
    noise_classes : tuple of int
        Classes whose points take no part in a measurement, as withheld points take none.
    """

    path: Path
    points: int
    time_constant: float
    time_system: str
    point_source_ids: tuple[int, ...] | None = None
    new_week: float = -np.inf
    noise_classes: tuple[int, ...] = NOISE_CLASSES

    @property
    def name(self) -> str:
        """Of the file, with the ids of the points."""
        if self.point_source_ids is None:
            return self.path.name
        return f"{self.path.name} (point_source_id {', '.join(map(str, self.point_source_ids))})"

    def rows(self, point_source_id: np.ndarray) -> np.ndarray | slice:
        """Which points are among these: (n,) bool, or a slice of all.

        Parameters
        ----------
        point_source_id : (n,) int array
            Of points of the file.
        """
        if self.point_source_ids is None:
            return slice(None)
        return np.isin(point_source_id, self.point_source_ids)

    def counted(self, gps_time: np.ndarray) -> np.ndarray:
        """Times (n,) of the file that count on where its seconds of week start again. Units: s.

        Parameters
        ----------
        gps_time : (n,) array
            As the file has them. Units: s.
        """
        return counted_on(gps_time, self.new_week)

    def trajectory_time(self, gps_time: np.ndarray) -> np.ndarray:
        """Times (n,) in the trajectory's time system. Units: s.

        Parameters
        ----------
        gps_time : (n,) array
            As the file has them. Units: s.
        """
        return self.counted(gps_time) + self.time_constant


def counted_on(gps_time: np.ndarray, new_week: float) -> np.ndarray:
    """Times (n,) to which a week is added where they lie below a limit. Units: s.

    Parameters
    ----------
    gps_time : (n,) array
        Units: s.
    new_week : float
        Infinite below zero where no week ends. Units: s.
    """
    if new_week == -np.inf:
        return gps_time
    return gps_time + WEEK * (gps_time < new_week)
