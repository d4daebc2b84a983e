"""A street as triangles about a local origin: road, houses, poles, cars and surveyed targets."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicSpline

from mlscorr.simulate.shapes import UP, Mesh, box, facade, four_corners, join, post, quads, target
from mlscorr.survey import KINDS

MARGIN = 40.0  # m of street before the start and after the end of the drive
RUN_IN = 6.0  # m from the ends to the first and last target, so that oblique beams reach them
ROAD, PAVEMENT = 3.0, 4.8  # m, half width to the kerb and to the house fronts of a one-way street
KERB = 0.12  # m
CROWN = 0.025  # cross fall of the carriageway, usual for drainage
PROFILE = np.array(  # lateral, height (m) and the reflectance of the strip to the next row
    [
        [-PAVEMENT - 1.2, KERB, 0.25],
        [-ROAD, KERB, 0.35],
        [-ROAD, 0.0, 0.18],
        [0.0, CROWN * ROAD, 0.18],
        [ROAD, 0.0, 0.35],
        [ROAD, KERB, 0.25],
        [PAVEMENT + 1.2, KERB, 0.0],
    ]
)
SUPPORTS = ("post", "wall", "road")


@dataclass(frozen=True)
class CentreLine:
    """A smooth curve by its length s (m): position (3,) at the road's edge level, and heading."""

    curve: CubicSpline

    def frame(self, s):
        """Position, unit forward and horizontal unit right vector, each (..., 3), at s (...)."""
        forward = self.curve(s, 1)
        forward = forward / np.linalg.norm(forward, axis=-1, keepdims=True)
        right = np.cross(forward, UP)
        return self.curve(s), forward, right / np.linalg.norm(right, axis=-1, keepdims=True)

    def place(self, s, lateral, height):
        """Points (..., 3) at a distance to the right of the line and a height above it. m."""
        position, _, right = self.frame(np.asarray(s, dtype=float))
        lateral = np.asarray(lateral, dtype=float)[..., None]
        return position + lateral * right + np.asarray(height, dtype=float)[..., None] * UP


@dataclass(frozen=True)
class Targets:
    """What the surveyor would find without noise: n targets in local coordinates.

    kind (tuple of n), centre (n, 3) in m, normal (n, 3) out of the visible side, and the road or
    house or post that carries each (tuple of n).
    """

    kind: tuple[str, ...]
    centre: np.ndarray
    normal: np.ndarray
    support: tuple[str, ...]

    def __len__(self):
        return len(self.kind)


@dataclass(frozen=True)
class Scene:
    """All that a scanner can hit.

    Parameters
    ----------
    mesh : Mesh
    target : (n,) int array
        Which target each triangle belongs to, -1 for none.
    targets : Targets
    centre_line : CentreLine
    """

    mesh: Mesh
    target: np.ndarray
    targets: Targets
    centre_line: CentreLine

    @cached_property
    def normal(self):
        """Unit normal (n, 3) of each triangle."""
        a, b, c = np.moveaxis(self.mesh.triangles, 1, 0)
        normal = np.cross(b - a, c - a)
        return normal / np.linalg.norm(normal, axis=1, keepdims=True)


@dataclass(frozen=True)
class _House:
    side: int  # -1 left, 1 right
    start: float  # m along the centre line
    end: float
    corners: np.ndarray  # (2, 3) lower corners of the front, at the pavement's level


def centre_line(length, rng):
    """A curving centre line of a length (m), starting at the local origin; radii above 60 m."""
    s = np.arange(-MARGIN, length + MARGIN + 1.0)
    phase = rng.uniform(0.0, 2 * np.pi, 4)
    heading = phase[3] + 0.26 * np.sin(s / 24.0 + phase[0]) + 0.05 * np.sin(s / 11.0 + phase[1])
    height = 1.2 * np.sin(s / 40.0 + phase[2])  # grades up to 3 %
    plan = cumulative_trapezoid(np.column_stack([np.sin(heading), np.cos(heading)]), s, axis=0)
    position = np.column_stack([np.vstack([np.zeros(2), plan]), height])
    curve = CubicSpline(s, position)
    return CentreLine(CubicSpline(s, position - curve(0.0)))


