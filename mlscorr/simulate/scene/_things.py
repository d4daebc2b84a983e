"""Objects along a way, as triangles: targets, houses, trees, lamps, cars."""

import numpy as np
from numpy.random import Generator

from mlscorr.simulate.scene._dimensions import CAR, HOUSE, LAMP, ROOT, TREE
from mlscorr.simulate.scene.shapes import UP, Mesh, box, four_corners, post, quads
from mlscorr.simulate.settings import SETTINGS


def target(kind: str, centre: np.ndarray, u: np.ndarray, v: np.ndarray, size: float) -> Mesh:
    """Make the mesh of a target about its center (3,), in the plane of the unit vectors u, v (3,).

    A circle is a bright disc of diameter `size` within a darker square board of the same plane;
    a square is a bright plate of edge `size`. Units: m. With 64 segments the edge of a disc departs
    0.4 mm from a circle of 0.6 m.

    Parameters
    ----------
    kind : str
        circle or square.
    centre : (3,) array
        Units: m.
    u, v : (3,) array
        Unit vector in its plane.
    size : float
        Units: m.
    """
    if kind == "square":
        return quads(centre - size / 2 * (u + v), size * u, size * v, SETTINGS.white)
    segments = 64  # of a disc
    angle = np.linspace(0.0, 2 * np.pi, segments + 1)
    ray = np.cos(angle)[:, None] * u + np.sin(angle)[:, None] * v
    to_edge = 1 / np.maximum(abs(np.cos(angle)), abs(np.sin(angle)))[:, None]
    rim = centre + size / 2 * ray
    edge = centre + SETTINGS.board_edge * size / 2 * to_edge * ray
    fan = np.stack([np.broadcast_to(centre, rim[1:].shape), rim[:-1], rim[1:]], axis=1)
    disc = Mesh(fan, np.full(segments, SETTINGS.white))
    return Mesh.concatenate(
        [disc, four_corners(rim[:-1], edge[:-1], edge[1:], rim[1:], SETTINGS.black)]
    )


