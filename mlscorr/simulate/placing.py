"""Where targets stand along a way, what hides them, and where other things keep clear of them."""

from dataclasses import dataclass, replace

import numpy as np

from mlscorr.simulate.shapes import BOARD, UP, Mesh, box, join, post, target

RUN_IN = 6.0  # m from the ends to the first and last target, so that oblique beams reach them
JITTER = 0.25  # of the spacing, so that targets do not stand like a ruler's marks
LARGEST = 1.2  # m: a board of 1.8 m still fits a lane, a wall's ground floor and a pavement
SPARE = 0.1  # m at least between two targets
RETRIES = np.array([0.0, 0.03, -0.03, 0.08, -0.08, 0.15, -0.15, 0.25, -0.25, 0.4, -0.4])  # spacings
WEDGE = 1.2  # tangent of the 50 deg to each side from which a target is seen
EYE = 2.2  # m above the way: a scanner on a car's roof
SIGHT = np.array([-3.5, 0.0, 3.5])  # m along the way, from where a target must be seen
POST_WIDTH = 0.06  # m, of a target's own post
SLAT_DISTANCE, SLAT_DEPTH = 0.15, 0.02  # m: what hides a target is flat and close in front of it
HIDDEN = {"circle": (0.17, 0.25), "square": (0.23, 0.33)}  # slat's width by size: hides 20-40 %
TRIES = 12  # random places for a tree, car or pole before its stretch of the way goes without


@dataclass(frozen=True)
class Spot:
    """A place for one target: the plane (unit vectors u, v) and the ground below its centre.

    s and lateral (m) place it along the way; ground (m) is the height of what a post stands on.
    """

    support: str
    s: float
    lateral: float
    centre: np.ndarray
    u: np.ndarray
    v: np.ndarray
    ground: float

    @property
    def normal(self):
        """Unit normal out of the visible side."""
        return np.cross(self.u, self.v)


@dataclass(frozen=True)
class Targets:
    """What the surveyor would find without noise: n targets in local coordinates.

    kind (tuple of n), centre (n, 3) in m, normal (n, 3) out of the visible side, the road or wall
    or post that carries each (tuple of n), and whether a narrow post stands in front (n,).
    """

    kind: tuple[str, ...]
    centre: np.ndarray
    normal: np.ndarray
    support: tuple[str, ...]
    hidden: np.ndarray

    def __len__(self):
        return len(self.kind)


@dataclass(frozen=True)
class Placed:
    """Targets with their meshes (one each), the mesh of their posts, and their spots."""

    targets: Targets
    meshes: tuple[Mesh, ...]
    posts: Mesh
    spots: tuple[Spot, ...]

    def in_the_way(self, s, lateral, extent):
        """Whether a thing at s, of a half extent along the way (m), would stand before a target.

        It would where it lies in the wedge from which a target on its side is seen, or beside it.
        """
        for spot in self.spots:
            if spot.support == "road" or np.sign(spot.lateral) == np.sign(lateral):
                depth = max(0.0, abs(spot.lateral) - abs(lateral))
                if abs(spot.s - s) < WEDGE * depth + extent + 1.2:
                    return True
        return False


def place_targets(scenario, length, site, yaw, rng):
    """Placed targets, evenly along a way of a length (m) and on alternating sides.

    Parameters
    ----------
    scenario : TargetScenario
    site : object
        Its ``spot(s, side, support, half, rng)`` gives a Spot, or None where there is no room for
        a target that reaches `half` (m) from its centre.
    yaw : float
        Turn of the scan plane against the cross-section, which posts' targets face. Units: rad.

    Raises ValueError for targets that are too large or too many, or that find no place.
    """
    count = scenario.control + scenario.check
    s = _along(scenario, count, length, rng)
    start_side = rng.choice([-1, 1])
    order = np.concatenate(
        [rng.permutation(len(scenario.supports)) for _ in range(count)]  # all in turn, at random
    )
    spots, kinds = [], []
    for i in range(count):
        kind = scenario.kinds[i % len(scenario.kinds)]
        half = _half(kind, scenario.size)
        side, support = start_side * (-1) ** i, scenario.supports[order[i]]
        near = np.clip(s[i] + length / count * RETRIES, 0.0, length)
        spots.append(_find_spot(site, near, side, support, half, spots, rng))
        kinds.append(kind)
    spots = [_faced(spot, yaw, rng) if spot.support == "post" else spot for spot in spots]
    hidden = _choose_hidden(spots, scenario.hidden, rng)
    posts = [_own_post(spot, scenario.size) for spot in spots if spot.support == "post"]
    posts += [_slat(spots[i], kinds[i], scenario.size, rng) for i in np.flatnonzero(hidden)]
    return _placed(tuple(kinds), tuple(spots), scenario.size, hidden, posts)