def build_scene(line, length, targets, size, rng):
    """A street along a centre line, with a number of targets of a size (m) evenly along it."""
    house_rng, target_rng, furniture_rng = rng.spawn(3)
    houses = _houses(length, line, house_rng)
    placed, meshes, along = _place_targets(line, length, houses, targets, size, target_rng)
    surroundings = [_road(line, length)]
    surroundings += [_house_mesh(house, house_rng) for house in houses]
    surroundings += _furniture(line, length, placed, along, size, furniture_rng)
    street = join(surroundings)
    number = np.repeat(np.arange(targets), [len(m) for m in meshes])
    return Scene(
        join([street, *meshes]),
        np.concatenate([np.full(len(street), -1), number]),
        placed,
        line,
    )


def _road(line, length):
    """Carriageway with crown, kerbs and pavements, as strips of 1 m."""
    s = np.arange(-MARGIN, length + MARGIN)
    strips = []
    for (x, z, reflectance), (next_x, next_z, _) in pairwise(PROFILE):
        left, right = line.place(s, x, z), line.place(s, next_x, next_z)
        strips.append(four_corners(left[:-1], right[:-1], right[1:], left[1:], reflectance))
    return join(strips)


def _houses(length, line, rng):
    """Straight house fronts along both sides, with gaps between some of them."""
    houses = []
    for side in (-1, 1):
        s = -MARGIN
        while s < length + MARGIN - 20.0:
            width = rng.uniform(8.0, 14.0)
            lateral = side * (PAVEMENT + rng.uniform(0.0, 0.4))
            corners = line.place([s, s + width], lateral, KERB)
            houses.append(_House(side, s, s + width, corners))
            s += width + (rng.uniform(2.0, 5.0) if rng.random() < 0.4 else 0.0)
    return houses


def _house_mesh(house, rng):
    """Front with windows and the two end walls."""
    near, far = house.corners
    along = (far - near) * [1.0, 1.0, 0.0]
    inward = house.side * np.cross(along, UP) / np.linalg.norm(along)
    height, reflectance = rng.uniform(6.0, 11.0), rng.uniform(0.2, 0.5)
    base = np.array([near[0], near[1], min(near[2], far[2]) - 0.5])
    ends = quads(np.array([base, base + along]), 8.0 * inward, height * UP, reflectance)
    return join([facade(base, along, height, inward, reflectance), ends])


