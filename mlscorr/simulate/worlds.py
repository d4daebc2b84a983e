"""What recorded pulses may meet when they are fired again: planes, a reference mesh, targets.

All about one local origin; ``meet(start, direction)`` takes (n, 3) of each pulse and gives Met.
"""

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from mlscorr.simulate.echoes import GRAZING
from mlscorr.simulate.replay import Met
from mlscorr.simulate.shapes import BOARD, BRIGHT, DARK, Mesh, ray_caster

BEFORE = 0.03  # m in front of a target's plane: another thing that hides it
FORMS = ("circle", "square", "hole", "checkerboard", "board")
CIRCLE, SQUARE, HOLE, CHECKERBOARD, PLATE = range(len(FORMS))
HOLE_BOARD = 2.0  # edge of the board about a hole, in its diameters


@dataclass(frozen=True)
class Planes:
    """One unlimited plane for each pulse.

    Parameters
    ----------
    normal : (n, 3) array
        Unit vectors.
    offset : (n,) array
        Distance of the plane from the origin along the normal. Units: m.
    intensity : (n,) array
    """

    normal: np.ndarray
    offset: np.ndarray
    intensity: np.ndarray

    def meet(self, start, direction):
        """Met where beams meet their planes."""
        distance, slant = crossing(start, direction, self.normal, self.offset)
        return Met(distance, slant, self.intensity)


def crossing(start, direction, normal, offset):
    """Distance (n,) along beams to planes (NaN where they never meet them) in m, and the cosine
    (n,) of incidence."""
    slope = np.einsum("ni,ni->n", direction, normal)
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = (offset - np.einsum("ni,ni->n", start, normal)) / slope
    met = (np.abs(slope) >= GRAZING) & (distance > 0)
    return np.where(met, distance, np.nan), np.abs(slope)


@dataclass(frozen=True)
class MeshWorld:
    """The triangles of a mesh about the origin."""

    mesh: Mesh

    @cached_property
    def _caster(self):
        return ray_caster(self.mesh.triangles)

    @cached_property
    def planes(self):
        """Unit normal (t, 3) and offset (t,) of each triangle."""
        a, b, c = np.moveaxis(self.mesh.triangles, 1, 0)
        normal = np.cross(b - a, c - a)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        return normal, np.einsum("ti,ti->t", normal, a)

    def cast(self, start, direction):
        """Triangle (n,) that each beam meets first; -1 for none."""
        rays = np.hstack([start, direction]).astype(np.float32)
        triangle = self._caster.cast_rays(rays)["primitive_ids"].numpy().astype(np.int64)
        return np.where(triangle < len(self.mesh), triangle, -1)

    def meet(self, start, direction, intensity):
        """Met of beams that return with intensities (n,), and the triangle (n,) of each.

        Triangles are found in float32, distances on their planes in float64.
        """
        normal, offset = self.planes
        triangle = self.cast(start, direction)
        distance, slant = crossing(start, direction, normal[triangle], offset[triangle])
        return Met(np.where(triangle >= 0, distance, np.nan), slant, intensity), triangle


