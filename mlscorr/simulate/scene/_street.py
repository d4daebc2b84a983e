"""Street: its cross-section, with crown and curbs; houses with gaps, lamps, trees, cars."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.random import Generator

from mlscorr.simulate.scenario import DriveScenario, Scenario
from mlscorr.simulate.scene._dimensions import (
    CAR,
    HOUSE,
    ON_GROUND,
    ON_WALL,
    WALL_ENDS,
    Furniture,
    HouseRow,
    TargetHeight,
)
from mlscorr.simulate.scene._things import car, house, lamp, tree
from mlscorr.simulate.scene.centre_line import CentreLine
from mlscorr.simulate.scene.placing import Placed, TargetSpot, eyes, scatter
from mlscorr.simulate.scene.shapes import UP, Mesh, four_corners, sees, unit
from mlscorr.simulate.settings import SETTINGS
from mlscorr.simulate.vehicle import VEHICLES


@dataclass(frozen=True)
class StreetSection:
    """Cross-section of a street along its length.

    Parameters
    ----------
    road : float
        Half width of the carriageway. Units: m.
    turns : tuple of float
        Lengths about which it widens to `widened`, for a U-turn. Units: m.
    widened : float
        A van's full lock, and room. Units: m.
    turn_reach, turn_taper : float
        From the middle of a U-turn to where the widening ends, and over which it narrows. Units: m.
    pavement, garden : float
        Width from the curb to the house fronts, and of the ground behind them. Units: m.
    kerb : float
        Height. Units: m.
    cross_fall : float
        Of the carriageway, usual for drainage. Units: ratio.
    clearance : float
        Tolerance for other parts of the way to be closer than an object's own. Units: m.
    line, line_from_kerb, paint : float
        Width of a painted line, distance from its middle to the adjacent curb, thickness of
        thermoplastic paint. Units: m.
    dash : tuple of float
        Length of a dash of the middle line, and of the gap after it, usual in towns. Units: m.
    asphalt, kerbstone, paving, lawn, white_line : float
        Reflectance of the carriageway, of the curb, of the pavement, of the gardens, of paint.
    """

    road: float = 3.0
    turns: tuple[float, ...] = ()
    widened: float = VEHICLES["street"].turning_radius + 2.0
    turn_reach: float = 20.0
    turn_taper: float = 8.0
    pavement: float = 1.8
    garden: float = 9.0
    kerb: float = 0.12
    cross_fall: float = 0.025
    clearance: float = 0.7
    line: float = 0.12
    line_from_kerb: float = 0.3
    paint: float = 0.003
    dash: tuple[float, float] = (3.0, 6.0)
    asphalt: float = 0.18
    kerbstone: float = 0.35
    paving: float = 0.25
    lawn: float = 0.3
    white_line: float = 0.6

    def half_width(self, s: float | np.ndarray) -> np.ndarray:
        """Return the half width (...) at lengths s (...). Units: m.

        Parameters
        ----------
        s : (...) array
            Length along the line. Units: m.
        """
        width = np.full(np.shape(s), self.road)
        for middle in self.turns:
            inside = self.turn_reach - np.abs(s - middle)
            depth = np.clip(inside / self.turn_taper, 0.0, 1.0)
            widened = self.road + max(0.0, self.widened - self.road) * depth**2 * (3 - 2 * depth)
            width = np.maximum(width, widened)
        return width

    def height(self, s: float | np.ndarray, lateral: float | np.ndarray) -> np.ndarray:
        """Return the height (...) of the carriageway above its edge. Units: m.

        Parameters
        ----------
        s : (...) array
            Length along the line. Units: m.
        lateral : (...) array
            To the right of the line. Units: m.
        """
        return self.cross_fall * self.road * (1.0 - np.abs(lateral) / self.half_width(s))

    def under_wheels(
        self, s: float | np.ndarray, lateral: float | np.ndarray, wheels: float = 0.5
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return height of a vehicle's middle over the edge (m) and fall to the right (rad).

        The track (m) of its wheels smooths the crown.

        Parameters
        ----------
        s : (...) array
            Length along the line. Units: m.
        lateral : (...) array
            To the right of the line. Units: m.
        wheels : float
            Over which the crown is smoothed. Units: m.
        """
        fall = self.cross_fall * self.road / self.half_width(s)
        smooth = np.hypot(lateral, wheels)
        return self.cross_fall * self.road - fall * smooth, fall * np.asarray(lateral) / smooth


LANE_EDGE = 2.4  # m, from the middle of a lane to the curb, as cars park half on it
TURN_PLACE = 6.0  # m, from the end of the drive to the middle of a U-turn


