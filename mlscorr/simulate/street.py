"""A street: carriageway with crown, kerbs and pavements, houses with gaps, lamps, trees, cars."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from mlscorr.simulate.line import MARGIN, CentreLine
from mlscorr.simulate.placing import EYE, SIGHT, Spot, scatter
from mlscorr.simulate.scenario import Scenario
from mlscorr.simulate.shapes import (
    UP,
    car,
    four_corners,
    house,
    join,
    lamp,
    ray_caster,
    sees,
    tree,
)

ROAD = 3.0  # m, half width to the kerb of a one-way street
PAVEMENT = 1.8  # m from the kerb to the house fronts
BEYOND = 9.0  # m of ground behind the fronts, which shows in gaps
LANE_EDGE = 2.4  # m that a lane's middle keeps from the kerb, cars parked half on it
KERB = 0.12  # m
CROWN = 0.025  # cross fall of the carriageway, usual for drainage
WHEELS = 0.5  # m, over which a vehicle's wheels smooth the crown
TURN_RADIUS = 6.0  # m, of a van at full lock
CLEAR = 0.7  # m by which other parts of the way may come nearer than a thing's own
REFLECTANCE = {"asphalt": 0.18, "kerb": 0.35, "pavement": 0.25, "garden": 0.3}
CROWN_AXES = np.array([1.7, 1.1, 1.6])  # m of a street tree: cut back on the side of the houses


@dataclass(frozen=True)
class Section:
    """The cross-section of a carriageway along its length.

    road (m): half width; turns: lengths (m) about which it widens to `widened` (m) for a U-turn.
    """

    road: float
    turns: tuple[float, ...] = ()
    widened: float = TURN_RADIUS + 2.0

    def half_width(self, s):
        """Half width (...) at lengths s (...). Units: m."""
        width = np.full(np.shape(s), self.road)
        for middle in self.turns:
            depth = np.clip((20.0 - np.abs(s - middle)) / 8.0, 0.0, 1.0)
            widened = self.road + max(0.0, self.widened - self.road) * depth**2 * (3 - 2 * depth)
            width = np.maximum(width, widened)
        return width

    def height(self, s, lateral):
        """Height (...) of the carriageway above its edge. Units: m."""
        return CROWN * self.road * (1.0 - np.abs(lateral) / self.half_width(s))

    def under_wheels(self, s, lateral):
        """Height of a vehicle's middle over the edge (m) and its fall to the right (rad), (...)."""
        fall = CROWN * self.road / self.half_width(s)
        smooth = np.hypot(lateral, WHEELS)
        return CROWN * self.road - fall * smooth, fall * np.asarray(lateral) / smooth


def section(scenario, length):
    """Section of a street wide enough for the lanes of a DriveScenario's passes."""
    lateral = max(abs(one.lateral) for one in scenario.passes)
    ends = {"forward": length + 6.0, "back": -6.0}
    turns = {ends[one.direction] for one in scenario.passes} if scenario.u_turn else ()
    return Section(max(ROAD, lateral + LANE_EDGE), tuple(sorted(turns)))


@dataclass(frozen=True)
class _House:
    side: int  # -1 left, 1 right
    start: float  # m along the centre line
    end: float
    near: np.ndarray  # (3,) lower corners of the front, at the pavement's level
    far: np.ndarray
    lateral: float  # m of the front's nearest part from the centre line


