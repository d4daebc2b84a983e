"""A street: carriageway with crown, kerbs and pavements, houses with gaps, lamps, trees, cars."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.random import Generator

from mlscorr.simulate.scenario import Scenario
from mlscorr.simulate.scene._section import section
from mlscorr.simulate.scene._things import car, house, lamp, tree
from mlscorr.simulate.scene.centre_line import CentreLine
from mlscorr.simulate.scene.placing import Placed, TargetSpot, eyes, scatter
from mlscorr.simulate.scene.shapes import UP, Mesh, four_corners, sees, unit
from mlscorr.simulate.settings import SETTINGS


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
            while s < self.length + SETTINGS.margin - 14.0:
                width = rng.uniform(8.0, 14.0)
                front = self._front(side, s, s + width, rng.uniform(0.0, 0.4))
                if self._is_clear(front):
                    houses.append(front)
                gap = rng.uniform(2.0, 5.0)
                s += width + (gap if rng.random() < self.scenario.gaps else 0.0)
        return houses

    def _front(self, side, start, end, setback):
        """A front whose middle keeps off the pavement too where the street bends."""
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
        """Whether no other part of the way runs through a house."""
        steps = np.linspace(0.0, 1.0, 5)[:, None]
        points = front.near + steps * (front.far - front.near)
        inward = unit(front.side * np.cross(front.far - front.near, UP))
        points = np.concatenate([points, points + 4.0 * inward, points + 8.0 * inward])
        way = self.section.road + self.section.pavement - self.section.clearance
        return (self.line.distance(points) > way).all()

    @cached_property
    def mesh(self) -> Mesh:
        """Ground and houses."""
        rng = self._house_rng
        low_high = self.scenario.house_height
        pieces = [self._ground(), *(self._markings() if self.scenario.markings else ())]
        for front in self.houses:
            inward = unit(front.side * np.cross(front.far - front.near, UP))
            height = rng.uniform(*low_high)
            reflectance = rng.uniform(0.2, 0.5)
            pieces.append(house(front.near, front.far, inward, height, reflectance))
        return Mesh.concatenate(pieces)

    def _ground(self):
        """Carriageway with crown, kerbs, pavements and gardens, as strips of 1 m."""
        s = np.arange(-SETTINGS.margin, self.length + SETTINGS.margin)
        edge = self.section.half_width(s)
        fence = edge + self.section.pavement
        garden = fence + self.section.garden
        kerb = np.full_like(s, self.section.kerb)
        flat = np.zeros_like(s)
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
        reflectance = {"asphalt": 0.18, "kerb": 0.35, "pavement": 0.25, "garden": 0.3}
        strips = []
        for (x, z, surface), (next_x, next_z, _) in pairwise(rows):
            left = self.line.place(s, x, z)
            right = self.line.place(s, next_x, next_z)
            owned = self._owns(s[:-1], (left[:-1] + right[1:]) / 2, (x + next_x)[:-1] / 2)
            quad = (left[:-1], right[:-1], right[1:], left[1:])
            strips.append(four_corners(*(c[owned] for c in quad), reflectance[surface]))
        return Mesh.concatenate(strips)

    def _markings(self):
        """Paint on the carriageway: a dashed middle line, and a line along each kerb."""
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
            yield four_corners(*(corner[painted] for corner in quad), 0.6)

    def _owns(self, s, middle, lateral):
        """Which ground quads belong to their part of the way, where it crosses or repeats itself.

        Of two carriageways the earlier one stays; pavements and gardens give way to any.
        """
        on_road = np.abs(lateral) < self.section.half_width(s)
        earlier = self.line.distance_to_other_parts(middle, s, earlier=True)
        other = np.where(on_road, earlier, self.line.distance_to_other_parts(middle, s))
        folded = self.line.distance(middle) < np.abs(lateral) - self.section.clearance
        return (other > self.section.road) & ~folded

    def spot(
        self, s: float, side: int, support: str, half: float, rng: Generator
    ) -> TargetSpot | None:
        """TargetSpot for a target of a half extent (m), or None where none is free.

        Parameters
        ----------
        s : float
            Along the line. Units: m.
        side : int
            -1 left, 1 right.
        support : str
            What should carry the target: post, wall or road.
        half : float
            From the centre to the edge of the target. Units: m.
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
        """Whether no house of another part of the way stands between the drive and a target."""
        eye = eyes(self.line, spot.s)
        return sees(self.mesh.caster, eye, np.broadcast_to(spot.centre, eye.shape)).all()

    def _on_wall(self, s, side, half, rng):
        """On a house front, 2 cm before it; None where no front reaches far enough."""
        margin = half + 0.4
        fronts = (front for front in self.houses if front.side == side)
        front = next((f for f in fronts if f.start + margin < s < f.end - margin), None)
        if front is None:
            return None
        u = (front.far - front.near) * [1.0, 1.0, 0.0]
        u *= -side / np.linalg.norm(u)  # so that u x UP points to the street
        share = (s - front.start) / (front.end - front.start)
        foot = front.near + share * (front.far - front.near)
        low = max(1.2, half + 0.3)
        centre = foot + rng.uniform(low, low + 1.0) * UP + 0.02 * np.cross(u, UP)
        return TargetSpot("wall", s, side * front.lateral, centre, u, UP, foot[2])

    def _on_post(self, s, side, half, rng):
        """On a post on the pavement, facing the street."""
        _, forward, _ = self.line.frame(s)
        u = -side * (forward - forward[2] * UP) / np.linalg.norm(forward[:2])
        edge = float(self.section.half_width(s))
        farthest = max(0.7, min(1.1, self.section.pavement - 0.6 * half))
        lateral = side * (edge + rng.uniform(0.6, farthest))
        foot = self.line.place(s, lateral, self.section.kerb)
        low = max(1.0, half + 0.2)
        centre = foot + rng.uniform(low, low + 1.2) * UP
        return TargetSpot("post", s, lateral, centre, u, UP, foot[2])

    def _on_road(self, s, side, half, rng):
        """1 cm above the carriageway, turned in its plane."""
        edge = float(self.section.half_width(s))
        margin = np.sqrt(2) * half + 0.05
        low = max(0.5 * edge, margin)
        high = min(0.73 * edge, edge - margin)
        lateral = side * rng.uniform(min(low, high), max(low, high))
        steps = np.array([-0.2, 0.2])
        along = self.line.place(s + steps, lateral, self.section.height(s + steps, lateral))
        across = self.line.place(s, lateral + steps, self.section.height(s, lateral + steps))
        forward = unit(along[1] - along[0])
        normal = unit(np.cross(across[1] - across[0], forward))
        right = np.cross(forward, normal)
        spin = rng.uniform(0.0, np.pi / 2)
        u = np.cos(spin) * right + np.sin(spin) * forward
        centre = along.mean(axis=0) + 0.01 * normal
        return TargetSpot("road", s, lateral, centre, u, np.cross(normal, u), centre[2])

    def furniture(self, placed: Placed) -> Mesh:
        """Mesh of parked cars, lamps and trees that stand before no target and in no way.

        Parameters
        ----------
        placed : Placed
            The targets.
        """
        taken: list[tuple[float, int, float]] = []
        pieces = [placed.posts]
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

            start = -SETTINGS.margin + 4.0
            end = self.length + SETTINGS.margin - 4.0
            for s, side in scatter(density, start, end, is_free, rng):
                taken.append((s, side, extent))
                lateral = side * (float(self.section.half_width(s)) + from_kerb)
                pieces.append(make(s, side, lateral, rng))
        return Mesh.concatenate(pieces)

    def _has_room(self, s, lateral, extent, placed):
        """Whether a thing may stand there: before no target, in no other way, in no U-turn."""
        place = self.line.place(s, lateral, 0.0)
        in_a_way = self.line.distance(place) < abs(lateral) - self.section.clearance
        in_a_turn = extent > 1.0 and self.section.half_width(s) > self.section.road
        return not (in_a_way or in_a_turn or placed.in_the_way(s, lateral, extent))

    def _lamp(self, s, side, lateral, rng):
        _, _, right = self.line.frame(s)
        return lamp(self.line.place(s, lateral, self.section.kerb), -side * right)

    def _tree(self, s, side, lateral, rng):
        _, forward, _ = self.line.frame(s)
        forward = (forward - forward[2] * UP) / np.linalg.norm(forward[:2])
        crown = np.array([1.7, 1.1, 1.6])  # m: cut back on the side of the houses
        return tree(self.line.place(s, lateral, self.section.kerb), forward, crown, rng)

    def _car(self, s, side, lateral, rng):
        """Half on the pavement."""
        _, forward, right = self.line.frame(s)
        return car(self.line.place(s, lateral, 0.05), forward, right, rng.uniform(0.1, 0.5))