def facade(
    corner: np.ndarray,
    along: np.ndarray,
    height: float,
    inward: np.ndarray,
    reflectance: float,
    ground: float,
) -> Mesh:
    """Make the mesh of a house front with a plain ground floor and rows of recessed windows above.

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
    rows = max(0, int((height - ground) // HOUSE.storey))
    if rows == 0:
        return quads(corner, along, height * UP, reflectance)
    columns = max(1, int(np.linalg.norm(along) // HOUSE.bay))
    top = ground + rows * HOUSE.storey
    plain = quads(
        np.array([corner, corner + top * UP]),
        along,
        np.array([ground * UP, (height - top) * UP]),
        reflectance,
    )
    column, row = np.meshgrid(np.arange(columns), np.arange(rows))
    u = along / columns
    v = HOUSE.storey * UP
    cell = corner + ground * UP + column.reshape(-1, 1) * u + row.reshape(-1, 1) * v
    return Mesh.concatenate([plain, _windows(cell, u, v, HOUSE.recess * inward, reflectance)])


def _windows(cell, u, v, depth, reflectance):
    """Mesh of cells (n, 3) of a front, spanned by u and v, each with a recessed window. m."""
    frame = HOUSE.frame
    far = frame + HOUSE.window
    window = cell + frame * u + frame * v
    wu = HOUSE.window * u
    wv = HOUSE.window * v
    frame_and_reveal = [
        quads(cell, u, frame * v, reflectance),
        quads(cell + far * v, u, frame * v, reflectance),
        quads(cell + frame * v, frame * u, wv, reflectance),
        quads(cell + frame * v + far * u, frame * u, wv, reflectance),
        *(quads(edge, wu, depth, reflectance) for edge in (window, window + wv)),
        *(quads(edge, wv, depth, reflectance) for edge in (window, window + wu)),
    ]
    return Mesh.concatenate([*frame_and_reveal, quads(window + depth, wu, wv, HOUSE.glass)])


def house(
    near: np.ndarray, far: np.ndarray, inward: np.ndarray, height: float, reflectance: float
) -> Mesh:
    """Make the mesh of a house, or of a plain wall if it is low.

    near, far (3,): the lower corners of its front on the ground; inward (3,): unit normal into it;
    height (m) of the eaves above the lower of the corners. End walls are perpendicular to the
    street and thus visible in gaps.

    Parameters
    ----------
    near : (3,) array
        Lower corner of its front. Units: m.
    far : (3,) array
        The other one. Units: m.
    inward : (3,) array
        Unit normal into it.
    height : float
        Of the eaves above the lower corner. Units: m.
    reflectance : float
    """
    base = np.array([near[0], near[1], min(near[2], far[2]) - HOUSE.base])
    along = (far - near) * [1.0, 1.0, 0.0]
    height = height + HOUSE.base
    is_house = height - HOUSE.base >= HOUSE.lowest
    depth = HOUSE.wall_depth
    if is_house:
        depth = HOUSE.depth
    back = depth * inward
    ends = quads(np.array([base, base + along]), back, height * UP, reflectance)
    if not is_house:
        top = quads(base + height * UP, along, back, reflectance)
        return Mesh.concatenate([quads(base, along, height * UP, reflectance), ends, top])
    ground = (
        HOUSE.ground_floor + HOUSE.base + abs(far[2] - near[2])
    )  # windows start above both corners
    eaves = np.array([base + height * UP, base + height * UP + back])
    slopes = np.array([back / 2 + HOUSE.ridge * UP, -back / 2 + HOUSE.ridge * UP])
    roof = quads(eaves, along, slopes, HOUSE.roof)
    gable = eaves[0] + np.array([0.0 * back, back, back / 2 + HOUSE.ridge * UP])
    gables = Mesh(np.array([gable, gable + along]), np.full(2, reflectance))
    return Mesh.concatenate(
        [facade(base, along, height, inward, reflectance, ground), ends, roof, gables]
    )


def leaves(
    centre: np.ndarray, radii: np.ndarray, forward: np.ndarray, count: int, rng: Generator
) -> Mesh:
    """Make the mesh of leaves scattered in a crown, so that beams return from any depth of it.

    Parameters
    ----------
    centre : (3,) array
        Units: m.
    radii : (3,) array
        Half axes of the crown along `forward`, across it and upright. Units: m.
    forward : (3,) array
        Horizontal unit vector.
    count : int
    rng : Generator
    """
    place = rng.standard_normal((count, 3))
    place *= rng.uniform(TREE.hollow, 1.0, (count, 1)) ** (1 / 3) / np.linalg.norm(
        place, axis=1, keepdims=True
    )
    middle = centre + (place * radii) @ np.array([forward, np.cross(forward, UP), UP])
    corners = rng.standard_normal((count, 3, 3))
    corners -= corners.mean(axis=1, keepdims=True)
    corners *= TREE.leaf / np.linalg.norm(corners, axis=2, keepdims=True).mean(
        axis=1, keepdims=True
    )
    reflectance = rng.uniform(*TREE.leaf_reflectance, count)
    return Mesh(middle[:, None] + TREE.leaf_scale * corners, reflectance)


def tree(foot: np.ndarray, forward: np.ndarray, crown: np.ndarray, rng: Generator) -> Mesh:
    """Make the mesh of a tree from its foot (3,): a trunk, and leaves above vehicle height.

    crown (3,): half axes of the crown along the unit vector `forward`, across it, upright. m.

    Parameters
    ----------
    foot : (3,) array
        Units: m.
    forward : (3,) array
        Unit vector.
    crown : (3,) array
        Half axes along forward, across it, upright. Units: m.
    rng : Generator
    """
    trunk = rng.uniform(*TREE.trunk)
    middle = foot + (trunk + crown[2]) * UP
    count = int(min(TREE.most_leaves, rng.uniform(*TREE.density) * np.prod(crown)))
    thickness = rng.uniform(*TREE.thickness)
    stem = post(foot - ROOT * UP, trunk + ROOT + crown[2], thickness, TREE.bark)
    return Mesh.concatenate([stem, leaves(middle, crown, forward, count, rng)])


def lamp(foot: np.ndarray, towards: np.ndarray) -> Mesh:
    """Make the mesh of a street lamp on its foot (3,), its arm along the unit vector `towards`.

    Parameters
    ----------
    foot : (3,) array
        Units: m.
    towards : (3,) array
        Unit vector of its arm.
    """
    side = np.cross(UP, towards)
    arm = box(
        foot + (LAMP.height - LAMP.arm_drop) * UP - LAMP.arm_width / 2 * side,
        LAMP.arm * towards,
        LAMP.arm_width * side,
        LAMP.arm_depth * UP,
        LAMP.reflectance,
    )
    mast = post(foot - ROOT * UP, LAMP.height + ROOT, LAMP.width, LAMP.reflectance)
    return Mesh.concatenate([mast, arm])


def car(place: np.ndarray, forward: np.ndarray, right: np.ndarray, reflectance: float) -> Mesh:
    """Make the mesh of a parked car at the position (3,) on the ground under its middle.

    Parameters
    ----------
    place : (3,) array
        On the ground under its middle. Units: m.
    forward, right : (3,) array
        Unit vector.
    reflectance : float
    """
    ahead = np.array(CAR.ahead)[:, None]
    above = np.array(CAR.above)[:, None]
    outline = place + ahead * forward + above * UP
    middle = place + CAR.middle * UP
    half = CAR.width / 2 * right
    near = outline - half
    far = outline + half
    skin = four_corners(near, np.roll(near, -1, 0), np.roll(far, -1, 0), far, reflectance)
    sides = [
        np.stack([np.broadcast_to(m, s.shape), s, np.roll(s, -1, 0)], axis=1)
        for m, s in ((middle - half, near), (middle + half, far))
    ]
    sides = np.concatenate(sides)
    return Mesh.concatenate([skin, Mesh(sides, np.full(len(sides), reflectance))])
