"""Points and lines as Open3D tensor geometries, about an origin stored with them.

Open3D draws in float32, which resolves only half a meter at map coordinates. Positions therefore
refer to a nearby origin, in float64, which each point has as its attribute ``origin``. The
attribute takes no memory until Open3D makes a new geometry, and Open3D keeps it when points are
selected, cropped or appended.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

OWN = ("positions", "gps_time", "intensity", "origin")  # reserved names of attributes
GREY = (2.0, 98.0)  # percentiles of black and white, so that single points do not darken the rest


def is_geometry(value: object) -> bool:
    """Return True for an Open3D geometry, without loading Open3D."""
    return type(value).__module__.startswith("open3d") or any(
        kind.__module__.startswith("open3d") for kind in type(value).__mro__
    )


def cloud_geometry(
    xyz: np.ndarray,
    gps_time: np.ndarray,
    intensity: np.ndarray,
    further: Mapping[str, np.ndarray],
    origin: np.ndarray | None,
) -> Any:
    """Make a tensor point cloud that shares the memory of its attributes.

    Parameters
    ----------
    xyz : (n, 3) array
        Units: m.
    gps_time, intensity : (n,) array
    further : mapping
        Arrays (n,) or (n, k).
    origin : (3,) array or None
        By default a whole meter near the middle of the points. Units: m.

    Raises
    ------
    ValueError
        If an attribute has a reserved name or an unsupported type.
    """
    _check_attributes(further)
    attributes = {"gps_time": gps_time, "intensity": intensity, **further}
    geometry = _open3d().t.geometry.PointCloud()
    origin = chosen_origin(xyz, origin)
    geometry.point["positions"] = _tensor(xyz - origin)
    for name, values in attributes.items():
        geometry.point[name] = _tensor(_columns(values))
    geometry.point["origin"] = _repeated(origin, len(xyz))
    return geometry


def line_geometry(
    points: np.ndarray,
    pairs: np.ndarray,
    origin: np.ndarray | None,
    attributes: Mapping[str, np.ndarray],
) -> Any:
    """Make a tensor line set.

    Parameters
    ----------
    points : (n, 3) array
        Units: m.
    pairs : (k, 2) int array
        Indices of the points that a line joins.
    origin : (3,) array or None
        See cloud_geometry.
    attributes : mapping
        Arrays (k, ...) of the lines; ``colors`` (k, 3) from 0 to 1.
    """
    geometry = _open3d().t.geometry.LineSet()
    origin = chosen_origin(points, origin)
    geometry.point["positions"] = _tensor(points - origin)
    geometry.point["origin"] = _repeated(origin, len(points))
    geometry.line["indices"] = _tensor(np.asarray(pairs, np.int32).reshape(-1, 2))
    for name, values in attributes.items():
        geometry.line[name] = _tensor(_columns(values))
    return geometry


def chosen_origin(xyz: np.ndarray, origin: np.ndarray | None) -> np.ndarray:
    """Return the given origin (3,), or a whole meter near the middle of the points. Units: m.

    Raises
    ------
    ValueError
        If the origin is not three finite numbers.
    """
    if origin is None:
        if len(xyz) == 0:
            return np.zeros(3)
        return np.floor((np.min(xyz, axis=0) + np.max(xyz, axis=0)) / 2)
    place = np.asarray(origin, float)
    if place.shape != (3,) or not np.isfinite(place).all():
        raise ValueError(
            f"origin = {origin!r} is invalid: give three finite numbers, E, N, H in m."
        )
    return place


def geometry_columns(geometry: Any, origin: np.ndarray | None) -> tuple[np.ndarray, dict]:
    """Return positions (n, 3) in the map, and the attributes of a tensor point cloud.

    Parameters
    ----------
    geometry : open3d.t.geometry.PointCloud
    origin : (3,) array or None
        Used if the geometry has none. Units: m.

    Returns
    -------
    xyz : (n, 3) array
        Units: m.
    attributes : dict
        Arrays (n,) or (n, k) that share the geometry's memory.

    Raises
    ------
    ValueError
        If the geometry is not a point cloud, or has no points.
    """
    point = getattr(geometry, "point", None)
    if point is None or not hasattr(geometry, "voxel_down_sample"):
        raise ValueError(
            f"Expected an open3d.t.geometry.PointCloud, not {type(geometry).__name__}: a legacy "
            "cloud has no gps_time. Give a tensor cloud with the point attribute gps_time."
        )
    others = [name for name in point if name not in ("positions", "origin")]
    return map_places(geometry, origin), {name: _array(point[name]) for name in others}


def map_places(geometry: Any, origin: np.ndarray | None = None) -> np.ndarray:
    """Map coordinates (n, 3) of the points of a tensor cloud or line set. Units: m.

    Parameters
    ----------
    geometry : open3d.t.geometry.PointCloud or LineSet
    origin : (3,) array or None
        Reference of its positions; by default its attribute ``origin``, or zero without one.

    Raises
    ------
    ValueError
        If the geometry has no points.
    """
    if "positions" not in geometry.point:
        raise ValueError(
            f"The {type(geometry).__name__} of Open3D is empty: it has no positions. Set "
            "geometry.point.positions first."
        )
    positions = geometry.point["positions"].cpu().numpy()
    if origin is not None:
        return positions + chosen_origin(positions, origin)
    if "origin" not in geometry.point or len(positions) == 0:
        return positions.astype(float)
    places = geometry.point["origin"].cpu().numpy()
    if np.ptp(places, axis=0).any():  # clouds with several origins were merged
        return positions + places.astype(float)
    return positions + places[0].astype(float)


def moved_geometry(geometry: Any, xyz: np.ndarray) -> Any:
    """Return a tensor cloud with new positions and the other attributes of the given one, shared.

    Parameters
    ----------
    geometry : open3d.t.geometry.PointCloud
    xyz : (n, 3) array
        Relative to its origin. Units: m.
    """
    moved = _open3d().t.geometry.PointCloud()
    place = np.zeros(3)
    if "origin" in geometry.point:
        place = geometry.point["origin"].cpu().numpy()
    moved.point["positions"] = _tensor(xyz - place)
    for name in geometry.point:
        if name != "positions":
            moved.point[name] = geometry.point[name]
    return moved


def grey_colors(values: np.ndarray) -> np.ndarray:
    """Gray values (n, 3) uint8, from dark to bright.

    Parameters
    ----------
    values : (n,) array
    """
    if len(values) == 0:
        return np.empty((0, 3), np.uint8)
    low, high = np.percentile(values, GREY)
    if high > low:
        share = np.clip((values - low) / (high - low), 0.0, 1.0)
    else:
        share = np.full(len(values), 0.5)
    grey = np.rint(255 * share).astype(np.uint8)
    return np.repeat(grey[:, None], 3, axis=1)


def _check_attributes(further):
    """Refuse attributes with reserved names, or with types that Open3D does not support."""
    taken = sorted(set(further) & set(OWN))
    if taken:
        raise ValueError(
            f"The attributes {', '.join(taken)} of the cloud have names that its Open3D geometry "
            "uses itself. Rename them."
        )
    for name, values in further.items():
        dtype = np.asarray(values).dtype
        if dtype.kind not in "biuf" or dtype.itemsize > 8 or dtype == np.float16:
            raise ValueError(
                f"The attribute {name} has the type {dtype}, but Open3D supports only bool, "
                "integers, float32 and float64. Convert or remove it."
            )


def _open3d():
    import open3d

    return open3d


def _tensor(values):
    """Wrap an array in a tensor that shares its memory."""
    native = np.asarray(values, values.dtype.newbyteorder("="))
    return _open3d().core.Tensor.from_numpy(np.ascontiguousarray(native))


def _repeated(origin, n):
    """Repeat the origin as (n, 3) rows that share one row of memory."""
    rows = np.lib.stride_tricks.as_strided(np.array(origin, float), (n, 3), (0, 8))
    return _open3d().core.Tensor.from_numpy(rows)


def _columns(values):
    """Return values (n,) as a column, as Open3D requires."""
    values = np.asarray(values)
    if values.ndim == 1:
        return values[:, None]
    return values


def _array(tensor):
    """View a tensor's memory as an array, (n,) for one column."""
    values = tensor.cpu().numpy()
    if values.ndim == 2 and values.shape[1] == 1:
        return values[:, 0]
    return values
