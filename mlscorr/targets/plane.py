"""Plane of a target by random sample consensus, refined by least squares."""

from dataclasses import dataclass

import numpy as np

TRIALS = 60  # finds a plane that holds half the points with probability 1 - 3e-4


@dataclass(frozen=True)
class Plane:
    """Origin (3,), axes (3, 3) with rows u, v and the normal, sigma about it (m), inliers."""

    origin: np.ndarray
    axes: np.ndarray
    sigma: float
    inliers: np.ndarray

    def coordinates(self, xyz):
        """u, v in the plane and w along the normal of points (n, 3): (n, 3). Units: m."""
        return (xyz - self.origin) @ self.axes.T

    def crossing(self, xyz, sight):
        """u, v (n, 2) where the beams along sight (n, 3) to points (n, 3) cross the plane. m."""
        local, beam = self.coordinates(xyz), sight @ self.axes.T
        return local[:, :2] - local[:, 2:] / beam[:, 2:] * beam[:, :2]


def fit_plane(xyz, tolerance, rng):
    """Plane through most points (n, 3), those within the tolerance (m) of it.

    Source: Fischler and Bolles 1981; the consensus set is refined twice by least squares, the
    second time within three sigmas. Raises ValueError for fewer than three points.
    """
    if len(xyz) < 3:
        raise ValueError(f"A plane needs 3 points, there are {len(xyz)}.")
    local = xyz - xyz.mean(axis=0)
    corners = local[rng.integers(len(local), size=(TRIALS, 3))]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1)
    normals, corners = normals[length > 1e-9], corners[length > 1e-9]
    normals /= length[length > 1e-9, None]
    distance = np.abs(local @ normals.T - np.sum(normals * corners[:, 0], axis=1))
    inside = np.ones(len(local), bool)
    if len(normals):
        inside = distance[:, np.argmax((distance <= tolerance).sum(axis=0))] <= tolerance
    for _ in range(2):
        centre = local[inside].mean(axis=0)
        _, singular, axes = np.linalg.svd(local[inside] - centre, full_matrices=False)
        sigma = singular[-1] / np.sqrt(max(inside.sum() - 3, 1))
        away = np.abs((local - centre) @ axes[-1])
        inside = away <= np.clip(3 * sigma, 1e-3, tolerance)
    return Plane(xyz.mean(axis=0) + centre, axes, float(sigma), inside)
