"""Pieces of surface as triangles: quads, boxes, posts, targets, houses, trees, cars."""

from dataclasses import dataclass

import numpy as np

BOARD = 1.5  # edge of a circle's dark board, in disc diameters
BRIGHT, DARK = 0.9, 0.06  # reflectance: white and black target paint
SEGMENTS = 64  # of a disc; its edge departs 0.4 mm from a circle of 0.6 m
UP = np.array([0.0, 0.0, 1.0])
GROUND_FLOOR, STOREY, BAY, RECESS = 3.2, 3.0, 2.6, 0.18  # m, of facades with windows
HOUSE = 5.0  # m of height from which a wall is a house's, with windows, depth and roof
DEPTH, RIDGE = 8.0, 2.5  # m of a house, and of its roof above the eaves
GLASS = 0.1  # reflectance of a window pane off its mirror direction
LEAF = 0.2  # m, edge of a leaf: a bunch of real ones, so that hundreds fill a crown
LEAVES = 1500  # of a tree at most
LEAF_REFLECTANCE = (0.35, 0.6)  # of green leaves at 905 nm
BARK = 0.25
CAR = np.array(  # side of a car: forward from its middle, above the ground (m)
    [
        *([-2.1, 0.25], [2.1, 0.25], [2.1, 0.65], [1.15, 0.85], [0.45, 1.4]),
        *([-1.1, 1.42], [-1.8, 0.95], [-2.1, 0.85]),
    ]
)
CAR_WIDTH = 1.7  # m


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