def section(scenario: DriveScenario, length: float) -> StreetSection:
    """Make the StreetSection of a street wide enough for the lanes of a DriveScenario's passes.

    Parameters
    ----------
    scenario : DriveScenario
    length : float
        Of the drive along the line. Units: m.
    """
    lateral = max(abs(lane.lateral) for lane in scenario.passes)
    ends = {"forward": length + TURN_PLACE, "back": -TURN_PLACE}
    if scenario.u_turn:
        turns = {ends[lane.direction] for lane in scenario.passes}
    else:
        turns = ()
    return StreetSection(max(StreetSection.road, lateral + LANE_EDGE), tuple(sorted(turns)))


FRONTS = HouseRow(width=(8.0, 14.0), gap=(2.0, 5.0), setback=(0.0, 0.4))  # m
CARS = Furniture(across=-0.05, extent=2.3)  # m; half on the pavement
LAMPS = Furniture(across=0.3, extent=0.2)  # m
TREES = Furniture(across=0.7, extent=0.3)  # m
CROWN = (1.7, 1.1, 1.6)  # m, half axes of a crown: trimmed toward the houses
CAR_LIFT = 0.05  # m, of a car that is parked with two wheels on the pavement
FREE_ENDS = 4.0  # m, without furniture at the ends of the scene
POST_PLACES = (0.6, 1.1)  # m, from the curb to a target's post
ROAD_PLACES = (0.5, 0.73)  # share of half the road: targets between the wheel tracks
ROAD_EDGE = 0.05  # m, between a target and the middle or the edge of the road
ON_FRONTS = TargetHeight(least=1.2, below=0.3, span=1.0)  # m
ON_POSTS = TargetHeight(least=1.0, below=0.2, span=1.2)  # m


@dataclass(frozen=True)
class _House:
    side: int  # -1 left, 1 right
    start: float  # m along the center line
    end: float
    near: np.ndarray  # (3,) lower corners of the front, at the pavement's level
    far: np.ndarray
    lateral: float  # m of the front's nearest part from the center line


