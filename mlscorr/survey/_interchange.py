"""Conversion of users' points to a PointCloud and back: Open3D tensor clouds and arrays."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mlscorr.survey import _open3d
from mlscorr.survey.clouds import PointCloud


def as_cloud(points: Any) -> tuple[PointCloud, Callable[[PointCloud], Any]]:
    """Return points as a PointCloud, and a function that converts a moved one back to their form.

    Parameters
    ----------
    points : PointCloud, open3d.t.geometry.PointCloud, or a pair (xyz, gps_time) of arrays

    Returns
    -------
    cloud : PointCloud
    back : function of a PointCloud
        It must have the same points; only its positions are used.

    Raises
    ------
    TypeError
        If the points have another form.
    ValueError
        See ``PointCloud.from_arrays`` and ``from_open3d``.
    """
    if isinstance(points, PointCloud):
        return points, lambda moved: moved
    if _open3d.is_geometry(points):
        cloud = PointCloud.from_open3d(points)
        return cloud, lambda moved: _open3d.moved_geometry(points, moved.xyz)
    if isinstance(points, tuple | list) and len(points) == 2:
        cloud = PointCloud.from_arrays(*points)
        return cloud, lambda moved: (moved.xyz, moved.gps_time)
    raise TypeError(
        f"A correction moves a PointCloud, an open3d.t.geometry.PointCloud with gps_time, a pair "
        f"(xyz, gps_time) of arrays or points of laspy, not {type(points).__name__}."
    )


def geometry_pair(
    before: PointCloud, after: PointCloud, origin: ArrayLike | None
) -> dict[str, Any]:
    """Return two states of the same points as tensor clouds that share all but their positions.

    Parameters
    ----------
    before, after : PointCloud
        Points without ``colors`` become gray by intensity.
    origin : (3,) array or None
        Of both; see ``PointCloud.to_open3d``. Units: m.

    Returns
    -------
    dict
        ``before`` and ``after``.
    """
    geometry = before.to_open3d(origin)
    if "colors" not in before.attributes:
        geometry.point["colors"] = _open3d.grey_colors(before.intensity)
    return {"before": geometry, "after": _open3d.moved_geometry(geometry, after.xyz)}


def is_las(points: Any) -> bool:
    """Return True for a laspy point record or a file read by laspy.

    Parameters
    ----------
    points : object
    """
    return type(points).__module__.startswith("laspy")


def copied_las(points: Any) -> tuple[Any, Any]:
    """Copy laspy points, and return the copy and the point record in it.

    Parameters
    ----------
    points : laspy.LasData or ScaleAwarePointRecord

    Raises
    ------
    ValueError
        If the point format has no times.
    """
    given = getattr(points, "points", points)
    point_format = given.point_format
    if "gps_time" not in point_format.dimension_names:
        raise ValueError(
            f"Points of format {point_format.id} have no gps_time, which locates them on the "
            "trajectory. Export the cloud as format 1, 3 or 6 to 8."
        )
    record = type(given)(given.array.copy(), point_format, given.scales, given.offsets)
    if given is points:
        return record, record
    return type(points)(deepcopy(points.header), record), record


def box_distance(xyz: np.ndarray, place: np.ndarray) -> float:
    """Distance between the bounding boxes of two sets of points (n, 3) and (m, 3). Units: m.

    Parameters
    ----------
    xyz, place : (n, 3), (m, 3) array
        Units: m.
    """
    if len(xyz) == 0:
        return 0.0
    below = place.min(axis=0) - xyz.max(axis=0)
    above = xyz.min(axis=0) - place.max(axis=0)
    return float(np.linalg.norm(np.maximum(0.0, np.maximum(below, above))))
