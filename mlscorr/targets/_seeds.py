"""Seeds of targets in a piece of cloud: bright components, flat patches, gaps in patches."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial import Delaunay, cKDTree

from mlscorr.targets._clusters import bright_components, components
from mlscorr.targets._echoes import Echoes
from mlscorr.targets._plane import Plane, fit_plane, most_common
from mlscorr.targets.regions import BrightRegion
from mlscorr.targets.settings import SETTINGS
from mlscorr.targets.shapes import diameter


@dataclass(frozen=True)
class Seed:
    """Position at which to fit a shape.

    Parameters
    ----------
    rows : (n,) int array
        Points on the target; for a hole, points of the board.
    plane : Plane
    threshold : float
        Threshold of intensity between dark and bright.
    by_edges : bool
        True if intensity gives no information.
    extent : float
        Approximate longest extent of the visible part. Units: m.
    middle : (2,) array
        Approximate center, in the plane. Units: m.
    bloomed : bool
        True if the receiver was saturated, so that the outline may be larger than the size.
    mesh : float
        Spacing of the points around a gap; the extent is then that of the largest empty circle.
        Units: m.
    """

    rows: np.ndarray
    plane: Plane
    threshold: float
    by_edges: bool
    extent: float
    middle: np.ndarray
    bloomed: bool = False
    mesh: float = 0.0


def region_seeds(
    echoes: Echoes, region: BrightRegion, origin: np.ndarray, kind: str, size: float | None
) -> Iterator[Seed]:
    """Yield seeds in one bright region.

    Parameters
    ----------
    echoes : Echoes
    region : BrightRegion
    origin : (3,) array
        Origin of the echoes, in the region's coordinates. Units: m.
    kind : str
    size : float or None
        Units: m.
    """
    distance = np.linalg.norm(echoes.xyz - (region.centre - origin), axis=1)
    rows = np.flatnonzero((distance <= region.radius) & (echoes.intensity >= region.threshold))
    guess = size or 1.4 * region.radius  # half of a square's diagonal
    yield from _bright_parts(echoes, rows, region.threshold, kind, size, guess)


def bright_seeds(echoes: Echoes, kind: str, size: float | None) -> Iterator[Seed]:
    """Yield seeds at bright components with the extent of a shape.

    Parameters
    ----------
    echoes : Echoes
    kind : str
    size : float or None
        None for any extent. Units: m.
    """
    for guess in _guesses(size):
        for level, rows in bright_components(echoes.xyz, echoes.intensity, guess):
            yield from _bright_parts(echoes, rows, level, kind, size, guess)


def _guesses(size):
    """Sizes (m) to search for if a target's own is not known."""
    if size is None:
        return SETTINGS.size_guesses
    return (size,)


def plate_seeds(
    echoes: Echoes, kind: str, size: float | None, rng: np.random.Generator
) -> Iterator[Seed]:
    """Yield seeds at flat patches with the extent of a shape, regardless of intensity.

    Parameters
    ----------
    echoes : Echoes
    kind : str
    size : float or None
        None for any extent. Units: m.
    rng : numpy.random.Generator
    """
    for guess in _guesses(size):
        for plane, rows in flat_patches(echoes, guess, rng):
            points = plane.crossing(echoes.xyz[rows], echoes.sight(rows))
            for share in SETTINGS.link_shares:
                for part in components(points, max(share * guess, 2 * SETTINGS.thickness)):
                    extent = _extent(points[part], kind, size, guess)
                    if extent is not None:
                        yield Seed(rows[part], plane, 0.0, True, *extent)


def hole_seeds(echoes: Echoes, size: float | None, rng: np.random.Generator) -> Iterator[Seed]:
    """Yield seeds at round gaps in flat patches, where a circle of the size contains no point.

    Parameters
    ----------
    echoes : Echoes
    size : float or None
        Units: m.
    rng : numpy.random.Generator
    """
    for plane, rows in flat_patches(echoes, size or np.median(SETTINGS.size_guesses), rng):
        points = plane.crossing(echoes.xyz[rows], echoes.sight(rows))
        for middle, radius, mesh in _gaps(echoes, plane, points, size):
            about = np.linalg.norm(points - middle, axis=1) < 2.5 * radius
            if about.sum() >= SETTINGS.smallest_count:
                yield Seed(rows[about], plane, 0.0, True, 2 * radius, middle, mesh=mesh)


def flat_patches(
    echoes: Echoes, size: float, rng: np.random.Generator
) -> Iterator[tuple[Plane, np.ndarray]]:
    """Yield planes of a piece with the rows on each, most points first; a point is on one of them.

    Parameters
    ----------
    echoes : Echoes
    size : float
        Size of a target. Units: m.
    rng : numpy.random.Generator
    """
    left = _thinned(echoes.xyz, size / 12, rng)
    smallest = SETTINGS.smallest_count / 2
    for _ in range(SETTINGS.plane_patches):
        if len(left) < smallest:
            return
        triples = _near_triples(echoes.xyz[left], size, rng)
        on_plane = most_common(echoes.xyz[left], triples, echoes.tolerance)
        if on_plane.sum() < smallest:
            return
        plane = fit_plane(echoes.xyz[left[on_plane]], echoes.tolerance)
        height = np.abs(plane.coordinates(echoes.xyz)[:, 2])
        yield plane, np.flatnonzero((height <= echoes.tolerance) & _steep(echoes, plane))
        left = left[height[left] > echoes.tolerance]


def _steep(echoes, plane):
    """Flag of beams that cross a plane at a sufficient angle."""
    sight = echoes.sight(slice(None))
    return np.abs(sight @ plane.axes[2]) > SETTINGS.least_crossing_sine * np.linalg.norm(
        sight, axis=1
    )