def _place_targets(line, length, houses, count, size, rng):
    """Targets of alternating kind on posts, walls and the road: values, meshes, and s (count,)."""
    lead = min(RUN_IN, length / 4)
    share = (np.arange(count) + 0.5 + rng.uniform(-0.25, 0.25, count)) / count
    s = lead + share * (length - 2 * lead)
    order = np.concatenate([rng.permutation(3) for _ in range(-(-count // 3))])
    rows, meshes = [], []
    for i in range(count):
        kind, side = KINDS[i % 2], rng.choice([-1, 1])
        house = _house_at(houses, s[i], side)
        support = SUPPORTS[order[i]]
        if support == "wall" and house is None:
            support = "post"
        if support == "wall":
            centre, u, v = _on_wall(house, s[i], rng)
        elif support == "post":
            centre, u, v = _on_post(line, s[i], side, rng)
        else:
            centre, u, v = _on_road(line, s[i], side, rng)
        rows.append((kind, centre, np.cross(u, v), support))
        meshes.append(target(kind, centre, u, v, size))
    kinds, centres, normals, supports = zip(*rows, strict=True)
    return Targets(kinds, np.array(centres), np.array(normals), supports), meshes, s


def _house_at(houses, s, side):
    """The house on a side whose front reaches 1 m to both sides of s, or None."""
    found = [h for h in houses if h.side == side and h.start + 1.0 < s < h.end - 1.0]
    return found[0] if found else None


def _on_wall(house, s, rng):
    """Centre and plane vectors of a target 2 cm before a house front."""
    near, far = house.corners
    u = (far - near) * [1.0, 1.0, 0.0]
    u *= -house.side / np.linalg.norm(u)  # so that u x UP points to the street
    foot = near + (s - house.start) / (house.end - house.start) * (far - near)
    centre = foot + rng.uniform(1.3, 2.6) * UP + 0.02 * np.cross(u, UP)
    return centre, u, UP


def _on_post(line, s, side, rng):
    """Centre and plane vectors of a target on a post, turned towards the oblique beams."""
    _, forward, right = line.frame(s)
    turn = rng.uniform(0.0, np.radians(35.0))
    forward = forward - forward[2] * UP
    normal = -side * (np.cos(turn) * right + np.sin(turn) * forward / np.linalg.norm(forward))
    normal /= np.linalg.norm(normal)
    centre = line.place(s, side * rng.uniform(3.7, 4.2), KERB + rng.uniform(1.0, 2.2))
    return centre, np.cross(UP, normal), UP


def _on_road(line, s, side, rng):
    """Centre and plane vectors of a target 1 cm above the carriageway, turned in its plane."""
    lateral = rng.uniform(1.5, 2.2)
    _, forward, right = line.frame(s)
    across = right - side * CROWN * UP
    across /= np.linalg.norm(across)
    normal = np.cross(across, forward)
    spin = rng.uniform(0.0, np.pi / 2)
    u = np.cos(spin) * across + np.sin(spin) * forward
    centre = line.place(s, side * lateral, CROWN * (ROAD - lateral)) + 0.01 * normal
    return centre, u, np.cross(normal, u)


def _furniture(line, length, targets, along, size, rng):
    """Posts of the targets, lamp poles, and cars parked where they stand on no target."""
    pieces = []
    for i in np.flatnonzero(np.array(targets.support) == "post"):
        height = targets.centre[i, 2] - line.curve(along[i])[2] - KERB + size / 2
        foot = targets.centre[i] - 0.06 * targets.normal[i] - (height - size / 2) * UP
        pieces.append(post(foot, height, 0.06, 0.3))
    for s in np.arange(-MARGIN + 5.0, length + MARGIN - 5.0, 18.0) + rng.uniform(-3.0, 3.0):
        pieces.append(post(line.place(s, rng.choice([-1, 1]) * 3.3, KERB), 6.0, 0.14, 0.3))
    side = np.sign(_lateral(line, targets, along))
    for s in np.arange(0.0, length, 11.0) + rng.uniform(0.0, 4.0):
        car_side = rng.choice([-1, 1])
        on_target = (np.abs(along - s) < 3.4) & (side == car_side)
        on_target &= np.array(targets.support) != "wall"
        if not on_target.any() and rng.random() < 0.6:
            pieces.append(_car(line, s, car_side, rng))
    return pieces


def _lateral(line, targets, along):
    """Distance (n,) of targets to the right of the centre line. Units: m."""
    position, _, right = line.frame(along)
    return np.einsum("ij,ij->i", targets.centre - position, right)


def _car(line, s, side, rng):
    """A car as a box with a cabin, half on the pavement."""
    _, forward, right = line.frame(s)
    out, reflectance = side * right, rng.uniform(0.1, 0.5)
    corner = line.place(s, side * 2.1, 0.2) - 2.1 * forward
    body = box(corner, 4.2 * forward, 1.7 * out, 0.6 * UP, reflectance)
    cabin = corner + 1.0 * forward + 0.15 * out + 0.6 * UP
    return join([body, box(cabin, 2.3 * forward, 1.4 * out, 0.65 * UP, 0.1)])
