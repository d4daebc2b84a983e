"""Where in a piece of cloud a target may be: bright components, flat patches, gaps in patches."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import Delaunay, cKDTree

from mlscorr.targets.beams import Pulses
from mlscorr.targets.clusters import FEWEST_POINTS, bright_components, connected
from mlscorr.targets.plane import Plane, consensus, fit_plane, plane_through
from mlscorr.targets.shapes import diameter

LEAST_EXTENT = 0.7, 0.33  # of the size, along and across: a target may be partly hidden
LARGEST_EXTENT = 1.3  # of the longest extent: with a line spacing of noise at either end
BLOOMED = 1.35  # times the size, of a disc that saturates the receiver
LINK_SHARES = 0.2, 0.4  # of the size, between neighbours on a patch
GUESSES = 0.2, 0.4, 0.8  # m, of an unknown size: sets how far neighbours may be apart
PATCHES = 10  # flat patches looked for in a piece: road, walls, and then plates
SAMPLES = 100  # planes tried for each
MOST_POINTS = 8000  # thinned, in which patches are looked for
GRAZING = 0.1  # sine of the angle between a beam and a plane it can be said to cross
GAPS = 12  # looked at on a patch, largest first
LEAST_GAP = 0.06  # m, diameter of the smallest hole


@dataclass(frozen=True)
class Seed:
    """A place to fit a shape at.

    Parameters
    ----------
    rows : (n,) int array
        Points on the target; about a hole, those of the board.
    plane : Plane
    threshold : float
        Of intensity between dark and bright.
    by_edges : bool
        Whether intensity tells nothing.
    extent : float
        About the longest extent of what is seen. Units: m.
    middle : (2,) array
        About the centre, in the plane. Units: m.
    bloomed : bool
        Whether the receiver was saturated: the outline may be larger than the size.
    mesh : float
        Of the points about a gap, whose extent is of the largest circle without points. Units: m.
    """

    rows: np.ndarray
    plane: Plane
    threshold: float
    by_edges: bool
    extent: float
    middle: np.ndarray
    bloomed: bool = False
    mesh: float = 0.0


@dataclass(frozen=True)
class Spot:
    """A bright blob: centre (3,) and half extent in m, and the least intensity of its points."""

    centre: np.ndarray
    reach: float
    threshold: float


def spot_seeds(pulses: Pulses, spot, origin, kind, size):
    """Seeds in one bright blob (Spot) of a cloud about an origin (3,), as of bright_seeds."""
    apart = np.linalg.norm(pulses.xyz - (spot.centre - origin), axis=1)
    bright = pulses.intensity >= spot.threshold
    rows = np.flatnonzero((apart <= spot.reach) & bright)
    saturated = np.mean(pulses.intensity[rows] >= pulses.intensity.max()) > 0.5
    guess, bloomed = size or 1.4 * spot.reach, BLOOMED if saturated else 1.0
    for seed in _flat_parts(pulses, rows, kind, size, guess, bloomed):
        yield Seed(*seed[:2], spot.threshold, False, *seed[2:], saturated)


def bright_seeds(pulses: Pulses, kind, size):
    """Seeds at bright components of the extent of a shape; of any extent where size is None."""
    saturated = pulses.intensity.max()
    for guess in GUESSES if size is None else (size,):
        for level, rows in bright_components(pulses.xyz, pulses.intensity, guess):
            bloomed = BLOOMED if np.mean(pulses.intensity[rows] >= saturated) > 0.5 else 1.0
            for seed in _flat_parts(pulses, rows, kind, size, guess, bloomed):
                yield Seed(*seed[:2], level, False, *seed[2:], bloomed > 1)


def plate_seeds(pulses: Pulses, kind, size, rng):
    """Seeds at flat patches of the extent of a shape, whatever their intensity."""
    for guess in GUESSES if size is None else (size,):
        for plane, rows in flat_patches(pulses, guess, rng):
            points = plane.crossing(pulses.xyz[rows], pulses.sight[rows])
            for share in LINK_SHARES:
                for part in _components(points, max(share * guess, 0.06)):
                    seed = _sized(pulses, rows[part], plane, kind, size, guess, 1.0)
                    if seed is not None:
                        yield Seed(*seed[:2], 0.0, True, *seed[2:])


def hole_seeds(pulses: Pulses, size, rng):
    """Seeds at round gaps in flat patches: where a circle of the size holds no point of it."""
    for plane, rows in flat_patches(pulses, size or 0.4, rng):
        points = plane.crossing(pulses.xyz[rows], pulses.sight[rows])
        for middle, radius, mesh in _gaps(pulses, plane, points, size):
            about = np.linalg.norm(points - middle, axis=1) < 2.5 * radius
            if about.sum() >= FEWEST_POINTS:
                yield Seed(rows[about], plane, 0.0, True, 2 * radius, middle, mesh=mesh)


def flat_patches(pulses, size, rng):
    """Planes of a piece with the rows on each, most points first; a point is on one of them."""
    left = _thinned(pulses.xyz, size / 12, rng)
    fewest = FEWEST_POINTS / 2
    for _ in range(PATCHES):
        if len(left) < fewest:
            return
        plane = _most_common_plane(pulses.xyz[left], size, pulses.tolerance, rng)
        if plane is None:
            return
        on_plane = np.abs(plane.coordinates(pulses.xyz[left])[:, 2]) <= pulses.tolerance
        if on_plane.sum() < fewest:
            return
        plane = fit_plane(pulses.xyz[left[on_plane]], pulses.tolerance)
        height = np.abs(plane.coordinates(pulses.xyz)[:, 2])
        steep = np.abs(pulses.sight @ plane.axes[2]) > GRAZING * np.linalg.norm(
            pulses.sight, axis=1
        )
        yield plane, np.flatnonzero((height <= pulses.tolerance) & steep)
        left = left[height[left] > pulses.tolerance]


def _most_common_plane(xyz, size, tolerance, rng):
    """The plane through three near points that most points lie on, or None."""
    seeds = rng.integers(len(xyz), size=SAMPLES)
    balls = cKDTree(xyz).query_ball_point(xyz[seeds], size / 2)
    pairs = np.array([[ball[int(i * len(ball))] for i in rng.random(2)] for ball in balls])
    normal = np.cross(xyz[pairs[:, 0]] - xyz[seeds], xyz[pairs[:, 1]] - xyz[seeds])
    length = np.linalg.norm(normal, axis=1)
    good = length > 1e-6
    if not good.any():
        return None
    normal, origin = normal[good] / length[good, None], xyz[seeds[good]]
    away = np.abs(xyz @ normal.T - np.sum(normal * origin, axis=1))
    best = np.argmax(consensus(away, tolerance))
    return plane_through(origin[best], normal[best])


def _flat_parts(pulses, rows, kind, size, guess, bloomed):
    """Flat parts of a component that have a shape's extent: itself, or what is left of it without
    a post or pole before or beside it."""
    for _ in range(3):
        if len(rows) < FEWEST_POINTS or _too_small(pulses, rows, size or guess):
            return
        plane = fit_plane(pulses.xyz[rows], pulses.tolerance)
        inside = plane.inliers
        whole = inside.mean() >= 0.7
        flat = rows[inside]
        if whole or inside.sum() >= FEWEST_POINTS:
            points = plane.crossing(pulses.xyz[flat], pulses.sight[flat])
            parts = [np.arange(len(flat))] if whole else _components(points, 0.4 * guess)
            for part in parts:
                seed = _sized(pulses, flat[part], plane, kind, size, guess, bloomed)
                if seed is not None:
                    yield seed
        if whole:
            return
        rows = rows[~inside]


def _too_small(pulses, rows, size):
    """Whether points are too close together for a shape of this size (m), on whatever plane."""
    longest = np.linalg.norm(np.ptp(pulses.xyz[rows], axis=0))
    return longest + 2 * pulses.tolerance < size / 2  # of a guess; of a known size, more is asked


def _sized(pulses, rows, plane, kind, size, guess, bloomed):
    """(rows, plane, extent, middle) of a part of the extent that a shape may have, or None."""
    if len(rows) < FEWEST_POINTS:
        return None
    points = plane.crossing(pulses.xyz[rows], pulses.sight[rows])
    if not np.isfinite(points).all():  # beams along the plane
        return None
    low, high = points.min(axis=0), points.max(axis=0)
    extent = high - low
    if size is None:
        if not guess / 2 <= extent.max() <= 2 * guess or extent.min() < 0.4 * extent.max():
            return None
    else:
        if extent.max() > LARGEST_EXTENT * bloomed * diameter(kind, size):
            return None
        if extent.max() < LEAST_EXTENT[0] * size or extent.min() < LEAST_EXTENT[1] * size:
            return None
    return rows, plane, float(extent.max()), (low + high) / 2


def _components(points, link):
    """Index arrays of the connected components of points (n, 2), those with enough points."""
    label = connected(np.column_stack([points, np.zeros(len(points))]), link)
    order = np.argsort(label, kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(label[order])) + 1)
    return [np.sort(part) for part in parts if len(part) >= FEWEST_POINTS]


def _gaps(pulses, plane, points, size):
    """Middle (2,), radius and mesh (m) of the largest circles with no point on or before a patch.

    They are circumcircles of the Delaunay triangles (their centres are Voronoi's corners).
    """
    height, beam = plane.coordinates(pulses.xyz)[:, 2], pulses.sight @ plane.axes[2]
    blocked = (height * beam < 0) & (np.abs(height) > pulses.tolerance)
    blocked &= np.abs(beam) > GRAZING * np.linalg.norm(pulses.sight, axis=1)
    before = plane.crossing(pulses.xyz[blocked], pulses.sight[blocked])
    known = np.vstack([points, before])
    known = known[:: len(known) // MOST_POINTS + 1]
    if len(known) < FEWEST_POINTS:
        return
    a, b, c = np.moveaxis(known[Delaunay(known).simplices], 1, 0)
    centre, radius = _circumcircles(a, b, c)
    low, high = (LEAST_GAP / 2, 0.75) if size is None else (0.4 * size, 0.75 * size)
    if size is None:
        low = max(low, 2.5 * float(np.median(radius)))
    order = np.argsort(-radius)
    order = order[(radius[order] >= low) & (radius[order] <= high)]
    found = []
    tree = cKDTree(points)
    for i in order:
        apart = all(np.linalg.norm(centre[i] - other) > radius[i] for other in found)
        if apart and _surrounded(
            points[tree.query_ball_point(centre[i], 1.5 * radius[i])], centre[i]
        ):
            found.append(centre[i])
            near = np.linalg.norm(centre - centre[i], axis=1) < 2 * radius[i]
            yield centre[i], float(radius[i]), float(np.median(radius[near]))
        if len(found) >= GAPS:
            return


def _surrounded(points, middle):
    """Whether points (n, 2) lie all round a place: in three quarters of the directions."""
    direction = np.arctan2(*(points - middle).T)
    return len(np.unique(np.floor(direction / (2 * np.pi) * 16))) >= 12


def _circumcircles(a, b, c):
    """Centre (n, 2) and radius (n,) of the circles through three points each."""
    b, c = b - a, c - a
    twice = 2 * (b[:, 0] * c[:, 1] - b[:, 1] * c[:, 0])
    square_b, square_c = np.sum(b * b, axis=1), np.sum(c * c, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        x = (c[:, 1] * square_b - b[:, 1] * square_c) / twice
        y = (b[:, 0] * square_c - c[:, 0] * square_b) / twice
    radius = np.hypot(x, y)
    return a + np.column_stack([x, y]), np.where(np.isfinite(radius), radius, np.inf)


def _thinned(xyz, voxel, rng):
    """Rows of one point in each voxel, and at most MOST_POINTS of them."""
    _, rows = np.unique(np.floor(xyz / max(voxel, 0.02)).astype(int), axis=0, return_index=True)
    if len(rows) > MOST_POINTS:
        rows = rng.choice(rows, MOST_POINTS, replace=False)
    return np.sort(rows)
