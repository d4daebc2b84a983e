"""Plane of a target by random sample consensus, refined by least squares."""

from dataclasses import dataclass, replace

import numpy as np

from mlscorr.compiled_loops import loop
from mlscorr.targets._sequence import quasi_random
from mlscorr.targets.settings import SETTINGS


@dataclass(frozen=True)
class Plane:
    """Plane in space, and the points on it.

    Parameters
    ----------
    origin : (3,) array
        Units: m.
    axes : (3, 3) array
        Rows u, v and the normal.
    sigma : float
        Sigma of the points about the plane. Units: m.
    inliers : (n,) bool array
    """

    origin: np.ndarray
    axes: np.ndarray
    sigma: float
    inliers: np.ndarray

    def coordinates(self, xyz: np.ndarray) -> np.ndarray:
        """Return u, v in the plane and w along the normal.

        Parameters
        ----------
        xyz : (n, 3) array
            Units: m.
        """
        return (xyz - self.origin) @ self.axes.T

    def crossing(self, xyz: np.ndarray, sight: np.ndarray) -> np.ndarray:
        """Return u, v (n, 2) of the crossings of beams with the plane.

        Parameters
        ----------
        xyz, sight : (n, 3) array
            Points of the beams, and scanner to point. Units: m.
        """
        local = self.coordinates(xyz)
        beam = sight @ self.axes.T
        with np.errstate(divide="ignore", invalid="ignore"):  # a parallel beam never crosses it
            return local[:, :2] - local[:, 2:] / beam[:, 2:] * beam[:, :2]

    def turned_like(self, other: "Plane") -> "Plane":
        """Return the plane with axes as close as possible to those of another.

        Parameters
        ----------
        other : Plane
            Nearly parallel plane.
        """
        normal = self.axes[2] * np.sign(self.axes[2] @ other.axes[2])
        u = other.axes[0] - (other.axes[0] @ normal) * normal
        u /= np.linalg.norm(u)
        return replace(self, axes=np.array([u, np.cross(normal, u), normal]))


@loop
def most_common(xyz: np.ndarray, triples: np.ndarray, tolerance: float) -> np.ndarray:
    """Flag of points on the plane with most support; nearer points count more.

    Parameters
    ----------
    xyz : (n, 3) array
        Units: m.
    triples : (k, 3) int array
        Rows of three points that define a trial plane.
    tolerance : float
        Units: m.

    Returns
    -------
    (n,) bool array
        All False if no three points span a plane.

    Source: MSAC (Torr and Zisserman 2000).
    """
    origin = xyz[0]
    best = np.zeros(3)
    largest = -1.0
    for i, j, k in triples:
        normal = np.cross(xyz[j] - xyz[i], xyz[k] - xyz[i])
        length = np.sqrt(np.sum(normal**2))
        if length == 0.0:
            continue
        normal /= length
        a, b, c = normal
        offset = np.sum(normal * xyz[i])
        support = 0.0
        for x, y, z in xyz:
            support += max(1.0 - ((a * x + b * y + c * z - offset) / tolerance) ** 2, 0.0)
        if support > largest:
            origin = xyz[i]
            best = normal
            largest = support
    return (np.abs(np.sum((xyz - origin) * best, axis=1)) <= tolerance) & (largest >= 0.0)


def fit_plane(xyz: np.ndarray, tolerance: float) -> Plane:
    """Fit the plane through most points.

    Parameters
    ----------
    xyz : (n, 3) array
        Units: m.
    tolerance : float
        Points within this distance support a plane. Units: m.

    Raises
    ------
    ValueError
        If there are fewer than three points.

    Source: Fischler and Bolles 1981, on evenly spread instead of random triples. The consensus set
    is refined twice by least squares, the second time within three sigmas. For boards with a post
    behind them, the RMS is 0.28 deg and 0.6 mm; ``segment_plane`` of Open3D takes 3 times as long
    and has 1.5 deg and 2.3 mm, because it includes points of the post
    (``benchmarks/bench_libraries.py``).
    """
    if len(xyz) < 3:
        raise ValueError(f"A plane needs at least 3 points; there are {len(xyz)}.")
    triples = (quasi_random(SETTINGS.plane_trials, 3) * len(xyz)).astype(int)
    return Plane(*_fit_plane(xyz, triples, tolerance))


@loop
def _fit_plane(xyz, triples, tolerance):
    """Fit origin (3,), axes (3, 3), sigma and inliers (n,); a piece of cloud needs hundreds."""
    middle = xyz.sum(axis=0) / len(xyz)
    local = xyz - middle
    square = np.empty((3, 3))
    inside = most_common(local, triples, tolerance)
    inside |= not inside.any()  # all on a line
    for _ in range(2):
        points = local[inside]
        centre = points.sum(axis=0) / len(points)
        points -= centre
        for i in range(3):  # not by BLAS, whose sums depend on the number of threads
            for j in range(3):
                square[i, j] = np.sum(points[:, i] * points[:, j])
        squares, axes = np.linalg.eigh(square)
        sigma = np.sqrt(max(squares[0], 0.0) / max(len(points) - 3, 1))
        height = np.abs(np.sum((local - centre) * axes[:, 0], axis=1))
        inside = height <= min(max(3 * sigma, 1e-3), tolerance)
    return middle + centre, axes.T[::-1].copy(), sigma, inside
