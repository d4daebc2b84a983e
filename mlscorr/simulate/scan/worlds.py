"""Worlds for replayed pulses: planes, a reference mesh, targets.

All are relative to one local origin; ``meet(start, direction)`` takes arrays (n, 3) of the pulses
and returns Met.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Self

import numpy as np

from mlscorr.simulate.scan.replay import Met
from mlscorr.simulate.scene import Mesh
from mlscorr.simulate.settings import SETTINGS
from mlscorr.survey import Columns

FORMS = ("circle", "square", "hole", "checkerboard", "board")
CIRCLE, SQUARE, HOLE, CHECKERBOARD, PLATE = range(len(FORMS))


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

    def meet(self, start: np.ndarray, direction: np.ndarray) -> Met:
        """Compute Met of beams on their planes.

        Parameters
        ----------
        start : (n, 3) array
            Of the beams. Units: m.
        direction : (n, 3) array
            Unit vectors.
        """
        distance, slant = crossing(start, direction, self.normal, self.offset)
        return Met(distance, slant, self.intensity)


def crossing(
    start: np.ndarray, direction: np.ndarray, normal: np.ndarray, offset: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Distance (n,) in m along beams to planes, NaN without one, and cosine (n,) of incidence.

    Parameters
    ----------
    start : (n, 3) array
        Of the beams. Units: m.
    direction : (n, 3) array
        Unit vectors.
    normal : (n, 3) array
        Of the planes.
    offset : (n,) array
        Of the planes from the origin, along the normal. Units: m.
    """
    slope = np.einsum("ni,ni->n", direction, normal)
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = (offset - np.einsum("ni,ni->n", start, normal)) / slope
    met = (np.abs(slope) >= SETTINGS.no_return_cosine) & (distance > 0)
    return np.where(met, distance, np.nan), np.abs(slope)


@dataclass(frozen=True)
class MeshWorld:
    """Triangles of a mesh relative to the origin."""

    mesh: Mesh

    def cast(self, start: np.ndarray, direction: np.ndarray) -> np.ndarray:
        """Return the triangle (n,) that each beam meets first; -1 for none.

        Parameters
        ----------
        start : (n, 3) array
            Of the beams. Units: m.
        direction : (n, 3) array
            Unit vectors.
        """
        rays = np.hstack([start, direction]).astype(np.float32)
        triangle = self.mesh.caster.cast_rays(rays)["primitive_ids"].numpy().astype(np.int64)
        return np.where(triangle < len(self.mesh), triangle, -1)

    def meet(
        self, start: np.ndarray, direction: np.ndarray, intensity: np.ndarray
    ) -> tuple[Met, np.ndarray]:
        """Compute Met of beams that return with intensities (n,), and the triangle (n,) of each.

        Triangles are found in float32, distances on their planes in float64.

        Parameters
        ----------
        start : (n, 3) array
            Of the beams. Units: m.
        direction : (n, 3) array
            Unit vectors.
        intensity : (n,) array
            Intensity of the returns.
        """
        triangle = self.cast(start, direction)
        distance, slant = crossing(
            start, direction, self.mesh.normal[triangle], self.mesh.offset[triangle]
        )
        return Met(np.where(triangle >= 0, distance, np.nan), slant, intensity), triangle