@dataclass(frozen=True)
class Boards:
    """Targets as the simulator builds them: a bright disc on a darker board, a bright plate, a
    hole in a board, a checkerboard; and beside them what was recorded there.

    Parameters
    ----------
    centre : (t, 3) array
        About the origin. Units: m.
    axes : (t, 3, 3) array
        Rows: the directions of the edges, and the normal.
    form : (t,) int array
        Number in FORMS.
    size : (t,) array
        Units: m.
    inner : (t,) array
        Diameter of a ring's dark inner disc over the outer one's, 0 for none.
    bright, dark, speckle : (t,) array
        Intensity of its paints, and their relative noise.
    """

    centre: np.ndarray
    axes: np.ndarray
    form: np.ndarray
    size: np.ndarray
    inner: np.ndarray
    bright: np.ndarray
    dark: np.ndarray
    speckle: np.ndarray

    def __len__(self):
        return len(self.size)

    def __getitem__(self, selection):
        return Boards(*(getattr(self, field.name)[selection] for field in fields(self)))

    @classmethod
    def concatenate(cls, several):
        """All boards of some, in their order; none of none."""
        nothing = np.empty(0)
        shapes = (0, 3), (0, 3, 3)
        none = cls(*(np.empty(shape) for shape in shapes), nothing.astype(int), *[nothing] * 5)
        names = [field.name for field in fields(cls)]
        return cls(
            *(np.concatenate([getattr(b, name) for b in (none, *several)]) for name in names)
        )

    def crossings(self, number, start, direction):
        """Where the beams of pulses meet the plane of their target, `number` (n,): distance (n,)
        in m, cosine of incidence (n,), place along the edges from the centre (n, 2) in m."""
        normal, centre = self.axes[number, 2], self.centre[number]
        offset = np.einsum("ni,ni->n", normal, centre)
        distance, slant = crossing(start, direction, normal, offset)
        away = start + distance[:, None] * direction - centre
        return distance, slant, np.einsum("nij,nj->ni", self.axes[number, :2], away)

    def paint(self, number, place):
        """Intensity (n,) at places (n, 2) of their targets' planes; NaN off the target."""
        x, y = place.T
        form, half = self.form[number], self.size[number] / 2
        bright, dark = self.bright[number], self.dark[number]
        radius, edge = np.hypot(x, y), np.maximum(np.abs(x), np.abs(y))
        disc = (radius <= half) & (radius >= self.inner[number] * half)
        plate = np.where(edge <= half, bright, np.nan)
        choices = [
            np.where(disc, bright, np.where(edge <= BOARD * half, dark, np.nan)),
            plate,
            np.where((radius >= half) & (edge <= HOLE_BOARD * half), bright, np.nan),
            np.where(x * y > 0, plate, np.where(edge <= half, dark, np.nan)),
            plate,
        ]
        return np.choose(form, choices)


@dataclass(frozen=True)
class TargetWorld:
    """Boards, each for the pulses about it, before what was recorded behind them.

    Parameters
    ----------
    boards : Boards
    number : (n,) int array
        The board that each pulse is about.
    beyond : (n,) array
        Range of what a pulse meets without the target, over that of the target's plane; NaN where
        it meets nothing. Units: m.
    intensity : (n,) array
        Of that.
    noise : (n,) array
        Unit noise, of the paints' speckle.
    """

    boards: Boards
    number: np.ndarray
    beyond: np.ndarray
    intensity: np.ndarray
    noise: np.ndarray

    def meet(self, start, direction):
        """Met of what comes first: something before the target, the target, or what is behind."""
        distance, slant, place = self.boards.crossings(self.number, start, direction)
        paint = self.boards.paint(self.number, place)
        hidden = self.beyond * slant < -BEFORE
        on = np.isfinite(paint) & np.isfinite(distance) & ~hidden
        speckle = 1.0 + self.boards.speckle[self.number] * self.noise
        return Met(
            np.where(on, distance, distance + self.beyond),
            slant,
            np.maximum(np.where(on, paint * speckle, self.intensity), 0.0),
        )


def paints(kind, intensity):
    """Bright and dark paint and the relative noise of both, of a target of a kind on which these
    intensities (n,) were recorded, with the simulator's ratio of reflectances."""
    bright = float(np.median(intensity)) if len(intensity) else 0.0
    if kind == "checkerboard" and len(intensity):
        dark, bright = np.percentile(intensity, [15, 85])
        return float(bright), float(dark), 0.0
    spread = 0.74 * np.subtract(*np.percentile(intensity, [75, 25])) if len(intensity) else 0.0
    return bright, bright * DARK / BRIGHT, min(float(spread) / max(bright, 1.0), 0.3)
