"""Pieces of surface as triangles: quads, boxes, posts; and rays that meet them."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from mlscorr.survey import Columns

UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, repr=False)
class Mesh(Columns):
    """Triangles (n, 3, 3) in m relative to a local origin, with the reflectance (n,) of each."""

    triangles: np.ndarray
    reflectance: np.ndarray

    @cached_property
    def caster(self) -> Any:
        """Open3D's ray caster of the triangles."""
        return ray_caster(self.triangles)

    @cached_property
    def normal(self) -> np.ndarray:
        """Unit normal (n, 3) of each triangle; zero for one without area, which nothing hits."""
        a, b, c = np.moveaxis(self.triangles, 1, 0)
        normal = np.cross(b - a, c - a)
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        return normal / np.where(length > 0, length, 1.0)

    @cached_property
    def offset(self) -> np.ndarray:
        """Distance (n,) of each triangle's plane from the origin, along its normal. Units: m."""
        return np.einsum("ij,ij->i", self.normal, self.triangles[:, 0])


def four_corners(
    a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray, reflectance: float
) -> Mesh:
    """Make a mesh of quads with corners a, b, c, d (..., 3) in sequence, as two triangles each.

    Parameters
    ----------
    a, b, c, d : (..., 3) array
        Units: m.
    reflectance : float
    """
    a, b, c, d = np.broadcast_arrays(a, b, c, d)
    triangles = np.stack([np.stack([a, b, c], axis=-2), np.stack([a, c, d], axis=-2)], axis=-3)
    triangles = triangles.reshape(-1, 3, 3).astype(float)
    return Mesh(triangles, np.full(len(triangles), float(reflectance)))


def quads(corner: np.ndarray, u: np.ndarray, v: np.ndarray, reflectance: float) -> Mesh:
    """Make a mesh of parallelograms from a corner along two edges, each (..., 3) in m.

    Parameters
    ----------
    corner : (..., 3) array
        Units: m.
    u, v : (..., 3) array
        Edge. Units: m.
    reflectance : float

    Examples
    --------
    >>> len(quads(np.zeros((5, 3)), [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], 0.5))
    10
    """
    corner = np.asarray(corner)
    u = np.asarray(u)
    v = np.asarray(v)
    return four_corners(corner, corner + u, corner + u + v, corner + v, reflectance)


def box(
    corner: np.ndarray, u: np.ndarray, v: np.ndarray, w: np.ndarray, reflectance: float
) -> Mesh:
    """Make a mesh of the six faces of a box from a corner along three edges (3,) in m.

    Parameters
    ----------
    corner : (3,) array
        Units: m.
    u, v, w : (3,) array
        Edge. Units: m.
    reflectance : float
    """
    sides = [(u, v), (v, w), (w, u)]
    near = [quads(corner, p, q, reflectance) for p, q in sides]
    far = [quads(corner + o, p, q, reflectance) for (p, q), o in zip(sides, (w, u, v), strict=True)]
    return Mesh.concatenate(near + far)


def post(foot: np.ndarray, height: float, width: float, reflectance: float) -> Mesh:
    """Make a mesh of an upright square post, its foot (3,) in the middle of its base. Units: m.

    Parameters
    ----------
    foot : (3,) array
        Units: m.
    height : float
        Units: m.
    width : float
        Of its square. Units: m.
    reflectance : float
    """
    u = np.array([width, 0.0, 0.0])
    v = np.array([0.0, width, 0.0])
    return box(foot - (u + v) / 2, u, v, height * UP, reflectance)


def unit(vector: np.ndarray) -> np.ndarray:
    """Return the unit vector (3,) in the same direction."""
    return vector / np.linalg.norm(vector)


def ray_caster(triangles: np.ndarray) -> Any:
    """Make Open3D's ray caster of triangles (n, 3, 3) about a local origin, in their order.

    Parameters
    ----------
    triangles : (n, 3, 3) array
        Units: m.
    """
    import open3d as o3d

    corners: Any = triangles.reshape(-1, 3).astype(np.float32)
    caster = o3d.t.geometry.RaycastingScene()
    numbers: Any = np.arange(len(corners), dtype=np.uint32).reshape(-1, 3)
    caster.add_triangles(corners, numbers)
    return caster


def sees(caster: Any, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Flag (n,) of pairs of points (n, 3) without a triangle between them, to 5 cm.

    Parameters
    ----------
    caster : RaycastingScene
    start, end : (n, 3) array
        Units: m.
    """
    rays = np.hstack([start, end - start]).astype(np.float32)
    free = caster.cast_rays(rays)["t_hit"].numpy()
    return free > 1.0 - 0.05 / np.linalg.norm(end - start, axis=1)
