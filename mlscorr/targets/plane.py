"""Plane of a target by random sample consensus, refined by least squares."""

from dataclasses import dataclass, replace

import numpy as np

FLOOR = 0.0001  # m, one sigma: what rounding leaves in a mean of many points
TRIALS = 60  # finds a plane that holds half the points with probability 1 - 3e-4
GOLDEN = 0.8191725133961645, 0.6710436067037893, 0.5497004779019703  # steps in three dimensions
TRIPLES = (0.5 + np.arange(1, TRIALS + 1)[:, None] * np.array(GOLDEN)) % 1.0


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
        with np.errstate(divide="ignore", invalid="ignore"):  # a beam along the plane never does
            return local[:, :2] - local[:, 2:] / beam[:, 2:] * beam[:, :2]


def plane_through(origin, normal):
    """Plane through a point (3,) with a unit normal (3,): axes any, sigma 0, no inliers."""
    u = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    u /= np.linalg.norm(u)
    return Plane(origin, np.array([u, np.cross(normal, u), normal]), 0.0, np.empty(0, bool))


def aligned(plane, other):
    """A plane with its axes turned to be like those of another one that is nearly parallel."""
    normal = plane.axes[2] * np.sign(plane.axes[2] @ other.axes[2])
    u = other.axes[0] - (other.axes[0] @ normal) * normal
    u /= np.linalg.norm(u)
    return replace(plane, axes=np.array([u, np.cross(normal, u), normal]))


def consensus(distance, tolerance):
    """Support (k,) of k planes by the distances (n, k) of points from them: nearer counts more.

    Source: MSAC (Torr and Zisserman 2000).
    """
    return np.clip(1.0 - (distance / tolerance) ** 2, 0.0, None).sum(axis=0)


def fit_plane(xyz, tolerance):
    """Plane through most points (n, 3), those within the tolerance (m) of it.

    Source: Fischler and Bolles 1981, on triples that are spread evenly over all (Roberts 2018,
    the R sequence) in place of random ones, so that the same points give the same plane; the
    consensus set is refined twice by least squares, the second time within three sigmas.

    Raises ValueError for fewer than three points.
    """
    if len(xyz) < 3:
        raise ValueError(f"A plane needs 3 points, there are {len(xyz)}.")
    local = xyz - xyz.mean(axis=0)
    corners = local[(TRIPLES * len(local)).astype(int)]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1)
    normals, corners = normals[length > 1e-9], corners[length > 1e-9]
    normals /= length[length > 1e-9, None]
    distance = np.abs(local @ normals.T - np.sum(normals * corners[:, 0], axis=1))
    inside = np.ones(len(local), bool)
    if len(normals):
        inside = distance[:, np.argmax(consensus(distance, tolerance))] <= tolerance
    for _ in range(2):
        centre = local[inside].mean(axis=0)
        _, singular, axes = np.linalg.svd(local[inside] - centre, full_matrices=False)
        sigma = singular[-1] / np.sqrt(max(inside.sum() - 3, 1))
        away = np.abs((local - centre) @ axes[-1])
        inside = away <= np.clip(3 * sigma, 1e-3, tolerance)
    return Plane(xyz.mean(axis=0) + centre, axes, float(sigma), inside)


@dataclass(frozen=True)
class Centre:
    """Where and when a beam meets the centre of an outline in a plane."""

    position: np.ndarray
    covariance: np.ndarray
    gps_time: float
    duration: float
    away: bool


def centre_of(pulses, plane, outline, rows):
    """Centre of an outline in space from the points (rows) on the target.

    Height and time there follow by regression, as the points may lie on one side of it. A plane
    too far moves the centre along the beam. Range noise may be correlated from point to point,
    which plain sigmas of a fit overlook: the residuals tell by how much.
    """
    crossing = plane.crossing(pulses.xyz[rows], pulses.sight[rows])
    basis = np.column_stack([np.ones(len(rows)), crossing - outline.centre])
    weights = np.linalg.pinv(basis)[0]
    height = plane.coordinates(pulses.xyz[rows])[:, 2]
    free = max(len(rows) - 3, 1)
    variance = plane.sigma**2 * (free + 2) / free * _correlation_factor(height)
    beam = plane.axes @ pulses.sight[rows].mean(axis=0)
    covariance = variance * (weights @ weights) * np.outer(beam, beam) / beam[2] ** 2
    covariance[:2, :2] += outline.covariance
    time = pulses.gps_time[rows] - pulses.gps_time[0]
    span = pulses.gps_time[[0, -1]] - pulses.gps_time[0]
    return Centre(
        position=plane.origin + outline.centre @ plane.axes[:2],
        covariance=plane.axes.T @ covariance @ plane.axes + FLOOR**2 * np.eye(3),
        gps_time=float(pulses.gps_time[0] + np.clip(weights @ time, *span)),
        duration=float(time.std()),
        away=bool(beam[2] > 0),
    )


def _correlation_factor(residual):
    """By how much correlation from point to point raises the variance of a mean, at least 1.

    Source: 1 + 2 sum of the autocorrelation up to where it is lost in its own noise.
    """
    n, centred = len(residual), residual - residual.mean()
    total, factor = centred @ centred, 1.0
    for lag in range(1, n // 4):
        correlation = centred[lag:] @ centred[:-lag] / max(total, 1e-30)
        if correlation < 2 / np.sqrt(n):
            break
        factor += 2 * correlation
    return factor
