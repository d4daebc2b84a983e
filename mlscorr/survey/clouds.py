"""Point clouds in chunks, and the files or arrays they come from."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from mlscorr.survey import _open3d
from mlscorr.survey.columns import Columns
from mlscorr.wording import counted

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WEEK = 604_800.0  # s
COORDINATE_ROUNDING = 0.0003  # m; one sigma of a coordinate at the usual LAS scale of 1 mm
NOISE_CLASSES = (7, 18)  # low point (noise) and high noise: ASPRS LAS 1.4 R15, point classes


@dataclass(frozen=True, repr=False)
class PointCloud(Columns):
    """One chunk of a point cloud.

    Parameters
    ----------
    xyz : (n, 3) array
        Units: m.
    gps_time : (n,) array
        In the trajectory's time system. Units: s.
    intensity : (n,) array
    attributes : mapping
        Further arrays (n,) or (n, k) by name, such as ``classification``; they stay with the
        points.
    """

    xyz: np.ndarray
    gps_time: np.ndarray
    intensity: np.ndarray
    attributes: Mapping[str, np.ndarray] = field(default_factory=dict)

    @classmethod
    def from_arrays(
        cls,
        xyz: ArrayLike,
        gps_time: ArrayLike,
        intensity: ArrayLike | None = None,
        attributes: Mapping[str, ArrayLike] | None = None,
    ) -> PointCloud:
        """Make a cloud from arrays, which are checked and, where their types allow, not copied.

        Parameters
        ----------
        xyz : (n, 3) array
            float64. Units: m.
        gps_time : (n,) array
            In the trajectory's time system. Units: s.
        intensity : (n,) array, optional
            Zero by default; targets are then found by their edges only.
        attributes : mapping, optional
            Further arrays (n,) or (n, k) by name.

        Returns
        -------
        PointCloud
            Warns if float32 rounded the coordinates by more than a LAS file does.

        Raises
        ------
        ValueError
            If shapes or lengths do not match, or values are not finite.

        >>> import numpy as np
        >>> from mlscorr.survey import PointCloud
        >>> PointCloud.from_arrays(np.array([[532_000.0, 3_374_000.0, 42.0]]), [357_700.0])
        PointCloud(1 rows)
        """
        given = np.asarray(xyz)
        times = np.asarray(gps_time, float)
        if given.ndim != 2 or given.shape[1] != 3:
            raise ValueError(f"xyz has the shape {given.shape}: give (n, 3), E, N, H in m.")
        if intensity is None:
            intensity = np.zeros(len(given), np.uint16)
        further = {name: np.asarray(values) for name, values in (attributes or {}).items()}
        cloud = cls(given.astype(float, copy=False), times, np.asarray(intensity), further)
        _require_numbers("coordinates", np.isfinite(cloud.xyz).all(axis=1))
        _require_numbers("a gps_time", np.isfinite(times))
        _warn_of_rounding(given)
        return cloud

    def to_open3d(self, origin: ArrayLike | None = None) -> Any:
        """Convert the cloud to an Open3D tensor geometry, about an origin stored with it.

        ``gps_time``, ``intensity`` and further attributes share the memory of this cloud.

        Parameters
        ----------
        origin : (3,) array, optional
            Reference of ``positions``, float64; by default a whole meter near the middle. The
            geometry stores it as the attribute ``origin``. Units: m.

        Returns
        -------
        open3d.t.geometry.PointCloud

        Raises
        ------
        ValueError
            If the origin is not finite, or an attribute has a reserved name or an unsupported type.

        >>> import numpy as np
        >>> from mlscorr.survey import PointCloud
        >>> cloud = PointCloud.from_arrays([[532_000.5, 3_374_000.0, 42.0]], [357_700.0])
        >>> geometry = cloud.to_open3d(origin=[532_000.0, 3_374_000.0, 0.0])
        >>> geometry.point.positions.numpy().tolist()
        [[0.5, 0.0, 42.0]]
        >>> PointCloud.from_open3d(geometry).xyz.tolist()
        [[532000.5, 3374000.0, 42.0]]
        """
        place = None if origin is None else np.asarray(origin, float)
        return _open3d.cloud_geometry(
            self.xyz, self.gps_time, self.intensity, self.attributes, place
        )

    @classmethod
    def from_open3d(cls, cloud: Any, origin: ArrayLike | None = None) -> PointCloud:
        """Make a cloud from an Open3D tensor geometry.

        Parameters
        ----------
        cloud : open3d.t.geometry.PointCloud
            With the point attribute ``gps_time`` (s); ``intensity`` and others are kept.
        origin : (3,) array, optional
            Reference of its positions; by default its attribute ``origin``. Without either,
            positions are map coordinates. Units: m.

        Returns
        -------
        PointCloud
            Warns if float32 rounded the coordinates.

        Raises
        ------
        ValueError
            If gps_time or positions are missing, or values are not finite.
        """
        place = None if origin is None else np.asarray(origin, float)
        xyz, columns = _open3d.geometry_columns(cloud, place)
        if "gps_time" not in columns:
            known = ", ".join(columns) or "none"
            raise ValueError(
                f"The Open3D cloud of {counted(len(xyz), 'point')} has no point attribute "
                f"gps_time (it has: {known}), which locates points on the trajectory. Set "
                "cloud.point.gps_time to a float64 tensor (n, 1), in s."
            )
        _warn_of_rounding(cloud.point["positions"].numpy())
        times = columns.pop("gps_time")
        return cls.from_arrays(xyz, times, columns.pop("intensity", None), columns)

    def plot(self) -> Figure:
        """Plot the cloud from above, colored by intensity; large clouds are thinned."""
        from mlscorr.survey._figure import cloud_figure

        return cloud_figure(self.xyz, self.intensity)


class Correcting(Protocol):
    """Protocol of everything that corrects points: a correction or a baseline."""

    def apply(self, cloud: PointCloud) -> PointCloud:
        """Return the corrected PointCloud."""


def _require_numbers(what, is_number):
    """Refuse points with values that are not numbers."""
    bad = np.flatnonzero(~is_number)
    if len(bad):
        raise ValueError(
            f"{len(bad)} of {counted(len(is_number), 'point')} have {what} that are not finite "
            f"(first: point {bad[0]}). Remove them."
        )


def _warn_of_rounding(xyz):
    """Warn if float32 coordinates are rounded by more than those of a LAS file."""
    if xyz.dtype != np.float32 or len(xyz) == 0:
        return
    largest = np.abs(xyz).max()
    step = float(np.spacing(largest))
    if step > COORDINATE_ROUNDING:
        warnings.warn(
            f"Coordinates are float32: at {largest:.0f} m they are rounded to steps of "
            f"{step:.3g} m, with errors of up to {step / 2:.3g} m. Give float64, or subtract an "
            "origin before conversion to float32.",
            stacklevel=4,
        )


@dataclass(frozen=True)
class CloudFile:
    """LAS or LAZ file, or the part of one that a single scanner measured.

    Parameters
    ----------
    path : Path
    points : int
        Number of points in the file, or in this part.
    time_constant : float
        Added to the file's gps_time to get the trajectory's time. Units: s.
    time_system : str
    point_source_ids : tuple of int, optional
        IDs of the points in this part; all points by default.
    new_week : float
        Times of the file below it belong to the following week, because seconds of week restart.
        Units: s.
    noise_classes : tuple of int
        Classes whose points are not used in measurements; withheld points are not used either.
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
        """Name of the file, with the IDs of the points."""
        if self.point_source_ids is None:
            return self.path.name
        return f"{self.path.name} (point_source_id {', '.join(map(str, self.point_source_ids))})"

    def rows(self, point_source_id: np.ndarray) -> np.ndarray | slice:
        """Select the points of this part: (n,) bool, or a slice of all.

        Parameters
        ----------
        point_source_id : (n,) int array
            Of points of the file.
        """
        if self.point_source_ids is None:
            return slice(None)
        return np.isin(point_source_id, self.point_source_ids)

    def counted(self, gps_time: np.ndarray) -> np.ndarray:
        """Return file times (n,) that keep increasing where seconds of week restart. Units: s.

        Parameters
        ----------
        gps_time : (n,) array
            As in the file. Units: s.
        """
        return counted_on(gps_time, self.new_week)

    def trajectory_time(self, gps_time: np.ndarray) -> np.ndarray:
        """Times (n,) in the trajectory's time system. Units: s.

        Parameters
        ----------
        gps_time : (n,) array
            As in the file. Units: s.
        """
        return self.counted(gps_time) + self.time_constant


@dataclass(frozen=True)
class CloudInMemory(CloudFile):
    """Points in memory that act as a file; ``path`` is the name of the file to write.

    Parameters
    ----------
    cloud : PointCloud
        Two clouds with the same name are treated as the same.
    crs : str, optional
    """

    cloud: PointCloud | None = field(default=None, compare=False, repr=False)
    crs: str | None = None

    def chunks(self, size: int, first: int = 0, end: int | None = None) -> Iterator[PointCloud]:
        """Yield the points in order, without copying.

        Parameters
        ----------
        size : int
            Points in a chunk.
        first, end : int
            Index of the first point, and of the point after the last.
        """
        assert self.cloud is not None
        end = self.points if end is None else min(end, self.points)
        for start in range(first, end, size):
            yield self.cloud[start : min(start + size, end)]


def counted_on(gps_time: np.ndarray, new_week: float) -> np.ndarray:
    """Return times (n,), with a week added to those below a limit. Units: s.

    Parameters
    ----------
    gps_time : (n,) array
        Units: s.
    new_week : float
        Minus infinity if no week ends. Units: s.
    """
    if new_week == -np.inf:
        return gps_time
    return gps_time + WEEK * (gps_time < new_week)