@dataclass(frozen=True, repr=False)
class Boards(Columns):
    """Targets as built by the simulator: discs on boards, plates, holes in boards, checkerboards.

    Parameters
    ----------
    centre : (t, 3) array
        Relative to the origin. Units: m.
    axes : (t, 3, 3) array
        Columns: the directions of the edges, and the normal.
    form : (t,) int array
        Number in FORMS.
    size : (t,) array
        Units: m.
    inner : (t,) array
        Diameter of a ring's dark inner disc over the outer one's, 0 for none.
    bright, dark, speckle : (t,) array
        Intensity of the paints, and their relative noise.
    """

    centre: np.ndarray
    axes: np.ndarray
    form: np.ndarray
    size: np.ndarray
    inner: np.ndarray
    bright: np.ndarray
    dark: np.ndarray
    speckle: np.ndarray

    @classmethod
    def concatenate(cls, parts: Iterable[Self]) -> Self:
        """Concatenate the boards of several records in order; empty without any."""
        shapes = (0, 3), (0, 3, 3), 0, 0, 0, 0, 0, 0
        none = cls(*(np.empty(shape, int if i == 2 else float) for i, shape in enumerate(shapes)))
        return super().concatenate([none, *parts])

    def crossings(
        self, number: np.ndarray, start: np.ndarray, direction: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Cross beams with their target's plane: distance, cosine (n,), place (n, 2) along edges.

        Parameters
        ----------
        number : (n,) int array
            Index of the target of each pulse.
        start : (n, 3) array
            Of the beams. Units: m.
        direction : (n, 3) array
            Unit vectors.
        """
        normal = self.axes[number, 2]
        centre = self.centre[number]
        offset = np.einsum("ni,ni->n", normal, centre)
        distance, slant = crossing(start, direction, normal, offset)
        away = start + distance[:, None] * direction - centre
        return distance, slant, np.einsum("nij,nj->ni", self.axes[number, :2], away)

    def paint(self, number: np.ndarray, place: np.ndarray) -> np.ndarray:
        """Return the intensity (n,) at positions (n, 2) in the targets' planes; NaN off the target.

        Parameters
        ----------
        number : (n,) int array
            Of targets.
        place : (n, 2) array
            Along their edges from the center. Units: m.
        """
        x, y = place.T
        form = self.form[number]
        half = self.size[number] / 2
        bright = self.bright[number]
        dark = self.dark[number]
        radius = np.hypot(x, y)
        edge = np.maximum(np.abs(x), np.abs(y))
        disc = (radius <= half) & (radius >= self.inner[number] * half)
        plate = np.where(edge <= half, bright, np.nan)
        choices = [
            np.where(disc, bright, np.where(edge <= SETTINGS.board_edge * half, dark, np.nan)),
            plate,
            np.where((radius >= half) & (edge <= SETTINGS.hole_board * half), bright, np.nan),
            np.where(x * y > 0, plate, np.where(edge <= half, dark, np.nan)),
            plate,
        ]
        return np.choose(form, choices)


@dataclass(frozen=True)
class TargetWorld:
    """Boards, each for nearby pulses, in front of the recorded background.

    Parameters
    ----------
    boards : Boards
    number : (n,) int array
        Board of each pulse.
    beyond : (n,) array
        Range of the background minus that of the target's plane; NaN without a background. Units:
        m.
    intensity : (n,) array
        Intensity of the background.
    noise : (n,) array
        Unit noise, of the paints' speckle.
    """

    boards: Boards
    number: np.ndarray
    beyond: np.ndarray
    intensity: np.ndarray
    noise: np.ndarray

    def meet(self, start: np.ndarray, direction: np.ndarray) -> Met:
        """Compute Met of the first surface: foreground, target or background.

        Parameters
        ----------
        start : (n, 3) array
            Of the beams. Units: m.
        direction : (n, 3) array
            Unit vectors.
        """
        distance, slant, place = self.boards.crossings(self.number, start, direction)
        paint = self.boards.paint(self.number, place)
        hidden = self.beyond * slant < -SETTINGS.hiding_depth
        on = np.isfinite(paint) & np.isfinite(distance) & ~hidden
        speckle = 1.0 + self.boards.speckle[self.number] * self.noise
        return Met(
            np.where(on, distance, distance + self.beyond),
            slant,
            np.maximum(np.where(on, paint * speckle, self.intensity), 0.0),
        )


def paints(kind: str, intensity: np.ndarray) -> tuple[float, float, float]:
    """Bright and dark paint, and their relative noise, from recorded intensities (n,).

    Parameters
    ----------
    kind : str
        Of the target.
    intensity : (n,) array
        Recorded on it.
    """
    bright = float(np.median(intensity)) if len(intensity) else 0.0
    if kind == "checkerboard" and len(intensity):
        dark, bright = np.percentile(intensity, [15, 85])
        return float(bright), float(dark), 0.0
    if len(intensity):
        spread = 0.74 * np.subtract(*np.percentile(intensity, [75, 25]))
    else:
        spread = 0.0
    return (
        bright,
        bright * SETTINGS.black / SETTINGS.white,
        min(float(spread) / max(bright, 1.0), 0.3),
    )
