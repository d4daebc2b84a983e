"""Pictures of the cloud before and after, and their layout on paper."""

import io
from dataclasses import dataclass

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from mlscorr.report.pen import Pen
from mlscorr.report.render import symbols
from mlscorr.report.render.quantities import ColourScale
from mlscorr.report.render.view import View
from mlscorr.report.settings import SETTINGS
from mlscorr.report.style import STYLE, label

GAP, HEAD, FOOT, STACK_GAP = SETTINGS.page_margins
PT = symbols.PT
HALO = 1.2  # pixels of white on either side of a mark
FRAME = (187, 187, 187)  # RGB


@dataclass(frozen=True)
class Picture:
    """One view before and after, with the same camera and color scale.

    Parameters
    ----------
    view : View
    before, after : (h, w, 3) array of uint8
        RGB.
    scale : ColourScale
    """

    view: View
    before: np.ndarray
    after: np.ndarray
    scale: ColourScale

    @property
    def name(self) -> str:
        """File name, without suffix."""
        return "".join(c if c.isalnum() or c in "-_." else "_" for c in self.view.name)

    def panels(self, decorated: bool = True) -> tuple[bytes, ...]:
        """Bytes of two PNGs, before and after, to be laid over each other.

        Parameters
        ----------
        decorated : bool
            Without, they are the points alone, pixel by pixel.
        """
        pair = [self.before, self.after]
        if decorated:
            pair = self._marked(self.before.shape[0])
        both = _few_colours(np.concatenate(pair))  # the same colours in both
        width = both.width
        half = both.height // 2
        return tuple(_png(both.crop((0, k * half, width, (k + 1) * half))) for k in (0, 1))

    def _marked(self, height):
        """Both sides under their marks, with letters for a page of some height in pixels."""
        corner = symbols.free_corner(self.before, self.after)
        sides = (self.before, self.after)
        return [_panel(self.view, k, pixels, corner, height) for k, pixels in enumerate(sides)]

    def page(self, size: tuple[int, int]) -> bytes:
        """Return the bytes of a PNG: before and after side by side under a title, with a legend.

        Parameters
        ----------
        size : (int, int)
            Width and height. Units: pixels.
        """
        figure = _blank(*size)
        corners = _panel_corners(self.view.camera.size, size)
        titles = ("Before the correction", "After the correction")
        for pixels, corner, title in zip(self._marked(size[1]), corners, titles, strict=True):
            bottom = figure.bbox.height - corner[1] - pixels.shape[0]
            figure.figimage(pixels, corner[0], bottom, origin="upper")
            letters = symbols.points_of(figure, 1.0)
            place = (corner[0] / size[0], 1 - (corner[1] - 8) / size[1])
            figure.text(*place, title, fontsize=letters, color="#333333", va="bottom")
        _words(figure, self.view, corners[0][0] / size[0])
        symbols.legend(figure, self.view, self.scale, (GAP, FOOT))
        return _png(_few_colours(_drawn(figure)))


def panel_size(page: tuple[int, int], stacked: bool = False) -> tuple[int, int]:
    """Width and height in pixels of each of the two panels on a page of this size."""
    width, height = page
    gap = round(GAP * width)
    high = height - round((HEAD + FOOT) * height)
    if stacked:
        return width - 2 * gap, (high - round(STACK_GAP * height)) // 2
    return (width - 3 * gap) // 2, high


def _panel_corners(panel, page):
    """Column and row of the upper left corner of both panels on their page.

    They are stacked if there is no room side by side.
    """
    top = round(HEAD * page[1])
    if 2 * panel[0] > page[0]:
        left = (page[0] - panel[0]) // 2
        return (left, top), (left, top + panel[1] + round(STACK_GAP * page[1]))
    gap = (page[0] - 2 * panel[0]) // 3
    return (gap, top), (2 * gap + panel[0], top)


def _png(image):
    stream = io.BytesIO()
    image.save(stream, "png", compress_level=6)
    return stream.getvalue()


def _few_colours(pixels):
    """Reduce an image to 256 colors: a third of the bytes, and no visible difference."""
    return Image.fromarray(pixels).quantize(256, dither=Image.Dither.NONE)


def _blank(width, height):
    figure = Figure(figsize=(width / 100, height / 100), dpi=100, facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def _drawn(figure):
    with matplotlib.rc_context(STYLE):
        figure.canvas.draw()
    return np.asarray(figure.canvas.buffer_rgba())[..., :3].copy()


def _panel(view, k, pixels, corner, height):
    """Points of one side, pixel by pixel, under its marks, with scale and compass."""
    pen = Pen(pixels)
    for mark in view.marks[k]:
        _mark(pen, mark, view.camera)
    _names(pen, view.marks[k], view.camera, symbols.letter(height, 0.62))
    symbols.scale_bar(pen, view.camera, symbols.letter(height, 0.9))
    symbols.compass(pen, view.camera, corner, symbols.letter(height, 0.8))
    marked = pen.pixels
    marked[[0, -1]] = marked[:, [0, -1]] = FRAME
    return marked


def _mark(pen, mark, camera):
    pixel = camera.project(mark.points)[0]
    if mark.kind == "surveyed":
        pen.line(pixel, symbols.MARK, 2.2 * PT, HALO)
        if len(pixel) > 5:
            middle = pixel.mean(axis=0)
        else:
            middle = pixel[:4].mean(axis=0)
        for arm in 7.5 * PT * np.eye(2):
            pen.line(np.stack([middle - arm, middle + arm]), symbols.MARK, 2 * PT)
    elif mark.kind == "offset":
        _arrow(pen, pixel, 2.4 * PT)
    elif mark.kind == "residual":
        _arrow(pen, pixel, 2.0 * PT)
    else:
        symbols.symbol(pen, mark.kind, pixel[0])


def _arrow(pen, pixel, width):
    if np.hypot(*(pixel[1] - pixel[0])) < 14.0:  # pixels: the head would be longer
        pen.line(pixel, symbols.MARK, width, HALO)
    else:
        pen.arrow(pixel, symbols.MARK, width, (9.0, 5.0), HALO)


def _names(pen, marks, camera, size):
    """Names beside their symbols, left out where one would cover another."""
    taken = []
    for mark in marks:
        if mark.kind not in symbols.SYMBOLS:
            continue
        text = label(mark.text)
        x, y = camera.project(mark.points)[0][0]
        width = size * 72 / 100 * len(text)
        box = np.array([x + 7, y - size * 0.72, x + 7 + width, y + size * 0.72])
        if any((box[:2] < b[2:]).all() and (b[:2] < box[2:]).all() for b in taken):
            continue
        taken.append(box)
        pen.text((x + 7, y), text, size, halo=2 * PT)


def _words(figure, view, left):
    """Write the title, and the note at the bottom."""
    figure.text(
        left,
        0.982,
        view.title,
        va="top",
        fontsize=symbols.points_of(figure, 1.55),
        parse_math=False,
    )
    below = {"ha": "right", "va": "bottom", "color": "#444444", "parse_math": False}
    figure.text(1 - left, 0.018, view.note, fontsize=symbols.points_of(figure, 0.85), **below)
