"""A river's right bank as a boat sees it: quay walls, grass slopes, steps, a promenade, houses.

Water returns nothing at these wavelengths but straight below, so it has no triangles.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.random import Generator

from mlscorr.simulate.scenario import Scenario
from mlscorr.simulate.scene._bank import Bank
from mlscorr.simulate.scene._things import car, house, lamp, leaves, tree
from mlscorr.simulate.scene.centre_line import CentreLine
from mlscorr.simulate.scene.placing import Placed, TargetSpot, scatter
from mlscorr.simulate.scene.shapes import UP, Mesh, box, four_corners, unit
from mlscorr.simulate.settings import SETTINGS


@dataclass(frozen=True)
class _Stretch:
    """A stretch of the shore of one kind, from start to end (m along the boat's line)."""

    kind: str
    start: float
    end: float


class River:
    """What stands along a bank; `spot` finds places for targets, `furniture` the rest."""

    bank = Bank()
    bushes = 6.0  # on a slope, per 100 m

    def __init__(self, scenario: Scenario, line: CentreLine, length, rng):
        self.scenario = scenario.scene
        self.line = line
        self.length = length
        self._shore_rng, self._house_rng, self._furniture_rng = rng.spawn(3)

    @cached_property
    def _phase(self):
        return self._shore_rng.uniform(0.0, 2 * np.pi)

    def shore(self, s: float | np.ndarray) -> np.ndarray:
        """Distance (...) of the water's edge to the right of the boat's line. Units: m.

        Parameters
        ----------
        s : (...) array
            Length along the line. Units: m.
        """
        return self.bank.shore + self.bank.meander * np.sin(np.asarray(s) / 45.0 + self._phase)

    def place(
        self, s: float | np.ndarray, inland: float | np.ndarray, height: float | np.ndarray
    ) -> np.ndarray:
        """Points (..., 3) by their distance inland of the shore and height above the water.

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
    def stretches(self) -> list:
        """Quay walls and slopes in turn, with steps between some of them."""
        stretches = []
        s = -SETTINGS.margin
        i = int(self._phase > np.pi)
        while s < self.length + SETTINGS.margin:
            for kind in (("quay", "slope")[i % 2], "steps"):
                shortest, longest = (8.0, 14.0) if kind == "steps" else (40.0, 70.0)
                length = self._shore_rng.uniform(shortest, longest)
                end = min(s + length, self.length + SETTINGS.margin)
                if end - s > 1.0:
                    stretches.append(_Stretch(kind, s, end))
                    s = end
                else:
                    s = self.length + SETTINGS.margin
            i += 1
        return stretches

    @cached_property
    def houses(self) -> np.ndarray:
        """Starts and ends (m along the line), setback (m) and height (m) of houses: (n, 4)."""
        rng = self._house_rng
        rows = []
        s = -SETTINGS.margin
        heights = self.scenario.house_height
        while s < self.length + SETTINGS.margin - 20.0:
            width = rng.uniform(12.0, 20.0)
            setback = rng.uniform(0, self.bank.setback)
            height = rng.uniform(*heights)
            rows.append((s, s + width, setback, height))
            s += width + rng.uniform(3.0, 10.0) + 25.0 * (rng.random() < self.scenario.gaps)
        return np.array(rows).reshape(-1, 4)

    def _front(self, row):
        """Lower corners (2, 3) of a house's front."""
        return self.place(
            row[:2], self.bank.fronts + row[2], self.bank.height("quay", self.bank.fronts + row[2])
        )

    @cached_property
    def mesh(self) -> Mesh:
        """Banks, walls between them, and houses."""
        pieces = [self._bank(stretch) for stretch in self.stretches]
        pieces += [self._cross_wall(stretch.start) for stretch in self.stretches[1:]]
        for row in self.houses:
            near, far = self._front(row)
            inward = unit(np.cross(far - near, UP))
            pieces.append(house(near, far, inward, row[3], self._house_rng.uniform(0.2, 0.5)))
        return Mesh.concatenate(pieces)

    def _bank(self, stretch):
        """A reach's profile drawn along the shore, in strips of 2 m at most."""
        s = np.linspace(stretch.start, stretch.end, 2 + int((stretch.end - stretch.start) / 2.0))
        strips = []
        for (x, z, reflectance), (next_x, next_z, _) in pairwise(self.bank.profile(stretch.kind)):
            near = self.place(s, x, z)
            far = self.place(s, next_x, next_z)
            strips.append(four_corners(near[:-1], near[1:], far[1:], far[:-1], reflectance))
        return Mesh.concatenate(strips)

    def _cross_wall(self, s):
        """A wall with a parapet, from the water up to the promenade."""
        corner = self.place(s - 0.15, -0.2, -1.0)
        inland = self.place(s - 0.15, self.bank.slope + 0.5, -1.0) - corner
        along = self.place(s + 0.15, -0.2, -1.0) - corner
        return box(corner, inland, along, (self.bank.top + 1.3) * UP, 0.35)

    def _kind_at(self, s, margin):
        """Kind of the reach that holds s with a margin (m) to both sides, or None."""
        holding = (r.kind for r in self.stretches if r.start + margin < s < r.end - margin)
        return next(holding, None)

    def spot(
        self, s: float, side: int, support: str, half: float, rng: Generator
    ) -> TargetSpot | None:
        """TargetSpot for a target of a half extent (m), or None where none is free.

        Always on the right bank; `road` lies on the slope; what has no place stands on a post.

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
        kind = self._kind_at(s, half + 0.6)
        shadow = self.bank.slope if kind == "slope" else 0.0  # of the walls at a slope's ends
        if kind is None or self._kind_at(s, half + 0.6 + shadow) is None:
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
        """Horizontal unit vector (3,) along the shore, with minus it x UP towards the water."""
        ends = self.place(np.array([s - 0.2, s + 0.2]), 0.0, 0.0)
        return unit(ends[1] - ends[0])

    def _on_house(self, s, half, rng):
        """On a house front, 2 cm before it."""
        margin = half + 0.4
        row = next((row for row in self.houses if row[0] + margin < s < row[1] - margin), None)
        if row is None:
            return None
        near, far = self._front(row)
        u = -unit(far - near)
        foot = near + (s - row[0]) / (row[1] - row[0]) * (far - near)
        low = max(1.4, half + 0.4)
        centre = foot + rng.uniform(low, low + 0.8) * UP + 0.02 * np.cross(u, UP)
        return TargetSpot(
            "wall", s, self.shore(s) + self.bank.fronts + row[2], centre, u, UP, foot[2]
        )

    def _on_quay(self, s, half, rng):
        """On the quay wall, 2 cm before it."""
        u = -self._facing(s)
        low = half + 0.4
        high = max(half + 0.5, self.bank.top - half - 0.3)
        centre = self.place(s, 0.0, rng.uniform(low, high)) + 0.02 * np.cross(u, UP)
        return TargetSpot("wall", s, float(self.shore(s)), centre, u, UP, -0.5)

    def _on_post(self, s, kind, half, rng):
        """On a post behind the quay's edge, on the slope, or above the steps."""
        low, high = {"quay": (0.4, 1.0), "slope": (2.0, 6.0), "steps": (8.2, 8.8)}[kind]
        inland = rng.uniform(low, high)
        foot = self.place(s, inland, self.bank.height(kind, inland))
        low = max(1.0, half + 0.2) + (0.6 if kind == "steps" else 0.0)
        centre = foot + rng.uniform(low, low + 1.0) * UP
        lateral = float(self.shore(s) + inland)
        return TargetSpot("post", s, lateral, centre, -self._facing(s), UP, foot[2])

    def _on_slope(self, s, half, rng):
        """1 cm above the slope, in its plane."""
        margin = half + 0.3
        inland = rng.uniform(margin + 0.5, max(margin + 0.6, self.bank.slope - margin))
        steps = np.array([-0.2, 0.2])
        along = self.place(s + steps, inland, self.bank.height("slope", inland))
        up = self.place(s, inland + steps, self.bank.height("slope", inland + steps))
        u = -unit(along[1] - along[0])
        normal = unit(np.cross(u, up[1] - up[0]))
        centre = along.mean(axis=0) + 0.01 * normal
        lateral = float(self.shore(s) + inland)
        return TargetSpot("road", s, lateral, centre, u, np.cross(normal, u), centre[2])

    def furniture(self, placed: Placed) -> Mesh:
        """Mesh of lamps, trees, parked cars and bushes that stand before no target.

        Parameters
        ----------
        placed : Placed
            The targets.
        """
        pieces = [placed.posts]
        streams = self._furniture_rng.spawn(4)
        kinds = (
            (self.scenario.poles, 1.2, 0.2, self._lamp),
            (self.scenario.trees, 5.0, 0.3, self._tree),
            (self.scenario.cars, 10.5, 2.3, self._car),
            (self.bushes, 4.0, 1.0, self._bush),
        )
        for (density, inland, extent, make), rng in zip(kinds, streams, strict=True):

            def is_free(s, _, inland=inland, extent=extent):
                kind = self._kind_at(s, extent + 0.3)
                if inland == 4.0:
                    right_place = kind == "slope"
                else:
                    right_place = kind is not None
                on_steps = kind == "steps" and inland < 8.0
                hides = placed.in_the_way(s, float(self.shore(s)) + inland, extent)
                return right_place and not on_steps and not hides

            start = -SETTINGS.margin + 3.0
            end = self.length + SETTINGS.margin - 3.0
            for s, _ in scatter(density, start, end, is_free, rng):
                pieces.append(make(s, inland, rng))
        return Mesh.concatenate(pieces)

    def _foot(self, s, inland):
        return self.place(s, inland, self.bank.height(self._kind_at(s, 0.0) or "quay", inland))

    def _lamp(self, s, inland, rng):
        if self._kind_at(s, 0.0) != "quay":
            inland = self.bank.slope + inland
        return lamp(self._foot(s, inland), np.cross(self._facing(s), UP))

    def _tree(self, s, inland, rng):
        if self._kind_at(s, 0.0) != "quay":
            inland = self.bank.slope + 1.0
        return tree(self._foot(s, inland), self._facing(s), np.array([2.4, 2.4, 2.2]), rng)

    def _car(self, s, inland, rng):
        along = self._facing(s)
        return car(self._foot(s, inland), along, np.cross(along, UP), rng.uniform(0.1, 0.5))

    def _bush(self, s, inland, rng):
        size = rng.uniform(0.5, 1.0)
        foot = self._foot(s, inland + rng.uniform(-2.0, 2.0))
        axes = size * np.array([1.2, 1.0, 0.8])
        return leaves(foot + 0.6 * size * UP, axes, self._facing(s), int(500 * size), rng)
