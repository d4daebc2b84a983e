"""Placement of targets along a way, partial obstruction, and clearance from other objects."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.random import Generator

from mlscorr.simulate.scenario import TargetScenario
from mlscorr.simulate.scene._dimensions import ROOT, TARGET_POST
from mlscorr.simulate.scene._things import target
from mlscorr.simulate.scene.centre_line import CentreLine
from mlscorr.simulate.scene.shapes import UP, Mesh, box, post
from mlscorr.simulate.settings import SETTINGS
from mlscorr.survey import Columns


@dataclass(frozen=True)
class TargetSpot:
    """Position of one target: the plane (unit vectors u, v) and the ground below its center.

    s and lateral (m) place it along the way; ground (m) is the height at the foot of a post.
    """

    support: str
    s: float
    lateral: float
    centre: np.ndarray
    u: np.ndarray
    v: np.ndarray
    ground: float

    @property
    def normal(self) -> np.ndarray:
        """Unit normal out of the visible side."""
        return np.cross(self.u, self.v)


@dataclass(frozen=True, repr=False)
class Targets(Columns):
    """Targets without survey noise: n targets in local coordinates.

    kind (tuple of n), centre (n, 3) in m, normal (n, 3) out of the visible side, its support (road,
    wall or post; tuple of n), and flags (n,) of a narrow post in front.
    """

    kind: tuple[str, ...]
    centre: np.ndarray
    normal: np.ndarray
    support: tuple[str, ...]
    hidden: np.ndarray


@dataclass(frozen=True)
class Placed:
    """Targets with their meshes (one each), the mesh of their posts, and their spots."""

    targets: Targets
    meshes: tuple[Mesh, ...]
    posts: Mesh
    spots: tuple[TargetSpot, ...]

    def obstructs(self, s: float, lateral: float, extent: float, wedge: float = 1.2) -> bool:
        """True if an object at s, of a half extent along the way (m), would hide a target.

        This holds within the wedge of 50 deg to each side (its tangent) from which a target on the
        same side is visible, or next to it.

        Parameters
        ----------
        s : float
            Along the line. Units: m.
        lateral : float
            To its right. Units: m.
        extent : float
            Half, along the way. Units: m.
        wedge : float
            Tangent of the half angle from which a target is seen.
        """
        for spot in self.spots:
            if spot.support == "road" or np.sign(spot.lateral) == np.sign(lateral):
                depth = max(0.0, abs(spot.lateral) - abs(lateral))
                if abs(spot.s - s) < wedge * depth + extent + 1.2:
                    return True
        return False


def place_targets(
    scenario: TargetScenario, length: float, site: Any, yaw: float, rng: Generator
) -> Placed:
    """Place targets, evenly along a way of a length (m) and on alternating sides.

    Parameters
    ----------
    scenario : TargetScenario
    site : object
        Its ``spot(s, side, support, half, rng)`` returns a TargetSpot, or None without room for a
        target that extends `half` (m) from its center.
    yaw : float
        Turn of the scan plane against the cross-section, which posts' targets face. Units: rad.

    Targets without a position are omitted with a warning. Raises ValueError if targets are too
    large or too many, or if none can be placed.
    """
    count = scenario.control + scenario.check
    s = _along(scenario, count, length, rng)
    start_side = rng.choice([-1, 1])
    # all in turn, at random
    order = np.concatenate([rng.permutation(len(scenario.supports)) for _ in range(count)])
    steps = np.array([0, 0.03, -0.03, 0.08, -0.08, 0.15, -0.15, 0.25, -0.25, 0.4, -0.4])
    spots: list[TargetSpot] = []
    kinds = []
    unplaced = []
    for i in range(count):
        kind = scenario.kinds[i % len(scenario.kinds)]
        half = _half(kind, scenario.size)
        side = start_side * (-1) ** i
        support = scenario.supports[order[i]]
        near = np.clip(s[i] + length / count * steps, 0.0, length)
        spot = _find_spot(site, near, side, support, half, spots, rng)
        if spot is None:
            unplaced.append(s[i])
            continue
        spots.append(spot)
        kinds.append(kind)
    _report_unplaced(unplaced, count)
    spots = [_faced(spot, yaw, rng) if spot.support == "post" else spot for spot in spots]
    hidden = _choose_hidden(spots, scenario.hidden, rng)
    posts = [_own_post(spot, scenario.size) for spot in spots if spot.support == "post"]
    posts += [_slat(spots[i], kinds[i], scenario.size, rng) for i in np.flatnonzero(hidden)]
    return _placed(tuple(kinds), tuple(spots), scenario.size, hidden, posts)


def _placed(kinds, spots, size, hidden, posts):
    """Placed targets of some kinds at their spots, with the meshes of posts."""
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
    return Placed(targets, meshes, Mesh.concatenate([nothing, *posts]), spots)


def _half(kind, size):
    """Half the edge of a target with its board. Units: m."""
    if kind == "circle":
        return size / 2 * SETTINGS.board_edge
    return size / 2


def _along(scenario, count, length, rng):
    """Even positions (count,) along the way, each moved slightly at random. Units: m."""
    if scenario.size > SETTINGS.largest_target:
        raise ValueError(
            f"Targets of {scenario.size} m are too large: their boards, {SETTINGS.board_edge} "
            "times as large, must fit a lane and the ground floor of a wall. Give a size of up "
            f"to {SETTINGS.largest_target} m."
        )
    run_in = min(SETTINGS.run_in, length / 4)
    nearest = 2 - 2 * SETTINGS.jitter
    jitter = SETTINGS.jitter
    spacing = (length - 2 * run_in) / count
    half = max(_half(kind, scenario.size) for kind in scenario.kinds)
    across = 2 * np.sqrt(2) * half + SETTINGS.target_clearance
    if nearest * spacing < across:
        room = int((length - 2 * run_in) * nearest / across)
        raise ValueError(
            f"{count} targets of {scenario.size} m do not fit along {length:.0f} m without "
            f"touching; there is room for {room}. Use fewer targets or a longer drive."
        )
    return run_in + spacing * (np.arange(count) + 0.5 + rng.uniform(-jitter, jitter, count))


def _find_spot(site, near, side, support, half, others, rng):
    """First TargetSpot near lengths (k,) in m with room, at a distance from others; or a post;
    or None.
    """
    distance = 2 * np.sqrt(2) * half + SETTINGS.target_clearance
    for kind in dict.fromkeys([support, "post"]):
        for s in near:
            for on_side in (side, -side):
                spot = site.spot(float(s), on_side, kind, half, rng)
                if spot is not None and all(
                    np.linalg.norm(spot.centre - other.centre) > distance for other in others
                ):
                    return spot
    return None


def _report_unplaced(places, count):
    """Warn of targets without a position, by their intended lengths (m); refuse if all are."""
    if not places:
        return
    sentence = (
        f"{len(places)} of {count} targets find no free place along the drive (first: at "
        f"{places[0]:.0f} m): there is too little room between drive and walls, no ground, or no "
        "line of sight."
    )
    if len(places) == count:
        raise ValueError(f"{sentence} Use smaller targets, other supports or another route.")
    warnings.warn(f"{sentence} The survey is made without them.", stacklevel=2)


def _faced(spot, yaw, rng):
    """TargetSpot of a post turned about the vertical toward the oblique beams of a scan plane."""
    turn = rng.uniform(0.0, 1.0) * np.clip(yaw, -np.radians(35.0), np.radians(35.0))
    cos = np.cos(turn)
    sin = np.sin(turn)
    u = np.array([cos * spot.u[0] - sin * spot.u[1], sin * spot.u[0] + cos * spot.u[1], 0.0])
    return replace(spot, u=u)


def _choose_hidden(spots, share, rng):
    """Flag (n,) of partly hidden targets: a share of all, except horizontal ones."""
    upright = [i for i, spot in enumerate(spots) if abs(spot.normal[2]) < 0.2]
    hidden = np.zeros(len(spots), dtype=bool)
    hidden[rng.permutation(upright)[: round(share * len(spots))].astype(int)] = True
    return hidden


def _own_post(spot, size):
    """Post behind a target, from the ground to its upper edge."""
    foot = spot.centre - TARGET_POST.width * spot.normal
    foot[2] = spot.ground - ROOT
    height = spot.centre[2] + size / 2 - foot[2]
    return post(foot, height, TARGET_POST.width, TARGET_POST.reflectance)


def _slat(spot, kind, size, rng):
    """Upright flat slat close in front of a target, which hides a part of it."""
    shares = TARGET_POST.slat_circle if kind == "circle" else TARGET_POST.slat_square
    width = size * rng.uniform(*shares)
    offset = TARGET_POST.slat_offset
    lateral = size * rng.uniform(-offset, offset)
    corner = spot.centre + TARGET_POST.slat_distance * spot.normal
    corner = corner + (lateral - width / 2) * spot.u
    corner[2] = spot.ground - ROOT
    height = spot.centre[2] + _half(kind, size) + TARGET_POST.slat_over - corner[2]
    depth = TARGET_POST.slat_depth * spot.normal
    return box(corner, width * spot.u, height * UP, depth, TARGET_POST.reflectance)


def eyes(line: CentreLine, s: float) -> np.ndarray:
    """Positions (3, 3) on a CentreLine from which a target at s (m) must be visible.

    Parameters
    ----------
    line : CentreLine
    s : float
        Of the target. Units: m.
    """
    return line.place(s + SETTINGS.sight_distance * np.arange(-1, 2), 0.0, SETTINGS.eye_height)


def scatter(
    density: float, start: float, end: float, is_free: Callable, rng: Generator, places: int = 12
) -> list[tuple[float, int]]:
    """Positions (s, side) of objects, evenly spread at a density between two lengths (m).

    Each interval of the way gets one object, at a random position with is_free(s, side), or none
    after the given number of attempts.

    Parameters
    ----------
    density : float
        Things per 100 m.
    start, end : float
        Units: m.
    is_free : function
        Of s and side.
    rng : Generator
    places : int
        Attempts at a random position for each object.
    """
    count = round(density * (end - start) / 100.0)
    spacing = (end - start) / max(count, 1)
    things = []
    for i in range(count):
        lengths = start + spacing * (i + rng.uniform(0.0, 1.0, places))
        for s, side in zip(lengths, rng.choice([-1, 1], places), strict=True):
            if is_free(s, side):
                things.append((s, side))
                break
    return things
