"""Planes through the points of cells, refined by removing outliers."""

from dataclasses import dataclass

import numpy as np

from mlscorr.surfaces.cells import (
    CellTable,
    add_near_planes,
    covariances,
    neighbour_covariances,
)
from mlscorr.surfaces.places import cell_corner
from mlscorr.surfaces.settings import SETTINGS
from mlscorr.survey import Columns, PointCloud


@dataclass(frozen=True, eq=False, repr=False)
class FittedPlanes(Columns):
    """Least squares planes through groups of points.

    Parameters
    ----------
    points : (g,) int array
    since : (g,) array
        Mean time since the start of the group. Units: s.
    mean : (g, 3) array
        Mean of the points, relative to the reference of their sums. Units: m.
    normal : (g, 3) array
        Unit vector, with either sign.
    variance : (g,) array
        Variance about the plane, accounting for its three parameters. Units: m^2.
    spread : (g,) array
        One sigma of the points along the plane's narrow direction. Units: m.
    between : (g,) array
        Variance along the normal from consecutive points: the noise only. Units: m^2.
    """

    points: np.ndarray
    since: np.ndarray
    mean: np.ndarray
    normal: np.ndarray
    variance: np.ndarray
    spread: np.ndarray
    between: np.ndarray

    @classmethod
    def of(cls, moments: np.ndarray) -> "FittedPlanes":
        """Make the planes of moments.

        Parameters
        ----------
        moments : (g, 22) array
            From Cells or add_near_planes; zeros without points.
        """
        points = moments[:, 0].astype(int)
        count = np.maximum(points, 1)
        values, axes = np.linalg.eigh(covariances(moments))
        values = np.maximum(values, 0.0)  # negative by rounding for points in a line
        normal = np.ascontiguousarray(axes[:, :, 0])
        noise = neighbour_covariances(moments)
        return cls(
            points=points,
            since=moments[:, 1] / count,
            mean=moments[:, 2:5] / count[:, None],
            normal=normal,
            variance=values[:, 0] * points / degrees_of_freedom(points),
            spread=np.sqrt(values[:, 1]),
            between=np.einsum("gi,gij,gj->g", normal, noise, normal),
        )


def degrees_of_freedom(points: np.ndarray) -> np.ndarray:
    """Degrees of freedom for (n,) points about a plane, which has three parameters."""
    return np.maximum(points - 3, 1)


@dataclass(frozen=True, eq=False, repr=False)
class PlaneSearch:
    """Planes of cells, and the points of each of them.

    Parameters
    ----------
    planes : FittedPlanes
        For g cells, each relative to the middle of its cell.
    middle : (g, 3) array
        Middle of the cells. Units: m.
    begin : (g,) array
        Start of their moments. Units: s.
    rows : (n,) int array
        Points of the cells, cell after cell, within a cell in the order of the cloud.
    ends : (g + 1,) int array
        Start of each cell among the rows, and end of the last one.
    is_on : (n,) bool array
        True for points on the plane.
    """

    planes: FittedPlanes
    middle: np.ndarray
    begin: np.ndarray
    rows: np.ndarray
    ends: np.ndarray
    is_on: np.ndarray


def search_planes(cloud: PointCloud, place: np.ndarray) -> PlaneSearch:
    """Fit a plane to most points of each cell of space and time with enough points.

    Least squares are repeated with the points within an increasing number of sigmas of the previous
    plane.

    Parameters
    ----------
    cloud : PointCloud
    place : (3,) array
        Reference near the cloud, the same for all parts of it. Units: m.
    """
    table = CellTable(cell_corner(place))
    cell = table.add(cloud)
    cells = table.of()
    is_full = cells.points >= SETTINGS.feature_points
    cells = cells[is_full]
    number = np.cumsum(is_full) - 1
    rows = np.flatnonzero(is_full[cell])
    group = number[cell[rows]]
    order = np.argsort(group, kind="stable")
    rows = rows[order]
    group = group[order]
    ends = np.append(0, np.cumsum(cells.points.astype(np.int64)))
    local = cloud.xyz[rows] - cells.middle[group]
    since = cloud.gps_time[rows] - cells.begin[group]
    planes, is_on = trimmed_planes(local, since, ends, FittedPlanes.of(cells.moments))
    return PlaneSearch(planes, cells.middle, cells.begin, rows, ends, is_on)


def trimmed_planes(
    local: np.ndarray, since: np.ndarray, ends: np.ndarray, planes: FittedPlanes
) -> tuple[FittedPlanes, np.ndarray]:
    """Planes of groups of points, and the flag of points (n,) on them.

    Parameters
    ----------
    local, since, ends
        See add_near_planes.
    planes : FittedPlanes
        Planes through all points.
    """
    for trim in SETTINGS.trims:
        limit = trim * np.maximum(np.sqrt(planes.variance), SETTINGS.rounding)
        moments, is_on = add_near_planes(local, since, ends, planes.mean, planes.normal, limit)
        planes = FittedPlanes.of(moments)
    return planes, is_on


def fit_planes(local: np.ndarray, ends: np.ndarray) -> FittedPlanes:
    """Planes through all points of some groups.

    Parameters
    ----------
    local : (n, 3) array
        Points, group after group, relative to a nearby position. Units: m.
    ends : (g + 1,) int array
        Start of each group, and end of the last one.
    """
    groups = len(ends) - 1
    zeros = np.zeros((groups, 3))
    everywhere = np.full(groups, np.inf)
    since = np.zeros(len(local))
    return FittedPlanes.of(add_near_planes(local, since, ends, zeros, zeros, everywhere)[0])