def _placed(kinds, spots, size, hidden, posts):
    """Placed targets of some kinds on their spots, with the meshes of posts."""
    nothing = Mesh(np.empty((0, 3, 3)), np.empty(0))
    targets = Targets(
        kinds,
        np.array([spot.centre for spot in spots]),
        np.array([spot.normal for spot in spots]),
        tuple(spot.support for spot in spots),
        hidden,
    )
    meshes = tuple(
        target(kind, spot.centre, spot.u, spot.v, size)
        for kind, spot in zip(kinds, spots, strict=True)
    )
    return Placed(targets, meshes, join([nothing, *posts]), spots)


def _half(kind, size):
    """Half the edge of a target with its board. Units: m."""
    return size / 2 * (BOARD if kind == "circle" else 1.0)


def _along(scenario, count, length, rng):
    """Even places (count,) along the way, each moved a little at random. Units: m."""
    if scenario.size > LARGEST:
        raise ValueError(
            f"Targets of {scenario.size} m are too large: boards of {BOARD} times that must fit "
            f"a lane and a wall's ground floor. Give a size up to {LARGEST} m."
        )
    lead = min(RUN_IN, length / 4)
    spacing = (length - 2 * lead) / count
    across = 2 * np.sqrt(2) * max(_half(kind, scenario.size) for kind in scenario.kinds)
    if (2 - 2 * JITTER) * spacing < across + SPARE:
        room = int((length - 2 * lead) * (2 - 2 * JITTER) / (across + SPARE))
        raise ValueError(
            f"{count} targets of {scenario.size} m do not fit along {length:.0f} m without "
            f"touching: there is room for {room}. Give fewer, or a longer drive."
        )
    return lead + spacing * (np.arange(count) + 0.5 + rng.uniform(-JITTER, JITTER, count))


def _find_spot(site, near, side, support, half, others, rng):
    """The first Spot at lengths near (k,) in m with room and no target beside; at last a post."""
    apart = 2 * np.sqrt(2) * half + SPARE
    for kind in dict.fromkeys([support, "post"]):
        for s in near:
            for on_side in (side, -side):
                spot = site.spot(float(s), on_side, kind, half, rng)
                if spot is not None and all(
                    np.linalg.norm(spot.centre - other.centre) > apart for other in others
                ):
                    return spot
    raise ValueError(
        f"Target {len(others) + 1} finds no free place beside the drive at {near[0]:.0f} m: too "
        "little room between drive and walls, no ground, or no free sight."
    )


def _faced(spot, yaw, rng):
    """A post's Spot turned about the vertical towards the oblique beams of a scan plane."""
    turn = rng.uniform(0.0, 1.0) * np.clip(yaw, -np.radians(35.0), np.radians(35.0))
    cos, sin = np.cos(turn), np.sin(turn)
    u = np.array([cos * spot.u[0] - sin * spot.u[1], sin * spot.u[0] + cos * spot.u[1], 0.0])
    return replace(spot, u=u)


def _choose_hidden(spots, share, rng):
    """Which targets are partly hidden: a share of all, none of those that lie flat. (n,) bool."""
    upright = [i for i, spot in enumerate(spots) if abs(spot.normal[2]) < 0.2]
    hidden = np.zeros(len(spots), dtype=bool)
    hidden[rng.permutation(upright)[: round(share * len(spots))].astype(int)] = True
    return hidden


def _own_post(spot, size):
    """The post behind a target, from the ground to its upper edge."""
    foot = spot.centre - POST_WIDTH * spot.normal
    foot[2] = spot.ground - 0.3
    return post(foot, spot.centre[2] + size / 2 - foot[2], POST_WIDTH, 0.3)


def _slat(spot, kind, size, rng):
    """An upright slat in front of a target: from wherever it is seen, it hides a strip."""
    width = size * rng.uniform(*HIDDEN[kind])
    aside = size * rng.uniform(-0.06, 0.06)
    corner = spot.centre + SLAT_DISTANCE * spot.normal + (aside - width / 2) * spot.u
    corner[2] = spot.ground - 0.3
    height = spot.centre[2] + _half(kind, size) + 0.1 - corner[2]
    return box(corner, width * spot.u, height * UP, SLAT_DEPTH * spot.normal, 0.3)


def scatter(density, start, end, is_free, rng):
    """Places (s, side) of things, so many per 100 m of way between two lengths (m), evenly.

    Each stretch of the way takes one thing, at a random place of it where is_free(s, side).
    """
    count = round(density * (end - start) / 100.0)
    stretch = (end - start) / max(count, 1)
    places = []
    for i in range(count):
        tries = start + stretch * (i + rng.uniform(0.0, 1.0, TRIES))
        sides = rng.choice([-1, 1], TRIES)
        for s, side in zip(tries, sides, strict=True):
            if is_free(s, side):
                places.append((s, side))
                break
    return places
