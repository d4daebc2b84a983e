"""A river's right bank as a boat sees it: quay walls, grass slopes, steps, a promenade, houses.

Water returns nothing at these wavelengths but straight below, so it has no triangles.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from mlscorr.simulate.line import MARGIN, CentreLine
from mlscorr.simulate.placing import Spot, scatter
from mlscorr.simulate.scenario import Scenario
from mlscorr.simulate.shapes import UP, box, car, four_corners, house, join, lamp, leaves, tree

SHORE, MEANDER = 14.0, 2.0  # m from the boat's line to the water's edge, and its swing
TOP = 3.0  # m of the promenade above the water
SLOPE_WIDTH = 7.5  # m, of a bank that rises to the promenade by 22 deg
PROMENADE, HOUSES, BEYOND = 9.0, 12.0, 30.0  # m inland of the shore: edges of what lies there
SETBACK = 6.0  # m by which house fronts vary
STEP, TREAD = 0.15, 0.375  # m, of steps that end where the slope does
BUSHES = 6.0  # on a slope, per 100 m
CREST = 0.4  # m by which the ground rises behind the promenade
_INLAND = [(PROMENADE, TOP, 0.45), (BEYOND, TOP + CREST, 0.0)]
PROFILES = {  # inland of the shore and height above the water (m), reflectance to the next row
    "quay": [(0.0, -1.0, 0.35), (0.0, TOP, 0.3), *_INLAND],
    "slope": [(-1.5, -0.6, 0.5), (SLOPE_WIDTH, TOP, 0.3), *_INLAND],
    "steps": [
        *((i * TREAD, z * STEP, 0.4) for i in range(1 + round(TOP / STEP)) for z in (i - 1, i)),
        *_INLAND,
    ],
}
LENGTHS = {"quay": (40.0, 70.0), "slope": (40.0, 70.0), "steps": (8.0, 14.0)}  # m along the shore
CROWN_AXES = np.array([2.4, 2.4, 2.2])  # m of a tree in a park


@dataclass(frozen=True)
class _Reach:
    """A stretch of the shore of one kind, from start to end (m along the boat's line)."""

    kind: str
    start: float
    end: float


class River:
    """What stands along a bank; `spot` finds places for targets, `furniture` the rest."""

    def __init__(self, scenario: Scenario, line: CentreLine, length, rng):
        self.scenario, self.line, self.length = scenario.scene, line, length
        self._shore_rng, self._house_rng, self._furniture_rng = rng.spawn(3)

    @cached_property
    def _phase(self):
        return self._shore_rng.uniform(0.0, 2 * np.pi)

    def shore(self, s):
        """Distance (...) of the water's edge to the right of the boat's line. Units: m."""
        return SHORE + MEANDER * np.sin(np.asarray(s) / 45.0 + self._phase)

    def place(self, s, inland, height):
        """Points (..., 3) by their distance inland of the shore and height above the water."""
        return self.line.place(s, self.shore(s) + inland, height)

    @cached_property
    def reaches(self):
        """Quay walls and slopes in turn, with steps between some of them."""
        reaches, s, i = [], -MARGIN, int(self._phase > np.pi)
        while s < self.length + MARGIN:
            for kind in (("quay", "slope")[i % 2], "steps"):
                end = min(s + self._shore_rng.uniform(*LENGTHS[kind]), self.length + MARGIN)
                if end - s > 1.0:
                    reaches.append(_Reach(kind, s, end))
                    s = end
                else:
                    s = self.length + MARGIN
            i += 1
        return reaches

    @cached_property
    def houses(self):
        """Starts and ends (m along the line), setback (m) and height (m) of houses: (n, 4)."""
        rng, rows, s = self._house_rng, [], -MARGIN
        while s < self.length + MARGIN - 20.0:
            width = rng.uniform(12.0, 20.0)
            rows.append(
                (s, s + width, rng.uniform(0, SETBACK), rng.uniform(*self.scenario.house_height))
            )
            s += width + rng.uniform(3.0, 10.0) + 25.0 * (rng.random() < self.scenario.gaps)
        return np.array(rows).reshape(-1, 4)

    def _front(self, row):
        """Lower corners (2, 3) of a house's front."""
        return self.place(row[:2], HOUSES + row[2], _ground("quay", HOUSES + row[2]))

    @cached_property
    def mesh(self):
        """Banks, walls between them, and houses."""
        pieces = [self._bank(reach) for reach in self.reaches]
        pieces += [self._cross_wall(reach.start) for reach in self.reaches[1:]]
        for row in self.houses:
            near, far = self._front(row)
            inward = np.cross(far - near, UP)
            inward /= np.linalg.norm(inward)
            reflectance = self._house_rng.uniform(0.2, 0.5)
            pieces.append(house(near, far, inward, row[3], reflectance))
        return join(pieces)

    def _bank(self, reach):
        """A reach's profile drawn along the shore, in strips of 2 m at most."""
        s = np.linspace(reach.start, reach.end, 2 + int((reach.end - reach.start) / 2.0))
        strips = []
        for (x, z, reflectance), (next_x, next_z, _) in pairwise(PROFILES[reach.kind]):
            near, far = self.place(s, x, z), self.place(s, next_x, next_z)
            strips.append(four_corners(near[:-1], near[1:], far[1:], far[:-1], reflectance))
        return join(strips)

    def _cross_wall(self, s):
        """A wall with a parapet, from the water up to the promenade."""
        corner = self.place(s - 0.15, -0.2, -1.0)
        inland = self.place(s - 0.15, SLOPE_WIDTH + 0.5, -1.0) - corner
        along = self.place(s + 0.15, -0.2, -1.0) - corner
        return box(corner, inland, along, (TOP + 1.3) * UP, 0.35)

    def _reach(self, s, margin):
        """Kind of the reach that holds s with a margin (m) to both sides, or None."""
        for reach in self.reaches:
            if reach.start + margin < s < reach.end - margin:
                return reach.kind
        return None

    def spot(self, s, side, support, half, rng):
        """Spot for a target that reaches `half` (m) from its centre, or None where none is free.

        Always on the right bank; `road` lies on the slope; what has no place stands on a post.
        """
        kind = self._reach(s, half + 0.6)
        shadow = SLOPE_WIDTH if kind == "slope" else 0.0  # of the walls at a slope's ends
        if kind is None or self._reach(s, half + 0.6 + shadow) is None:
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
        return (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])

    def _on_house(self, s, half, rng):
        """On a house front, 2 cm before it."""
        reach = half + 0.4
        for row in self.houses:
            if row[0] + reach < s < row[1] - reach:
                break
        else:
            return None
        near, far = self._front(row)
        u = -(far - near) / np.linalg.norm(far - near)
        foot = near + (s - row[0]) / (row[1] - row[0]) * (far - near)
        low = max(1.4, half + 0.4)
        centre = foot + rng.uniform(low, low + 0.8) * UP + 0.02 * np.cross(u, UP)
        return Spot("wall", s, self.shore(s) + HOUSES + row[2], centre, u, UP, foot[2])

    def _on_quay(self, s, half, rng):
        """On the quay wall, 2 cm before it."""
        u = -self._facing(s)
        low, high = half + 0.4, max(half + 0.5, TOP - half - 0.3)
        centre = self.place(s, 0.0, rng.uniform(low, high)) + 0.02 * np.cross(u, UP)
        return Spot("wall", s, float(self.shore(s)), centre, u, UP, -0.5)

    def _on_post(self, s, kind, half, rng):
        """On a post behind the quay's edge, on the slope, or above the steps."""
        low, high = {"quay": (0.4, 1.0), "slope": (2.0, 6.0), "steps": (8.2, 8.8)}[kind]
        inland = rng.uniform(low, high)
        foot = self.place(s, inland, _ground(kind, inland))
        low = max(1.0, half + 0.2) + (0.6 if kind == "steps" else 0.0)
        centre = foot + rng.uniform(low, low + 1.0) * UP
        lateral = float(self.shore(s) + inland)
        return Spot("post", s, lateral, centre, -self._facing(s), UP, foot[2])

    def _on_slope(self, s, half, rng):
        """1 cm above the slope, in its plane."""
        margin = half + 0.3
        inland = rng.uniform(margin + 0.5, max(margin + 0.6, SLOPE_WIDTH - margin))
        steps = np.array([-0.2, 0.2])
        along = self.place(s + steps, inland, _ground("slope", inland))
        up = self.place(s, inland + steps, _ground("slope", inland + steps))
        u = -(along[1] - along[0]) / np.linalg.norm(along[1] - along[0])
        normal = np.cross(u, up[1] - up[0])
        normal /= np.linalg.norm(normal)
        centre = along.mean(axis=0) + 0.01 * normal
        lateral = float(self.shore(s) + inland)
        return Spot("road", s, lateral, centre, u, np.cross(normal, u), centre[2])

    def furniture(self, placed):
        """Mesh of lamps, trees, parked cars and bushes that stand before no target."""
        pieces = [placed.posts]
        streams = self._furniture_rng.spawn(4)
        kinds = (
            (self.scenario.poles, 1.2, 0.2, self._lamp),
            (self.scenario.trees, 5.0, 0.3, self._tree),
            (self.scenario.cars, 10.5, 2.3, self._car),
            (BUSHES, 4.0, 1.0, self._bush),
        )
        for (density, inland, extent, make), rng in zip(kinds, streams, strict=True):

            def is_free(s, _, inland=inland, extent=extent):
                kind = self._reach(s, extent + 0.3)
                right_place = kind == "slope" if inland == 4.0 else kind is not None
                on_steps = kind == "steps" and inland < 8.0
                hides = placed.in_the_way(s, float(self.shore(s)) + inland, extent)
                return right_place and not on_steps and not hides

            start, end = -MARGIN + 3.0, self.length + MARGIN - 3.0
            for s, _ in scatter(density, start, end, is_free, rng):
                pieces.append(make(s, inland, rng))
        return join(pieces)

    def _foot(self, s, inland):
        return self.place(s, inland, _ground(self._reach(s, 0.0) or "quay", inland))

    def _lamp(self, s, inland, rng):
        inland = inland if self._reach(s, 0.0) == "quay" else SLOPE_WIDTH + inland
        return lamp(self._foot(s, inland), np.cross(self._facing(s), UP))

    def _tree(self, s, inland, rng):
        inland = inland if self._reach(s, 0.0) == "quay" else SLOPE_WIDTH + 1.0
        return tree(self._foot(s, inland), self._facing(s), CROWN_AXES, rng)

    def _car(self, s, inland, rng):
        along = self._facing(s)
        right = np.cross(along, UP)
        return car(self._foot(s, inland), along, right, rng.uniform(0.1, 0.5))

    def _bush(self, s, inland, rng):
        size = rng.uniform(0.5, 1.0)
        foot = self._foot(s, inland + rng.uniform(-2.0, 2.0))
        axes = size * np.array([1.2, 1.0, 0.8])
        return leaves(foot + 0.6 * size * UP, axes, self._facing(s), int(500 * size), rng)


def _ground(kind, inland):
    """Height (...) of a profile above the water, inland of its steepest parts. Units: m."""
    x, z, _ = np.array(PROFILES[kind]).T
    return np.interp(inland, x, z)
