"""A sheet: one view that is drawn, before and after, while the cloud goes by."""

from dataclasses import dataclass

import numpy as np

from mlscorr.report.render.open3d_engine import draw_pair
from mlscorr.report.render.picture import Picture
from mlscorr.report.render.quantities import GHOST, PAIRS, limits, paint, rgb
from mlscorr.report.render.views import View
from mlscorr.report.render.zbuffer import REACH, Canvas

CUT = 0.004  # least radius of a cut's points over the width of the picture


@dataclass(frozen=True)
class Sheet:
    """A view with its two canvases."""

    view: View
    canvases: tuple[Canvas, Canvas]

    @classmethod
    def blank(cls, view):
        """Nothing drawn yet. Before a cut its points may lie anywhere."""
        depths = (REACH if view.is_cut else view.half_depth, view.half_depth)
        return cls(view, tuple(Canvas.blank(view.camera, depth) for depth in depths))

    def add(self, chunk, values):
        """Draw a chunk with its values before and after."""
        clouds = [chunk.before.xyz, chunk.after.xyz]
        if self.view.is_cut:
            rows = self.canvases[1].holds(clouds[1])
            clouds, values = [xyz[rows] for xyz in clouds], [v[rows] for v in values]
        for canvas, xyz, value in zip(self.canvases, clouds, values, strict=True):
            canvas.draw(xyz, value)

    def finished(self, by_open3d=False, reference=None):
        """The Picture, by Open3D or the z-buffer. Raises RuntimeError where Open3D fails."""
        view, radius = self.view, max(canvas.radius for canvas in self.canvases)
        if view.is_cut:  # a few points in a row are all there is to see
            radius = max(radius, CUT * view.camera.size[0])
        pair = [canvas.grown(radius) for canvas in self.canvases]
        ends = limits(view.colour, *(canvas.value for canvas in pair))
        if by_open3d:
            colours = [paint(view.colour, canvas.value, ends) for canvas in self.canvases]
            surface = reference if view.half_depth == REACH else None  # it would hide a slice
            sides = draw_pair(self.canvases, colours, 2 * radius + 1, surface)
        else:
            sides = [_side(view, pair[k], pair[1 - k], ends) for k in (0, 1)]
        return Picture(view, *sides, ends)


def _side(view, canvas, other, ends):
    """RGB (h, w, 3) of a canvas on white paper."""
    pixels = np.full((*canvas.pixels.shape, 3), 255, np.uint8)
    if view.colour == "state":
        pixels[other.drawn] = rgb(GHOST)[0]
    colours = paint(view.colour, canvas.value, ends)
    if view.half_depth == REACH and view.colour not in PAIRS:  # in a thin slice edges of single
        colours = np.round(colours * canvas.light[..., None]).astype(np.uint8)  # points are noise
    pixels[canvas.drawn] = colours[canvas.drawn]
    return pixels