def _near_triples(xyz, size, rng):
    """Rows (k, 3) of three points close to each other."""
    seeds = rng.integers(len(xyz), size=SETTINGS.plane_trials)
    balls = cKDTree(xyz).query_ball_point(xyz[seeds], size / 2)
    pairs = [[ball[int(i * len(ball))] for i in rng.random(2)] for ball in balls]
    return np.column_stack([seeds, pairs])


def _bright_parts(echoes, rows, threshold, kind, size, guess):
    """Seeds at the flat parts of a bright component, larger if the receiver was saturated."""
    if len(rows) < SETTINGS.smallest_count:
        return
    bloomed = bool(np.mean(echoes.intensity[rows] >= echoes.intensity.max()) > 0.5)
    bloom = SETTINGS.bloom if bloomed else 1.0
    for part, plane, points in _flat_parts(echoes, rows, guess):
        extent = _extent(points, kind, size, guess, bloom)
        if extent is not None:
            yield Seed(part, plane, threshold, False, *extent, bloomed)


def _flat_parts(echoes, rows, size):
    """Flat parts of a component, with planes and coordinates in them: all of it, or without a
    post.
    """
    for _ in range(3):
        if len(rows) < SETTINGS.smallest_count:
            return
        xyz = echoes.xyz[rows]
        longest = np.linalg.norm(np.ptp(xyz, axis=0))
        if longest + 2 * echoes.tolerance < size / 2:  # too small on any plane
            return
        plane = fit_plane(xyz, echoes.tolerance)
        flat = rows[plane.inliers]
        whole = plane.inliers.mean() >= 0.7
        points = plane.crossing(xyz[plane.inliers], echoes.sight(flat))
        link = SETTINGS.link_shares[-1] * size
        if whole:
            parts = [np.arange(len(flat))]
        else:
            parts = components(points, link)
        for part in parts:
            if len(part) >= SETTINGS.smallest_count and np.isfinite(points[part]).all():
                yield flat[part], plane, points[part]  # no beam is parallel to the plane
        if whole:
            return
        rows = rows[~plane.inliers]


def _extent(points, kind, size, guess, bloom=1.0):
    """Longest extent and middle (2,) of points (n, 2) if a shape may have them, otherwise None."""
    low = points.min(axis=0)
    high = points.max(axis=0)
    shortest, longest = np.sort(high - low)
    if size is None:
        fits = guess / 2 <= longest <= 2 * guess and shortest >= 0.4 * longest
    else:
        fits = longest <= (2 - SETTINGS.smallest_length) * bloom * diameter(kind, size)
        fits &= longest >= SETTINGS.smallest_length * size
        fits &= shortest >= SETTINGS.smallest_width * size
    if fits:
        return (float(longest), (low + high) / 2)
    return None


def _gaps(echoes, plane, points, size):
    """Middle (2,), radius and spacing (m) of the largest empty circles on or before a patch.

    They are circumcircles of the Delaunay triangles (centers are Voronoi vertices).
    """
    height = plane.coordinates(echoes.xyz)[:, 2]
    beam = echoes.sight(slice(None)) @ plane.axes[2]
    blocked = (height * beam < 0) & (np.abs(height) > echoes.tolerance)
    blocked &= _steep(echoes, plane)
    known = np.vstack([points, plane.crossing(echoes.xyz[blocked], echoes.sight(blocked))])
    known = known[:: len(known) // SETTINGS.piece_points + 1]
    if len(known) < SETTINGS.smallest_count:
        return
    a, b, c = np.moveaxis(known[Delaunay(known).simplices], 1, 0)
    centre, radius = _circumcircles(a, b, c)
    if size is None:
        low = max(SETTINGS.thickness, 2.5 * float(np.median(radius)))
        high = 0.75
    else:
        low = 0.4 * size
        high = 0.75 * size
    order = np.argsort(-radius)
    order = order[(radius[order] >= low) & (radius[order] <= high)]
    centres = []
    tree = cKDTree(points)
    for i in order:
        is_separate = all(np.linalg.norm(centre[i] - other) > radius[i] for other in centres)
        if is_separate and _surrounded(
            points[tree.query_ball_point(centre[i], 1.5 * radius[i])], centre[i]
        ):
            centres.append(centre[i])
            near = np.linalg.norm(centre - centre[i], axis=1) < 2 * radius[i]
            yield centre[i], float(radius[i]), float(np.median(radius[near]))
        if len(centres) >= SETTINGS.plane_patches:
            return


def _surrounded(points, middle):
    """True if points (n, 2) surround a position, in three quarters of the directions."""
    direction = np.arctan2(*(points - middle).T)
    return len(np.unique(np.floor(direction / (2 * np.pi) * 16))) >= 12


def _circumcircles(a, b, c):
    """Center (n, 2) and radius (n,) of the circles through three points each."""
    b = b - a
    c = c - a
    twice = 2 * (b[:, 0] * c[:, 1] - b[:, 1] * c[:, 0])
    square_b = np.sum(b * b, axis=1)
    square_c = np.sum(c * c, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        x = (c[:, 1] * square_b - b[:, 1] * square_c) / twice
        y = (b[:, 0] * square_c - c[:, 0] * square_b) / twice
    radius = np.hypot(x, y)
    return a + np.column_stack([x, y]), np.where(np.isfinite(radius), radius, np.inf)


def _thinned(xyz, voxel, rng):
    """Rows of one point in each voxel, at most SETTINGS.piece_points in all."""
    _, rows = np.unique(np.floor(xyz / max(voxel, 0.02)).astype(int), axis=0, return_index=True)
    if len(rows) > SETTINGS.piece_points:
        rows = rng.choice(rows, SETTINGS.piece_points, replace=False)
    return np.sort(rows)