class Street:
    """What stands along a street; `spot` finds places for targets, `furniture` the rest."""

    def __init__(self, scenario: Scenario, line: CentreLine, length, rng):
        self.scenario, self.line, self.length = scenario.scene, line, length
        self.section = section(scenario.drive, length)
        self._front_rng, self._house_rng, self._furniture_rng = rng.spawn(3)

    @cached_property
    def houses(self):
        """Straight house fronts along both sides, with gaps after some of them."""
        rng, houses = self._front_rng, []
        for side in (-1, 1):
            s = -MARGIN
            while s < self.length + MARGIN - 14.0:
                width = rng.uniform(8.0, 14.0)
                setback = rng.uniform(0.0, 0.4)
                front = self._front(side, s, s + width, setback)
                if self._is_clear(front):
                    houses.append(front)
                gap = rng.uniform(2.0, 5.0)
                s += width + (gap if rng.random() < self.scenario.gaps else 0.0)
        return houses

    def _front(self, side, start, end, setback):
        """A front whose middle keeps off the pavement too where the street bends."""
        s = np.linspace(start, end, 5)
        kerb = self.section.half_width(s).max()
        lateral = side * (kerb + PAVEMENT + setback)
        corners = self.line.place(s, lateral, KERB)
        chord = corners[0] + np.linspace(0, 1, 5)[:, None] * (corners[-1] - corners[0])
        _, _, right = self.line.frame(s)
        bulge = side * np.einsum("ij,ij->i", corners - chord, right)
        lateral += side * max(0.0, bulge.max())
        near, far = self.line.place(s[[0, -1]], lateral, KERB)
        return _House(side, start, end, near, far, abs(lateral))

    def _is_clear(self, front):
        """Whether no other part of the way runs through a house."""
        steps = np.linspace(0.0, 1.0, 5)[:, None]
        points = front.near + steps * (front.far - front.near)
        inward = front.side * np.cross(front.far - front.near, UP)
        inward /= np.linalg.norm(inward)
        points = np.concatenate([points, points + 4.0 * inward, points + 8.0 * inward])
        return (self.line.distance(points) > self.section.road + PAVEMENT - CLEAR).all()

    @cached_property
    def mesh(self):
        """Ground and houses."""
        rng, low_high = self._house_rng, self.scenario.house_height
        pieces = [self._ground()]
        for front in self.houses:
            inward = front.side * np.cross(front.far - front.near, UP)
            inward /= np.linalg.norm(inward)
            height, reflectance = rng.uniform(*low_high), rng.uniform(0.2, 0.5)
            pieces.append(house(front.near, front.far, inward, height, reflectance))
        return join(pieces)

    def _ground(self):
        """Carriageway with crown, kerbs, pavements and gardens, as strips of 1 m."""
        s = np.arange(-MARGIN, self.length + MARGIN)
        edge = self.section.half_width(s)
        fence, garden = edge + PAVEMENT, edge + PAVEMENT + BEYOND
        kerb, flat = np.full_like(s, KERB), np.zeros_like(s)
        rows = [
            (-garden, kerb, "garden"),
            (-fence, kerb, "pavement"),
            (-edge, kerb, "kerb"),
            (-edge, flat, "asphalt"),
            (flat, self.section.height(s, flat), "asphalt"),
            (edge, flat, "kerb"),
            (edge, kerb, "pavement"),
            (fence, kerb, "garden"),
            (garden, kerb, None),
        ]
        strips = []
        for (x, z, surface), (next_x, next_z, _) in pairwise(rows):
            left, right = self.line.place(s, x, z), self.line.place(s, next_x, next_z)
            owned = self._owns(s[:-1], (left[:-1] + right[1:]) / 2, (x + next_x)[:-1] / 2)
            quad = (left[:-1], right[:-1], right[1:], left[1:])
            strips.append(four_corners(*(c[owned] for c in quad), REFLECTANCE[surface]))
        return join(strips)

    def _owns(self, s, middle, lateral):
        """Which ground quads belong to their part of the way, where it crosses or repeats itself.

        Of two carriageways the earlier one stays; pavements and gardens give way to any.
        """
        on_road = np.abs(lateral) < self.section.half_width(s)
        earlier = self.line.distance_to_other_parts(middle, s, earlier=True)
        any_part = self.line.distance_to_other_parts(middle, s)
        other = np.where(on_road, earlier, any_part)
        folded = self.line.distance(middle) < np.abs(lateral) - CLEAR
        return (other > self.section.road) & ~folded

    def spot(self, s, side, support, half, rng):
        """Spot for a target that reaches `half` (m) from its centre, or None where none is free."""
        spot = None
        if support == "wall":
            spot = self._on_wall(s, side, half, rng)
        if support == "road":
            spot = self._on_road(s, side, half, rng)
        if support == "post" or (spot is None and support == "wall"):
            spot = self._on_post(s, side, half, rng)
        if self.line.distance(spot.centre) < abs(spot.lateral) - CLEAR:
            return None  # in another part of the way
        other = self.line.distance_to_other_parts(spot.centre[None], np.array([s]))[0]
        return spot if other > self.section.road + half and self._is_seen(spot) else None

    @cached_property
    def _caster(self):
        return ray_caster(self.mesh.triangles)

    def _is_seen(self, spot):
        """Whether no house of another part of the way stands between the drive and a target."""
        eye = self.line.place(spot.s + SIGHT, 0.0, EYE)
        return sees(self._caster, eye, np.broadcast_to(spot.centre, eye.shape)).all()

    def _on_wall(self, s, side, half, rng):
        """On a house front, 2 cm before it; None where no front reaches far enough."""
        reach = half + 0.4
        for front in self.houses:
            if front.side == side and front.start + reach < s < front.end - reach:
                break
        else:
            return None
        u = (front.far - front.near) * [1.0, 1.0, 0.0]
        u *= -side / np.linalg.norm(u)  # so that u x UP points to the street
        share = (s - front.start) / (front.end - front.start)
        foot = front.near + share * (front.far - front.near)
        low = max(1.2, half + 0.3)
        centre = foot + rng.uniform(low, low + 1.0) * UP + 0.02 * np.cross(u, UP)
        return Spot("wall", s, side * front.lateral, centre, u, UP, foot[2])

    def _on_post(self, s, side, half, rng):
        """On a post on the pavement, facing the street."""
        _, forward, _ = self.line.frame(s)
        u = -side * (forward - forward[2] * UP) / np.linalg.norm(forward[:2])
        edge = float(self.section.half_width(s))
        lateral = side * (edge + rng.uniform(0.6, max(0.7, min(1.1, PAVEMENT - 0.6 * half))))
        foot = self.line.place(s, lateral, KERB)
        low = max(1.0, half + 0.2)
        centre = foot + rng.uniform(low, low + 1.2) * UP
        return Spot("post", s, lateral, centre, u, UP, foot[2])

    def _on_road(self, s, side, half, rng):
        """1 cm above the carriageway, turned in its plane."""
        edge, reach = float(self.section.half_width(s)), np.sqrt(2) * half + 0.05
        low, high = max(0.5 * edge, reach), min(0.73 * edge, edge - reach)
        lateral = side * rng.uniform(min(low, high), max(low, high))
        steps = np.array([-0.2, 0.2])
        along = self.line.place(s + steps, lateral, self.section.height(s + steps, lateral))
        across = self.line.place(s, lateral + steps, self.section.height(s, lateral + steps))
        forward = (along[1] - along[0]) / np.linalg.norm(along[1] - along[0])
        normal = np.cross(across[1] - across[0], forward)
        normal /= np.linalg.norm(normal)
        right = np.cross(forward, normal)
        spin = rng.uniform(0.0, np.pi / 2)
        u = np.cos(spin) * right + np.sin(spin) * forward
        centre = along.mean(axis=0) + 0.01 * normal
        return Spot("road", s, lateral, centre, u, np.cross(normal, u), centre[2])

    def furniture(self, placed):
        """Mesh of parked cars, lamps and trees that stand before no target and in no way."""
        taken, pieces = [], [placed.posts]
        kinds = (
            (self.scenario.cars, -0.05, 2.3, self._car),
            (self.scenario.poles, 0.3, 0.2, self._lamp),
            (self.scenario.trees, 0.7, 0.3, self._tree),
        )
        streams = self._furniture_rng.spawn(len(kinds))
        for (density, from_kerb, extent, make), rng in zip(kinds, streams, strict=True):

            def is_free(s, side, from_kerb=from_kerb, extent=extent):
                crowded = any(side == b and abs(s - a) < extent + c for a, b, c in taken)
                lateral = side * (float(self.section.half_width(s)) + from_kerb)
                return not crowded and self._has_room(s, lateral, extent, placed)

            start, end = -MARGIN + 4.0, self.length + MARGIN - 4.0
            for s, side in scatter(density, start, end, is_free, rng):
                taken.append((s, side, extent))
                lateral = side * (float(self.section.half_width(s)) + from_kerb)
                pieces.append(make(s, side, lateral, rng))
        return join(pieces)

    def _has_room(self, s, lateral, extent, placed):
        """Whether a thing may stand there: before no target, in no other way, in no U-turn."""
        place = self.line.place(s, lateral, 0.0)
        in_a_way = self.line.distance(place) < abs(lateral) - CLEAR
        in_a_turn = extent > 1.0 and self.section.half_width(s) > self.section.road
        return not (in_a_way or in_a_turn or placed.in_the_way(s, lateral, extent))

    def _lamp(self, s, side, lateral, rng):
        _, _, right = self.line.frame(s)
        return lamp(self.line.place(s, lateral, KERB), -side * right)

    def _tree(self, s, side, lateral, rng):
        _, forward, _ = self.line.frame(s)
        forward = (forward - forward[2] * UP) / np.linalg.norm(forward[:2])
        return tree(self.line.place(s, lateral, KERB), forward, CROWN_AXES, rng)

    def _car(self, s, side, lateral, rng):
        """Half on the pavement."""
        _, forward, right = self.line.frame(s)
        return car(self.line.place(s, lateral, 0.05), forward, right, rng.uniform(0.1, 0.5))
