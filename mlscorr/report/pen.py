"""Pen that draws marks and letters on pixels, for pages with dozens of pictures.

matplotlib takes a tenth of a second for each of them. Edges are smooth as the pen draws at a
multiple of the size, and each pixel is the mean of the finer ones in it.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from matplotlib.font_manager import FontProperties, findfont
from PIL import Image, ImageDraw, ImageFont

from mlscorr.report.settings import SETTINGS
from mlscorr.report.style import STYLE

FINENESS = 4  # finer pixels for each pixel, along either axis


class Pen:
    """Pen on a picture. Positions are column and row; positions and lengths are in its pixels.

    Parameters
    ----------
    pixels : (h, w, 3) array of uint8
        RGB. It stays as it is.
    """

    def __init__(self, pixels: np.ndarray) -> None:
        height, width = pixels.shape[:2]
        self.size = (width, height)
        self.fineness = FINENESS
        while self.fineness > 1 and width * height * self.fineness**2 > SETTINGS.finest_picture:
            self.fineness //= 2
        finer = (width * self.fineness, height * self.fineness)
        self._image = Image.fromarray(pixels).resize(finer, Image.Resampling.NEAREST)
        self._draw = ImageDraw.Draw(self._image)

    @property
    def pixels(self) -> np.ndarray:
        """Picture with everything drawn on it: (h, w, 3) uint8."""
        return np.array(self._image.reduce(self.fineness))

    def line(
        self, points: np.ndarray, color: str, width: float, halo: float = 0.0, closed: bool = False
    ) -> None:
        """Draw a line through points (n, 2), with a white margin on either side."""
        if closed:
            points = np.concatenate([points, points[:2]])
        path = self._finer(points)
        if halo:
            self._draw.line(path, "white", self._thick(width + 2 * halo), joint="curve")
        self._draw.line(path, color, self._thick(width), joint="curve")

    def polygon(self, points: np.ndarray, fill: str) -> None:
        """Fill a polygon of points (n, 2)."""
        self._draw.polygon(self._finer(points), fill)

    def dots(self, points: np.ndarray, color: str, diameter: float) -> None:
        """Draw a disc at each of some points (n, 2)."""
        radius = diameter / 2 * self.fineness
        for column, row in points * self.fineness:
            box = (column - radius, row - radius, column + radius, row + radius)
            self._draw.ellipse(box, color)

    def arrow(
        self,
        points: np.ndarray,
        color: str,
        width: float,
        head: tuple[float, float],
        halo: float = 0.0,
    ) -> None:
        """Draw an arrow from the first of two points to the second.

        Its head has a length and half a width.
        """
        foot, tip = np.asarray(points, float)
        along = (tip - foot) / max(float(np.hypot(*(tip - foot))), 1e-9)
        across = np.array([-along[1], along[0]])
        neck = tip - head[0] * along
        triangle = np.stack([tip, neck + head[1] * across, neck - head[1] * across])
        if halo:
            self.line(np.stack([foot, neck]), "white", width + 2 * halo)
            self.line(triangle, "white", 2 * halo, closed=True)
        self.line(np.stack([foot, neck + along]), color, width)
        self.polygon(triangle, color)

    def tint(self, points: np.ndarray, color: str, share: float) -> None:
        """Lay a color over a polygon of points (n, 2), with an opacity from 0 to 1."""
        path = self._finer(points)
        low = np.floor(np.min(path, axis=0)).astype(int) - 1
        high = np.ceil(np.max(path, axis=0)).astype(int) + 1
        left, top = np.maximum(low, 0).tolist()
        right, bottom = np.minimum(high, self._image.size).tolist()
        if left >= right or top >= bottom:
            return
        mask = Image.new("L", (right - left, bottom - top))
        inside = [(column - left, row - top) for column, row in path]
        ImageDraw.Draw(mask).polygon(inside, round(255 * share))
        self._image.paste(color, (left, top, right, bottom), mask)

    def text(
        self,
        place: tuple[float, float],
        words: str,
        size: float,
        color: str = "black",
        anchor: str = "lm",
        bold: bool = False,
        halo: float = 0.0,
    ) -> None:
        """Write text; the anchor is Pillow's: left, middle or right, then the height."""
        font = _font(bold, round(size * self.fineness))
        at = self._finer(np.array([place]))[0]
        if halo:
            edge = halo * self.fineness
            self._draw.text(
                at, words, "white", font, anchor, stroke_width=edge, stroke_fill="white"
            )
        self._draw.text(at, words, color, font, anchor)

    def _finer(self, points):
        """Points in the pixels of the finer picture."""
        return [(column, row) for column, row in (np.asarray(points) * self.fineness).tolist()]

    def _thick(self, width):
        return max(1, round(width * self.fineness))


@cache
def _font(bold: bool, size: int) -> ImageFont.FreeTypeFont:
    """Font of all figures, with its size in pixels."""
    weight = "bold" if bold else "normal"
    path = findfont(FontProperties(family=STYLE["font.family"], weight=weight))
    return ImageFont.truetype(path, size, layout_engine=ImageFont.Layout.BASIC)