def facade(corner, along, height, inward, reflectance, ground=GROUND_FLOOR):
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
    ground : float
        Height of the ground floor. Units: m.
    """
    rows = max(0, int((height - ground) // STOREY))
    if rows == 0:
        return quads(corner, along, height * UP, reflectance)
    columns = max(1, int(np.linalg.norm(along) // BAY))
    top = ground + rows * STOREY
    plain = quads(
        np.array([corner, corner + top * UP]),
        along,
        np.array([ground * UP, (height - top) * UP]),
        reflectance,
    )
    column, row = np.meshgrid(np.arange(columns), np.arange(rows))
    u, v = along / columns, STOREY * UP
    cell = corner + ground * UP + column.reshape(-1, 1) * u + row.reshape(-1, 1) * v
    return join([plain, _windows(cell, u, v, RECESS * inward, reflectance)])


def _windows(cell, u, v, depth, reflectance):
    """Mesh of cells (n, 3) of a front, spanned by u and v, each with a recessed window. m."""
    window, wu, wv = cell + 0.25 * u + 0.25 * v, 0.5 * u, 0.5 * v
    frame_and_reveal = [
        quads(cell, u, 0.25 * v, reflectance),
        quads(cell + 0.75 * v, u, 0.25 * v, reflectance),
        quads(cell + 0.25 * v, 0.25 * u, wv, reflectance),
        quads(cell + 0.25 * v + 0.75 * u, 0.25 * u, wv, reflectance),
        quads(window, wu, depth, reflectance),
        quads(window + wv, wu, depth, reflectance),
        quads(window, wv, depth, reflectance),
        quads(window + wu, wv, depth, reflectance),
    ]
    return join([*frame_and_reveal, quads(window + depth, wu, wv, GLASS)])


def house(near, far, inward, height, reflectance):
    """Mesh of a house, or of a plain wall where it is low.

    near, far (3,): the lower corners of its front on the ground; inward (3,): unit normal into
    it; height (m) of the eaves above the lower of the corners. End walls stand across the street,
    so that they show in gaps.
    """
    base = np.array([near[0], near[1], min(near[2], far[2]) - 0.5])
    along = (far - near) * [1.0, 1.0, 0.0]
    height = height + 0.5
    is_house = height - 0.5 >= HOUSE
    back = (DEPTH if is_house else 0.3) * inward
    ends = quads(np.array([base, base + along]), back, height * UP, reflectance)
    if not is_house:
        top = quads(base + height * UP, along, back, reflectance)
        return join([quads(base, along, height * UP, reflectance), ends, top])
    ground = GROUND_FLOOR + 0.5 + abs(far[2] - near[2])  # windows start above both corners
    eaves = np.array([base + height * UP, base + height * UP + back])
    slopes = np.array([back / 2 + RIDGE * UP, -back / 2 + RIDGE * UP])
    roof = quads(eaves, along, slopes, 0.3)
    gable = eaves[0] + np.array([0.0 * back, back, back / 2 + RIDGE * UP])
    gables = Mesh(np.array([gable, gable + along]), np.full(2, reflectance))
    return join([facade(base, along, height, inward, reflectance, ground), ends, roof, gables])


def leaves(centre, radii, forward, count, rng):
    """Mesh of leaves scattered in a crown, so that a beam returns from any depth of it.

    Parameters
    ----------
    centre : (3,) array
        Units: m.
    radii : (3,) array
        Half axes of the crown along `forward`, across it and upright. Units: m.
    forward : (3,) array
        Horizontal unit vector.
    count : int
    """
    place = rng.standard_normal((count, 3))
    place *= rng.uniform(0.1, 1.0, (count, 1)) ** (1 / 3) / np.linalg.norm(
        place, axis=1, keepdims=True
    )
    axes = np.array([forward, np.cross(forward, UP), UP])
    middle = centre + (place * radii) @ axes
    corners = rng.standard_normal((count, 3, 3))
    corners -= corners.mean(axis=1, keepdims=True)
    corners *= LEAF / np.linalg.norm(corners, axis=2, keepdims=True).mean(axis=1, keepdims=True)
    return Mesh(middle[:, None] + 0.58 * corners, rng.uniform(*LEAF_REFLECTANCE, count))


def tree(foot, forward, crown, rng):
    """Mesh of a tree from its foot (3,): a trunk, and leaves above the height of a vehicle.

    crown (3,): half axes of the crown along the unit vector `forward`, across it, upright. m.
    """
    trunk = rng.uniform(2.9, 3.4)
    middle = foot + (trunk + crown[2]) * UP
    count = int(min(LEAVES, rng.uniform(150.0, 320.0) * np.prod(crown)))
    return join(
        [
            post(foot - 0.3 * UP, trunk + 0.3 + crown[2], rng.uniform(0.18, 0.3), BARK),
            leaves(middle, crown, forward, count, rng),
        ]
    )


def lamp(foot, towards):
    """Mesh of a street lamp of 6 m on its foot (3,), its arm along the unit vector `towards`."""
    side = np.cross(UP, towards)
    arm = box(foot + 5.9 * UP - 0.1 * side, 1.2 * towards, 0.2 * side, 0.12 * UP, 0.3)
    return join([post(foot - 0.3 * UP, 6.3, 0.14, 0.3), arm])


def car(place, forward, right, reflectance):
    """Mesh of a parked car about the place (3,) on the ground under its middle."""
    outline = place + CAR[:, :1] * forward + CAR[:, 1:] * UP
    middle = place + 0.7 * UP
    near, far = outline - CAR_WIDTH / 2 * right, outline + CAR_WIDTH / 2 * right
    skin = four_corners(near, np.roll(near, -1, 0), np.roll(far, -1, 0), far, reflectance)
    sides = [
        np.stack([np.broadcast_to(m, s.shape), s, np.roll(s, -1, 0)], axis=1)
        for m, s in (
            (middle - CAR_WIDTH / 2 * right, near),
            (middle + CAR_WIDTH / 2 * right, far),
        )
    ]
    sides = np.concatenate(sides)
    return join([skin, Mesh(sides, np.full(len(sides), reflectance))])


def ray_caster(triangles):
    """Open3D's ray caster of triangles (n, 3, 3) about a local origin, in their order."""
    import open3d as o3d

    corners = triangles.reshape(-1, 3).astype(np.float32)
    caster = o3d.t.geometry.RaycastingScene()
    caster.add_triangles(corners, np.arange(len(corners), dtype=np.uint32).reshape(-1, 3))
    return caster


def sees(caster, start, end):
    """Whether no triangle stands between points (n, 3) and (n, 3), to 5 cm: (n,) bool."""
    rays = np.hstack([start, end - start]).astype(np.float32)
    free = caster.cast_rays(rays)["t_hit"].numpy()
    return free > 1.0 - 0.05 / np.linalg.norm(end - start, axis=1)
