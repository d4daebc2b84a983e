"""Pictures of the cloud before and after, and their layout on paper."""

import io
from dataclasses import dataclass

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from mlscorr.report.render import symbols
from mlscorr.report.render.quantities import ColourScale
from mlscorr.report.render.view import View
from mlscorr.report.settings import SETTINGS
from mlscorr.report.style import STYLE, label, wipe

GAP, HEAD, FOOT, STACK_GAP = SETTINGS.page_margins
Easels = dict[tuple[int, int], tuple[Figure, Axes]]


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

    def panels(self, decorated: bool = True, easels: Easels | None = None) -> tuple[bytes, ...]:
        """Return the bytes of two PNGs, before and after, for overlay.

        Parameters
        ----------
        decorated : bool
            False for only the points, pixel by pixel.
        easels : dict, optional
            Reusable figures by size, because a new one takes longer than drawing on it.
        """
        pair = [self.before, self.after]
        if decorated:
            corner = symbols.free_corner(*pair)
            height, width = self.before.shape[:2]
            easels = {} if easels is None else easels
            if (width, height) not in easels:
                figure = _blank(width, height)
                easels[width, height] = (figure, _panel_axes(figure, (width, height), (0, 0)))
            figure, axes = easels[width, height]
            for k in (0, 1):
                _panel(axes, self.view, k, pair[k], (0, 0), corner)
                pair[k] = _drawn(figure)
                wipe(axes)
                figure.images.clear()
        both = _few_colours(np.concatenate(pair))  # the same colors in both
        width = both.width
        half = both.height // 2
        return tuple(_png(both.crop((0, k * half, width, (k + 1) * half))) for k in (0, 1))

    def page(self, size: tuple[int, int]) -> bytes:
        """Return the bytes of a PNG: before and after side by side under a title, with a legend.

        Parameters
        ----------
        size : (int, int)
            Width and height. Units: pixels.
        """
        figure = _blank(*size)
        corner = symbols.free_corner(self.before, self.after)
        corners = _panel_corners(self.view.camera.size, size)
        for k, words in enumerate(("Before the correction", "After the correction")):
            axes = _panel_axes(figure, self.view.camera.size, corners[k])
            _panel(axes, self.view, k, (self.before, self.after)[k], corners[k], corner)
            axes.set_title(words, fontsize=symbols.letter(axes, 1.0), color="#333333", loc="left")
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


def _panel_axes(figure, size, corner):
    """Axes in pixels for a panel with a given upper left corner on the figure."""
    width, height = size
    wide = figure.bbox.width
    high = figure.bbox.height
    bottom = high - corner[1] - height
    axes = figure.add_axes((corner[0] / wide, bottom / high, width / wide, height / high))
    axes.set(xlim=(0, width), ylim=(height, 0), xticks=[], yticks=[], facecolor="none")
    axes.spines[:].set(visible=True, color="#bbbbbb", linewidth=0.8)
    return axes


def _panel(axes, view, k, pixels, corner, free):
    """Draw the points of one side, pixel by pixel, under its marks, with scale and compass."""
    figure = axes.figure
    bottom = figure.bbox.height - corner[1] - pixels.shape[0]
    figure.figimage(pixels, corner[0], bottom, origin="upper", zorder=-1)
    for mark in view.marks[k]:
        _mark(axes, mark, view.camera)
    _names(axes, view.marks[k], view.camera)
    symbols.scale_bar(axes, view.camera)
    symbols.compass(axes, view.camera, free)


def _mark(axes, mark, camera):
    pixel = camera.project(mark.points)[0]
    if mark.kind == "surveyed":
        axes.plot(*pixel.T, color=symbols.MARK, linewidth=2.2, path_effects=symbols.HALO)
        if len(pixel) > 5:
            middle = pixel.mean(axis=0)
        else:
            middle = pixel[:4].mean(axis=0)
        axes.plot(*middle, marker="+", markersize=15, markeredgewidth=2, color=symbols.MARK)
    elif mark.kind == "offset":
        _arrow(axes, pixel, 2.4)
    elif mark.kind == "residual":
        _arrow(axes, pixel, 2.0)
    else:
        axes.plot(*pixel.T, markersize=6, markeredgewidth=1.3, **symbols.SYMBOLS[mark.kind])


def _arrow(axes, pixel, width):
    if np.hypot(*(pixel[1] - pixel[0])) < 14.0:  # pixels: the head would be longer
        axes.plot(*pixel.T, color=symbols.MARK, linewidth=width, path_effects=symbols.HALO)
        return
    arrow = {"arrowstyle": "-|>,head_width=0.28,head_length=0.55", "shrinkA": 0, "shrinkB": 0}
    arrow |= {"color": symbols.MARK, "linewidth": width, "path_effects": symbols.HALO}
    axes.annotate("", xy=pixel[1], xytext=pixel[0], arrowprops=arrow)


def _names(axes, marks, camera):
    """Write names next to their symbols, unless one would cover another."""
    size = symbols.letter(axes, 0.62)
    taken = []
    for mark in marks:
        if mark.kind not in symbols.SYMBOLS:
            continue
        text = label(mark.text)
        x, y = camera.project(mark.points)[0][0]
        box = np.array([x + 7, y - size, x + 7 + size * len(text), y + size])
        if any((box[:2] < b[2:]).all() and (b[:2] < box[2:]).all() for b in taken):
            continue
        taken.append(box)
        axes.text(
            x + 7, y, text, fontsize=size, va="center", parse_math=False, path_effects=symbols.HALO
        )


def _words(figure, view, left):
    """Write the title, and the note at the bottom."""
    figure.text(
        left, 0.982, view.title, va="top", fontsize=symbols.letter(figure, 1.55), parse_math=False
    )
    below = {"ha": "right", "va": "bottom", "color": "#444444", "parse_math": False}
    figure.text(1 - left, 0.018, view.note, fontsize=symbols.letter(figure, 0.85), **below)
