"""Right bank of a river seen from a boat: quay walls, grass slopes, steps, a promenade, houses.

The cross-section is defined first. Water gives no returns at these wavelengths except straight
below, so it has no triangles.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.random import Generator

from mlscorr.simulate.scenario import Scenario
from mlscorr.simulate.scene._dimensions import (
    BUSH,
    CAR,
    HOUSE,
    ON_GROUND,
    ON_WALL,
    WALL_ENDS,
    Furniture,
    HouseRow,
    TargetHeight,
)
from mlscorr.simulate.scene._things import car, house, lamp, leaves, tree
from mlscorr.simulate.scene.centre_line import CentreLine
from mlscorr.simulate.scene.placing import Placed, TargetSpot, scatter
from mlscorr.simulate.scene.shapes import UP, Mesh, box, four_corners, unit
from mlscorr.simulate.settings import SETTINGS


@dataclass(frozen=True)
class Bank:
    """Cross-section of a bank.

    Parameters
    ----------
    shore, meander : float
        From the boat's line to the water's edge, and its swing. Units: m.
    top : float
        Height of the promenade above the water. Units: m.
    slope : float
        Width of a bank that rises to the promenade, by 22 deg. Units: m.
    promenade, fronts, beyond : float
        Inland of the shore: edges of the promenade, of the house fronts, of all. Units: m.
    step, tread : float
        Of steps that end where the slope does. Units: m.
    meander_length : float
        Of a radian of the shore's swing. Units: m.
    depth : float
        Of quays and walls below the water. Units: m.
    rise : float
        Of the ground beyond the promenade. Units: m.
    foreshore : tuple of float
        Place and height of a slope's lower end, under water. Units: m.
    wall_front, walls, wall_width, parapet : float
        Of the walls between two reaches: how far they reach into the water and beyond a slope's
        upper edge, their width, and their height above the promenade. Units: m.
    quay_wall, quay_top, stones, grass, stairs, paving, wall : float
        Reflectance: of a quay's front, of its top, of a slope's foot, of the slope, of steps, of
        the promenade, of walls between them.
    quays, stairways : tuple of float
        Length of a reach of quay or slope, and of steps between two of them. Units: m.
    """

    shore: float = 14.0
    meander: float = 2.0
    top: float = 3.0
    slope: float = 7.5
    promenade: float = 9.0
    fronts: float = 12.0
    beyond: float = 30.0
    step: float = 0.15
    tread: float = 0.375
    meander_length: float = 45.0
    depth: float = 1.0
    rise: float = 0.4
    foreshore: tuple[float, float] = (-1.5, -0.6)
    wall_front: float = 0.2
    walls: float = 0.5
    wall_width: float = 0.3
    parapet: float = 0.3
    quay_wall: float = 0.35
    quay_top: float = 0.3
    stones: float = 0.5
    grass: float = 0.3
    stairs: float = 0.4
    paving: float = 0.45
    wall: float = 0.35
    quays: tuple[float, float] = (40.0, 70.0)
    stairways: tuple[float, float] = (8.0, 14.0)

    def profile(self, kind: str) -> list[tuple[float, float, float]]:
        """Return columns inland and above the water (m), with the reflectance to the next.

        Parameters
        ----------
        kind : str
            quay, slope or steps.
        """
        inland = [(self.promenade, self.top, self.paving), (self.beyond, self.top + self.rise, 0.0)]
        if kind == "quay":
            quay = [(0.0, -self.depth, self.quay_wall), (0.0, self.top, self.quay_top)]
            return quay + inland
        if kind == "slope":
            return [(*self.foreshore, self.stones), (self.slope, self.top, self.grass), *inland]
        steps = range(1 + round(self.top / self.step))
        stairs = [(i * self.tread, z * self.step, self.stairs) for i in steps for z in (i - 1, i)]
        return stairs + inland

    def height(self, kind: str, inland: float | np.ndarray) -> np.ndarray:
        """Return the height (...) of a profile, inland of its steepest parts. Units: m.

        Parameters
        ----------
        kind : str
            quay, slope or steps.
        inland : (...) array
            Of the shore. Units: m.
        """
        x, z, _ = np.array(self.profile(kind)).T
        return np.interp(inland, x, z)


FRONTS = HouseRow(width=(12.0, 20.0), gap=(3.0, 10.0), setback=(0.0, 6.0))  # m
WIDE_GAP = 25.0  # m, added to some gaps between houses
LAMPS = Furniture(across=1.2, extent=0.2)  # m
TREES = Furniture(across=5.0, extent=0.3)  # m
CARS = Furniture(across=10.5, extent=2.3)  # m
BUSHES = Furniture(across=4.0, extent=1.0)  # m; only on slopes
BUSH_DENSITY = 6.0  # per 100 m
CROWN = (2.4, 2.4, 2.2)  # m, half axes of a tree's crown
SLOPE_TREE = 1.0  # m, of a tree behind the upper edge of a slope
FREE_ENDS = 3.0  # m, without furniture at the ends of the scene
KIND_ENDS = 0.3  # m, between furniture and the end of its reach
ABOVE_STEPS = 8.0  # m inland, from which steps have room for furniture
ON_FRONTS = TargetHeight(least=1.4, below=0.4, span=0.8)  # m
ON_POSTS = TargetHeight(least=1.0, below=0.2, span=1.0)  # m
POSTS = {"quay": (0.4, 1.0), "slope": (2.0, 6.0), "steps": (8.2, 8.8)}  # m inland
ON_QUAY = (0.4, 0.3)  # m, from a target down to the water and up to the promenade
SLOPE_EDGE = 0.3  # m, from a target to a slope's edges
SHORE_EDGE = 0.5  # m, more, from a target to the water's edge
STEPS_RAISE = 0.6  # m, of targets above steps, so that these hide nothing of them
TARGET_ENDS = 0.6  # m, between a target and the end of its reach


@dataclass(frozen=True)
class _Section:
    """Interval of the shore of one kind, from start to end (m along the boat's line)."""

    kind: str
    start: float
    end: float


class River:
    """Objects along a bank; `spot` finds positions for targets, `furniture` makes the rest."""

    bank = Bank()

    def __init__(self, scenario: Scenario, line: CentreLine, length, rng):
        self.scenario = scenario.scene
        self.line = line
        self.length = length
        self._shore_rng, self._house_rng, self._furniture_rng = rng.spawn(3)

    @cached_property
    def _phase(self):
        return self._shore_rng.uniform(0.0, 2 * np.pi)

    def shore(self, s: float | np.ndarray) -> np.ndarray:
        """Return the distance (...) of the water's edge to the right of the boat's line. Units: m.

        Parameters
        ----------
        s : (...) array
            Length along the line. Units: m.
        """
        return self.bank.shore + self.bank.meander * np.sin(
            np.asarray(s) / self.bank.meander_length + self._phase
        )

    def place(
        self, s: float | np.ndarray, inland: float | np.ndarray, height: float | np.ndarray
    ) -> np.ndarray:
        """Return points (..., 3) by distance inland of the shore and height above the water.

        Parameters
        ----------
        s : (...) array
            Length along the line. Units: m.
        inland : (...) array
            Of the shore. Units: m.
        height : (...) array
            Above the water. Units: m.
        """
        return self.line.place(s, self.shore(s) + inland, height)

    @cached_property
    def sections(self) -> list:
        """Alternating quay walls and slopes, with steps between some of them."""
        sections = []
        s = -SETTINGS.margin
        i = int(self._phase > np.pi)
        while s < self.length + SETTINGS.margin:
            for kind in (("quay", "slope")[i % 2], "steps"):
                lengths = self.bank.stairways if kind == "steps" else self.bank.quays
                length = self._shore_rng.uniform(*lengths)
                end = min(s + length, self.length + SETTINGS.margin)
                if end - s > 1.0:
                    sections.append(_Section(kind, s, end))
                    s = end
                else:
                    s = self.length + SETTINGS.margin
            i += 1
        return sections

    @cached_property
    def houses(self) -> np.ndarray:
        """Starts and ends (m along the line), setback (m) and height (m) of houses: (n, 4)."""
        rng = self._house_rng
        rows = []
        s = -SETTINGS.margin
        heights = self.scenario.house_height
        while s < self.length + SETTINGS.margin - FRONTS.width[1]:
            width = rng.uniform(*FRONTS.width)
            setback = rng.uniform(*FRONTS.setback)
            height = rng.uniform(*heights)
            rows.append((s, s + width, setback, height))
            s += width + rng.uniform(*FRONTS.gap) + WIDE_GAP * (rng.random() < self.scenario.gaps)
        return np.array(rows).reshape(-1, 4)

    def _front(self, row):
        """Lower corners (2, 3) of a house's front."""
        return self.place(
            row[:2], self.bank.fronts + row[2], self.bank.height("quay", self.bank.fronts + row[2])
        )

    @cached_property
    def mesh(self) -> Mesh:
        """Banks, walls between them, and houses."""
        pieces = [self._bank(section) for section in self.sections]
        pieces += [self._cross_wall(section.start) for section in self.sections[1:]]
        for row in self.houses:
            near, far = self._front(row)
            inward = unit(np.cross(far - near, UP))
            reflectance = self._house_rng.uniform(*HOUSE.reflectance)
            pieces.append(house(near, far, inward, row[3], reflectance))
        return Mesh.concatenate(pieces)

    def _bank(self, section):
        """Profile of an interval along the shore, in strips of at most 2 m."""
        s = np.linspace(section.start, section.end, 2 + int((section.end - section.start) / 2.0))
        strips = []
        for (x, z, reflectance), (next_x, next_z, _) in pairwise(self.bank.profile(section.kind)):
            near = self.place(s, x, z)
            far = self.place(s, next_x, next_z)
            strips.append(four_corners(near[:-1], near[1:], far[1:], far[:-1], reflectance))
        return Mesh.concatenate(strips)

    def _cross_wall(self, s):
        """Wall with a parapet, from the water up to the promenade."""
        bank = self.bank
        half = bank.wall_width / 2
        corner = self.place(s - half, -bank.wall_front, -bank.depth)
        inland = self.place(s - half, bank.slope + bank.walls, -bank.depth) - corner
        along = self.place(s + half, -bank.wall_front, -bank.depth) - corner
        height = bank.top + bank.depth + bank.parapet
        return box(corner, inland, along, height * UP, bank.wall)

    def _kind_at(self, s, margin):
        """Kind of the interval that contains s with a margin (m) on both sides, or None."""
        holding = (r.kind for r in self.sections if r.start + margin < s < r.end - margin)
        return next(holding, None)

    def spot(
        self, s: float, side: int, support: str, half: float, rng: Generator
    ) -> TargetSpot | None:
        """Find a TargetSpot for a target of a half extent (m), or None if there is none.

        It is always on the right bank; `road` means on the slope; a post is used if there is no
        other position.

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
        margin = half + TARGET_ENDS
        kind = self._kind_at(s, margin)
        shadow = self.bank.slope if kind == "slope" else 0.0  # of the walls at a slope's ends
        if kind is None or self._kind_at(s, margin + shadow) is None:
            return None
        if support == "wall":
            quay = self._on_quay(s, half, rng) if kind == "quay" else None
            choices = [spot for spot in (self._on_house(s, half, rng), quay) if spot is not None]
            if choices:
                return choices[rng.integers(len(choices))]
        if support == "road" and kind == "slope":
            return self._on_slope(s, half, rng)
        return self._on_post(s, kind, half, rng)

    def _facing(self, s):
        """Horizontal unit vector (3,) along the shore, with minus it x UP toward the water."""
        ends = self.place(np.array([s - 0.2, s + 0.2]), 0.0, 0.0)
        return unit(ends[1] - ends[0])

    def _on_house(self, s, half, rng):
        """Find a position on a house front."""
        margin = half + WALL_ENDS
        row = next((row for row in self.houses if row[0] + margin < s < row[1] - margin), None)
        if row is None:
            return None
        near, far = self._front(row)
        u = -unit(far - near)
        foot = near + (s - row[0]) / (row[1] - row[0]) * (far - near)
        centre = foot + ON_FRONTS.draw(half, rng) * UP + ON_WALL * np.cross(u, UP)
        return TargetSpot(
            "wall", s, self.shore(s) + self.bank.fronts + row[2], centre, u, UP, foot[2]
        )

    def _on_quay(self, s, half, rng):
        """Find a position on the quay wall."""
        u = -self._facing(s)
        low = half + ON_QUAY[0]
        high = self.bank.top - half - ON_QUAY[1]
        centre = self.place(s, 0.0, rng.uniform(low, high)) + ON_WALL * np.cross(u, UP)
        return TargetSpot("wall", s, float(self.shore(s)), centre, u, UP, -0.5)

    def _on_post(self, s, kind, half, rng):
        """Find a position on a post behind the quay's edge, on the slope, or above the steps."""
        inland = rng.uniform(*POSTS[kind])
        foot = self.place(s, inland, self.bank.height(kind, inland))
        extra_height = STEPS_RAISE if kind == "steps" else 0.0
        centre = foot + ON_POSTS.draw(half, rng, extra_height) * UP
        lateral = float(self.shore(s) + inland)
        return TargetSpot("post", s, lateral, centre, -self._facing(s), UP, foot[2])

    def _on_slope(self, s, half, rng):
        """Find a position just above the slope, in its plane."""
        margin = half + SLOPE_EDGE
        inland = rng.uniform(margin + SHORE_EDGE, self.bank.slope - margin)
        steps = np.array([-0.2, 0.2])
        along = self.place(s + steps, inland, self.bank.height("slope", inland))
        up = self.place(s, inland + steps, self.bank.height("slope", inland + steps))
        u = -unit(along[1] - along[0])
        normal = unit(np.cross(u, up[1] - up[0]))
        centre = along.mean(axis=0) + ON_GROUND * normal
        lateral = float(self.shore(s) + inland)
        return TargetSpot("road", s, lateral, centre, u, np.cross(normal, u), centre[2])

    def furniture(self, placed: Placed) -> Mesh:
        """Make the mesh of lamps, trees, parked cars and bushes that do not hide targets.

        Parameters
        ----------
        placed : Placed
            The targets.
        """
        pieces = [placed.posts]
        streams = self._furniture_rng.spawn(4)
        kinds = (
            (self.scenario.poles, LAMPS, self._lamp),
            (self.scenario.trees, TREES, self._tree),
            (self.scenario.cars, CARS, self._car),
            (BUSH_DENSITY, BUSHES, self._bush),
        )
        for (density, thing, make), rng in zip(kinds, streams, strict=True):

            def is_free(s, _, thing=thing):
                kind = self._kind_at(s, thing.extent + KIND_ENDS)
                if thing is BUSHES:
                    right_place = kind == "slope"
                else:
                    right_place = kind is not None
                on_steps = kind == "steps" and thing.across < ABOVE_STEPS
                hides = placed.obstructs(s, float(self.shore(s)) + thing.across, thing.extent)
                return right_place and not on_steps and not hides

            start = -SETTINGS.margin + FREE_ENDS
            end = self.length + SETTINGS.margin - FREE_ENDS
            for s, _ in scatter(density, start, end, is_free, rng):
                pieces.append(make(s, thing.across, rng))
        return Mesh.concatenate(pieces)

    def _foot(self, s, inland):
        return self.place(s, inland, self.bank.height(self._kind_at(s, 0.0) or "quay", inland))

    def _lamp(self, s, inland, rng):
        if self._kind_at(s, 0.0) != "quay":
            inland = self.bank.slope + inland
        return lamp(self._foot(s, inland), np.cross(self._facing(s), UP))

    def _tree(self, s, inland, rng):
        if self._kind_at(s, 0.0) != "quay":
            inland = self.bank.slope + SLOPE_TREE
        return tree(self._foot(s, inland), self._facing(s), np.array(CROWN), rng)

    def _car(self, s, inland, rng):
        along = self._facing(s)
        right = np.cross(along, UP)
        return car(self._foot(s, inland), along, right, rng.uniform(*CAR.reflectance))

    def _bush(self, s, inland, rng):
        size = rng.uniform(*BUSH.size)
        foot = self._foot(s, inland + rng.uniform(-BUSH.scatter, BUSH.scatter))
        axes = size * np.array(BUSH.axes)
        middle = foot + BUSH.height * size * UP
        return leaves(middle, axes, self._facing(s), int(BUSH.leaves * size), rng)
