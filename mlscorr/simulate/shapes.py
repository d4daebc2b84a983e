"""Pieces of surface as triangles: quads, boxes, posts, targets."""

from dataclasses import dataclass

import numpy as np

BOARD = 1.5  # edge of a circle's dark board, in disc diameters
BRIGHT, DARK = 0.9, 0.06  # reflectance: white and black target paint
SEGMENTS = 64  # of a disc; its edge departs 0.4 mm from a circle of 0.6 m
UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Mesh:
    """Triangles (n, 3, 3) in m about a local origin, with the reflectance (n,) of each."""

    triangles: np.ndarray
    reflectance: np.ndarray

    def __len__(self):
        return len(self.triangles)


def join(meshes):
    """One mesh of several."""
    return Mesh(
        np.concatenate([m.triangles for m in meshes]),
        np.concatenate([m.reflectance for m in meshes]),
    )


def four_corners(a, b, c, d, reflectance):
    """Mesh of quads with corners a, b, c, d (..., 3) in turn, as two triangles each."""
    a, b, c, d = np.broadcast_arrays(a, b, c, d)
    triangles = np.stack([np.stack([a, b, c], axis=-2), np.stack([a, c, d], axis=-2)], axis=-3)
    triangles = triangles.reshape(-1, 3, 3).astype(float)
    return Mesh(triangles, np.full(len(triangles), float(reflectance)))


def quads(corner, u, v, reflectance):
    """Mesh of parallelograms from a corner along two edges, each (..., 3) in m.

    >>> len(quads(np.zeros((5, 3)), [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], 0.5))
    10
    """
    corner, u, v = np.asarray(corner), np.asarray(u), np.asarray(v)
    return four_corners(corner, corner + u, corner + u + v, corner + v, reflectance)


def box(corner, u, v, w, reflectance):
    """Mesh of the six faces of a box from a corner along three edges (3,) in m."""
    sides = [(u, v), (v, w), (w, u)]
    near = [quads(corner, p, q, reflectance) for p, q in sides]
    far = [quads(corner + o, p, q, reflectance) for (p, q), o in zip(sides, (w, u, v), strict=True)]
    return join(near + far)


def post(foot, height, width, reflectance):
    """Mesh of an upright square post, its foot (3,) in the middle of its base. Units: m."""
    u, v = np.array([width, 0.0, 0.0]), np.array([0.0, width, 0.0])
    return box(foot - (u + v) / 2, u, v, height * UP, reflectance)


def target(kind, centre, u, v, size):
    """Mesh of a target about its centre (3,), in the plane of the unit vectors u, v (3,).

    A circle is a bright disc of diameter `size` within a darker square board of the same plane;
    a square is a bright plate of edge `size`. Units: m.
    """
    if kind == "square":
        return quads(centre - size / 2 * (u + v), size * u, size * v, BRIGHT)
    angle = np.linspace(0.0, 2 * np.pi, SEGMENTS + 1)
    ray = np.cos(angle)[:, None] * u + np.sin(angle)[:, None] * v
    to_edge = 1 / np.maximum(abs(np.cos(angle)), abs(np.sin(angle)))[:, None]
    rim = centre + size / 2 * ray
    edge = centre + BOARD * size / 2 * to_edge * ray
    fan = np.stack([np.broadcast_to(centre, rim[1:].shape), rim[:-1], rim[1:]], axis=1)
    disc = Mesh(fan, np.full(SEGMENTS, BRIGHT))
    return join([disc, four_corners(rim[:-1], edge[:-1], edge[1:], rim[1:], DARK)])


def facade(corner, along, height, inward, reflectance):
    """Mesh of a house front with a plain ground floor and rows of recessed windows above.

    Parameters
    ----------
    corner : (3,) array
        Lower corner. Units: m.
    along : (3,) array
        Horizontal edge. Units: m.
    height : float
        Units: m.
    inward : (3,) array
        Unit normal into the house.
    """
    ground, storey, bay, recess = 3.2, 3.0, 2.6, 0.18  # m
    rows = int((height - ground) // storey)
    columns = max(1, int(np.linalg.norm(along) // bay))
    plain = [quads(corner, along, ground * UP, reflectance)]
    top = ground + rows * storey
    plain.append(quads(corner + top * UP, along, (height - top) * UP, reflectance))
    if rows == 0:
        return join(plain)
    u, v = along / columns, storey * UP  # one cell of the front, with a window in its middle
    column, row = np.meshgrid(np.arange(columns), np.arange(rows))
    cell = corner + ground * UP + column.reshape(-1, 1) * u + row.reshape(-1, 1) * v
    window = cell + 0.25 * u + 0.25 * v
    wu, wv, depth = 0.5 * u, 0.5 * v, recess * inward
    frame = [
        quads(cell, u, 0.25 * v, reflectance),
        quads(cell + 0.75 * v, u, 0.25 * v, reflectance),
        quads(cell + 0.25 * v, 0.25 * u, wv, reflectance),
        quads(cell + 0.25 * v + 0.75 * u, 0.25 * u, wv, reflectance),
    ]
    reveal = [
        quads(window, wu, depth, reflectance),
        quads(window + wv, wu, depth, reflectance),
        quads(window, wv, depth, reflectance),
        quads(window + wu, wv, depth, reflectance),
    ]
    return join([*plain, *frame, *reveal, quads(window + depth, wu, wv, 0.1)])