class Street:
    """Objects along a street; `spot` finds positions for targets, `furniture` makes the rest."""

    def __init__(self, scenario: Scenario, line: CentreLine, length, rng):
        self.scenario = scenario.scene
        self.line = line
        self.length = length
        self.section = section(scenario.drive, length)
        self._front_rng, self._house_rng, self._furniture_rng = rng.spawn(3)

    @cached_property
    def houses(self) -> list:
        """Straight house fronts along both sides, with gaps after some of them."""
        rng = self._front_rng
        houses = []
        for side in (-1, 1):
            s = -SETTINGS.margin
            while s < self.length + SETTINGS.margin - FRONTS.width[1]:
                width = rng.uniform(*FRONTS.width)
                front = self._front(side, s, s + width, rng.uniform(*FRONTS.setback))
                if self._is_clear(front):
                    houses.append(front)
                step = width
                gap = rng.uniform(*FRONTS.gap)
                if rng.random() < self.scenario.gaps:
                    step += gap
                s += step
        return houses

    def _front(self, side, start, end, setback):
        """Front whose middle is off the pavement even where the street bends."""
        s = np.linspace(start, end, 5)
        lateral = side * (self.section.half_width(s).max() + self.section.pavement + setback)
        corners = self.line.place(s, lateral, self.section.kerb)
        chord = corners[0] + np.linspace(0, 1, 5)[:, None] * (corners[-1] - corners[0])
        _, _, right = self.line.frame(s)
        bulge = side * np.einsum("ij,ij->i", corners - chord, right)
        lateral += side * max(0.0, bulge.max())
        near, far = self.line.place(s[[0, -1]], lateral, self.section.kerb)
        return _House(side, start, end, near, far, abs(lateral))

    def _is_clear(self, front):
        """True if no other part of the way passes through a house."""
        steps = np.linspace(0.0, 1.0, 5)[:, None]
        points = front.near + steps * (front.far - front.near)
        inward = unit(front.side * np.cross(front.far - front.near, UP))
        middle = points + HOUSE.depth / 2 * inward
        points = np.concatenate([points, middle, points + HOUSE.depth * inward])
        clear_width = self.section.road + self.section.pavement - self.section.clearance
        return (self.line.distance(points) > clear_width).all()

    @cached_property
    def mesh(self) -> Mesh:
        """Ground and houses."""
        rng = self._house_rng
        low_high = self.scenario.house_height
        pieces = [self._ground()]
        if self.scenario.markings:
            pieces += self._markings()
        for front in self.houses:
            inward = unit(front.side * np.cross(front.far - front.near, UP))
            height = rng.uniform(*low_high)
            reflectance = rng.uniform(*HOUSE.reflectance)
            pieces.append(house(front.near, front.far, inward, height, reflectance))
        return Mesh.concatenate(pieces)

    def _ground(self):
        """Carriageway with crown, curbs, pavements and gardens, as strips of 1 m."""
        s = np.arange(-SETTINGS.margin, self.length + SETTINGS.margin)
        edge = self.section.half_width(s)
        fence = edge + self.section.pavement
        garden = fence + self.section.garden
        kerb = np.full_like(s, self.section.kerb)
        flat = np.zeros_like(s)
        rows = [  # from left to right: position, height, reflectance up to the next
            (-garden, kerb, self.section.lawn),
            (-fence, kerb, self.section.paving),
            (-edge, kerb, self.section.kerbstone),
            (-edge, flat, self.section.asphalt),
            (flat, self.section.height(s, flat), self.section.asphalt),
            (edge, flat, self.section.kerbstone),
            (edge, kerb, self.section.paving),
            (fence, kerb, self.section.lawn),
            (garden, kerb, None),
        ]
        strips = []
        for (x, z, reflectance), (next_x, next_z, _) in pairwise(rows):
            left = self.line.place(s, x, z)
            right = self.line.place(s, next_x, next_z)
            owned = self._owns(s[:-1], (left[:-1] + right[1:]) / 2, (x + next_x)[:-1] / 2)
            quad = (left[:-1], right[:-1], right[1:], left[1:])
            strips.append(four_corners(*(c[owned] for c in quad), reflectance))
        return Mesh.concatenate(strips)

    def _markings(self):
        """Paint on the carriageway: a dashed middle line, and a line along each curb."""
        s = np.arange(-SETTINGS.margin, self.length + SETTINGS.margin)
        edge = self.section.half_width(s) - self.section.line_from_kerb
        half = self.section.line / 2
        up = self.section.paint
        dash, between = self.section.dash
        for middle, gap in ((np.zeros_like(s), between), (-edge, 0.0), (edge, 0.0)):
            left, right = (
                self.line.place(s, x, self.section.height(s, x) + up)
                for x in (middle - half, middle + half)
            )
            painted = self._owns(s[:-1], (left[:-1] + right[1:]) / 2, middle[:-1])
            painted &= s[:-1] % (dash + gap) < dash
            quad = (left[:-1], right[:-1], right[1:], left[1:])
            yield four_corners(*(corner[painted] for corner in quad), self.section.white_line)

    def _owns(self, s, middle, lateral):
        """Flag of ground quads that belong to their part of the way, where it crosses itself.

        Of two carriageways, the earlier one is kept; both replace pavements and gardens.
        """
        on_road = np.abs(lateral) < self.section.half_width(s)
        earlier = self.line.distance_to_other_parts(middle, s, earlier=True)
        other = np.where(on_road, earlier, self.line.distance_to_other_parts(middle, s))
        folded = self.line.distance(middle) < np.abs(lateral) - self.section.clearance
        return (other > self.section.road) & ~folded

    def spot(
        self, s: float, side: int, support: str, half: float, rng: Generator
    ) -> TargetSpot | None:
        """Find a TargetSpot for a target of a half extent (m), or None if there is none.

        Parameters
        ----------
        s : float
            Along the line. Units: m.
        side : int
            -1 left, 1 right.
        support : str
            Support of the target: post, wall or road.
        half : float
            From the center to the edge of the target. Units: m.
        rng : Generator
        """
        spot: Any = None
        if support == "wall":
            spot = self._on_wall(s, side, half, rng)
        if support == "road":
            spot = self._on_road(s, side, half, rng)
        if support == "post" or (spot is None and support == "wall"):
            spot = self._on_post(s, side, half, rng)
        if self.line.distance(spot.centre) < abs(spot.lateral) - self.section.clearance:
            return None  # in another part of the way
        other = self.line.distance_to_other_parts(spot.centre[None], np.array([s]))[0]
        if other > self.section.road + half and self._is_seen(spot):
            return spot
        return None

    def _is_seen(self, spot):
        """True if no house of another part of the way is between the drive and a target."""
        eye = eyes(self.line, spot.s)
        return sees(self.mesh.caster, eye, np.broadcast_to(spot.centre, eye.shape)).all()

    def _on_wall(self, s, side, half, rng):
        """Find a position on a house front; None if no front is long enough."""
        margin = half + WALL_ENDS
        fronts = (front for front in self.houses if front.side == side)
        front = next((f for f in fronts if f.start + margin < s < f.end - margin), None)
        if front is None:
            return None
        u = (front.far - front.near) * [1.0, 1.0, 0.0]
        u *= -side / np.linalg.norm(u)  # so that u x UP points to the street
        share = (s - front.start) / (front.end - front.start)
        foot = front.near + share * (front.far - front.near)
        centre = foot + ON_FRONTS.draw(half, rng) * UP + ON_WALL * np.cross(u, UP)
        return TargetSpot("wall", s, side * front.lateral, centre, u, UP, foot[2])

    def _on_post(self, s, side, half, rng):
        """Find a position on a post on the pavement, facing the street."""
        _, forward, _ = self.line.frame(s)
        u = -side * (forward - forward[2] * UP) / np.linalg.norm(forward[:2])
        edge = float(self.section.half_width(s))
        lateral = side * (edge + rng.uniform(*POST_PLACES))
        foot = self.line.place(s, lateral, self.section.kerb)
        centre = foot + ON_POSTS.draw(half, rng) * UP
        return TargetSpot("post", s, lateral, centre, u, UP, foot[2])

    def _on_road(self, s, side, half, rng):
        """Find a position just above the carriageway, in its plane."""
        edge = float(self.section.half_width(s))
        margin = np.sqrt(2) * half + ROAD_EDGE
        low = max(ROAD_PLACES[0] * edge, margin)
        high = min(ROAD_PLACES[1] * edge, edge - margin)
        lateral = side * rng.uniform(min(low, high), max(low, high))
        steps = np.array([-0.2, 0.2])
        along = self.line.place(s + steps, lateral, self.section.height(s + steps, lateral))
        across = self.line.place(s, lateral + steps, self.section.height(s, lateral + steps))
        forward = unit(along[1] - along[0])
        normal = unit(np.cross(across[1] - across[0], forward))
        right = np.cross(forward, normal)
        spin = rng.uniform(0.0, np.pi / 2)
        u = np.cos(spin) * right + np.sin(spin) * forward
        centre = along.mean(axis=0) + ON_GROUND * normal
        return TargetSpot("road", s, lateral, centre, u, np.cross(normal, u), centre[2])

    def furniture(self, placed: Placed) -> Mesh:
        """Make the mesh of parked cars, lamps and trees that do not hide targets or block the way.

        Parameters
        ----------
        placed : Placed
            The targets.
        """
        taken: list[tuple[float, int, float]] = []
        pieces = [placed.posts]
        kinds = (
            (self.scenario.cars, CARS, self._car),
            (self.scenario.poles, LAMPS, self._lamp),
            (self.scenario.trees, TREES, self._tree),
        )
        streams = self._furniture_rng.spawn(len(kinds))
        for (density, kind, make), rng in zip(kinds, streams, strict=True):

            def is_free(s, side, kind=kind):
                crowded = any(side == b and abs(s - a) < kind.extent + c for a, b, c in taken)
                lateral = side * (float(self.section.half_width(s)) + kind.across)
                return not crowded and self._has_room(s, lateral, kind.extent, placed)

            start = -SETTINGS.margin + FREE_ENDS
            end = self.length + SETTINGS.margin - FREE_ENDS
            for s, side in scatter(density, start, end, is_free, rng):
                taken.append((s, side, kind.extent))
                lateral = side * (float(self.section.half_width(s)) + kind.across)
                pieces.append(make(s, side, lateral, rng))
        return Mesh.concatenate(pieces)

    def _has_room(self, s, lateral, extent, placed):
        """True if an object may be placed there: not in front of a target, on another way or in
        a U-turn.
        """
        place = self.line.place(s, lateral, 0.0)
        on_roadway = self.line.distance(place) < abs(lateral) - self.section.clearance
        in_a_turn = extent > 1.0 and self.section.half_width(s) > self.section.road
        return not (on_roadway or in_a_turn or placed.obstructs(s, lateral, extent))

    def _lamp(self, s, side, lateral, rng):
        _, _, right = self.line.frame(s)
        return lamp(self.line.place(s, lateral, self.section.kerb), -side * right)

    def _tree(self, s, side, lateral, rng):
        _, forward, _ = self.line.frame(s)
        forward = (forward - forward[2] * UP) / np.linalg.norm(forward[:2])
        foot = self.line.place(s, lateral, self.section.kerb)
        return tree(foot, forward, np.array(CROWN), rng)

    def _car(self, s, side, lateral, rng):
        """Car parked half on the pavement."""
        _, forward, right = self.line.frame(s)
        place = self.line.place(s, lateral, CAR_LIFT)
        return car(place, forward, right, rng.uniform(*CAR.reflectance))
