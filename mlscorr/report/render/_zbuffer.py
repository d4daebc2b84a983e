"""Z-buffer for points: each pixel keeps the nearest one, in any order of points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mlscorr.compiled_loops import loop
from mlscorr.report.render.view import Camera

DEEPEST = 20_000.0  # m in front of and behind the focus
DEPTH_STEP = 1e-5  # m: 2 * DEEPEST / DEPTH_STEP fits 32 bits
EMPTY = np.uint64(np.iinfo(np.uint64).max)


@dataclass(frozen=True)
class Canvas:
    """Nearest point of each pixel.

    Parameters
    ----------
    camera : Camera
    half_depth : float
        Points farther in front of or behind the focus are not drawn. Units: m.
    pixels : (height, width) array of uint64

    A pixel is one number: depth in steps of 0.01 mm in the upper 32 bits, the bits of the point's
    float32 value in the lower ones. The smallest number wins. Points of equal depth are thus
    ordered by value, and neither order nor chunks change the picture.
    """

    camera: Camera
    half_depth: float
    pixels: np.ndarray

    @classmethod
    def blank(cls, camera: Camera, half_depth: float = np.inf) -> Canvas:
        """Make an empty canvas."""
        width, height = camera.size
        return cls(camera, min(half_depth, DEEPEST), np.full((height, width), EMPTY))

    def holds(self, xyz: np.ndarray) -> np.ndarray:
        """Flag (n,) of points (n, 3) within half_depth of the focus."""
        x, y, z = (xyz - self.camera.focus).T
        away = self.camera.axes[2]
        return np.abs(away[0] * x + away[1] * y + away[2] * z) <= self.half_depth

    def draw(self, xyz: np.ndarray, value: np.ndarray) -> None:
        """Add points (n, 3) in m, with values (n,)."""
        camera = self.camera
        _draw(
            np.ascontiguousarray(xyz, dtype=float),
            np.ascontiguousarray(value, dtype=np.float32).view(np.uint32),
            camera.focus,
            camera.axes,
            camera.scale,
            camera.distance,
            self.half_depth,
            self.pixels,
        )

    @property
    def radius(self) -> float:
        """Radius in pixels at which adjacent points touch, from their density."""
        block = 16  # pixels, in which the density of points is counted
        rows, columns = (-np.array(self.pixels.shape)) % block
        blocks = np.pad(self.drawn, ((0, rows), (0, columns)))
        blocks = blocks.reshape(blocks.shape[0] // block, block, -1, block).sum(axis=(1, 3))
        counts = np.sort(blocks[blocks > 0])
        if len(counts) == 0:
            return 0.0
        half = np.searchsorted(np.cumsum(counts), counts.sum() / 2)  # at the median point
        distance = block / np.sqrt(counts[half])  # to the next point
        return float(min(0.85 * distance, 7.0))  # surfaces close, and few points stay points

    def grown(self, radius: float) -> Canvas:
        """Return the canvas with each point as a disc of a radius in pixels.

        Where discs overlap, the nearer point is visible, as if every point of the cloud had been
        drawn as a disc around its pixel.
        """
        steps = np.arange(-int(radius), int(radius) + 1)
        rows, columns = np.meshgrid(steps, steps, indexing="ij")
        disc = np.argwhere(rows**2 + columns**2 <= radius**2) - int(radius)
        pixels = self.pixels.copy()
        _grow(self.pixels, disc, pixels)
        return Canvas(self.camera, self.half_depth, pixels)

    @property
    def value(self) -> np.ndarray:
        """Values (height, width) of the visible points, NaN without one."""
        value = (self.pixels & np.uint64(0xFFFFFFFF)).astype(np.uint32).view(np.float32)
        return np.where(self.drawn, value, np.float32(np.nan))

    @property
    def drawn(self) -> np.ndarray:
        """Flag (height, width) of pixels with a visible point."""
        return self.pixels != EMPTY

    @property
    def points(self) -> np.ndarray:
        """Visible points (n, 3) float32, to the pixel, in camera axes relative to the focus.

        The axes are right, up and toward the eye; pixels go row by row. Units: m.
        """
        row, column = np.nonzero(self.drawn)
        depth = (self.pixels[row, column] >> np.uint64(32)) * DEPTH_STEP - DEEPEST
        height, width = self.pixels.shape
        metres = 1 / self.camera.scale * (1 + depth / self.camera.distance)
        right = (column + 0.5 - width / 2) * metres
        up = (height / 2 - row - 0.5) * metres
        return np.column_stack([right, up, -depth]).astype(np.float32)

    @property
    def light(self) -> np.ndarray:
        """Brightness of each pixel, in [0, 1]: darker behind a near edge.

        It depends only on depth, as in eye-dome lighting (Boucheny 2009); slopes keep their colors.
        """
        return _light(self.pixels, self.camera.scale * DEPTH_STEP)


@loop
def _draw(xyz, value, focus, axes, scale, distance, half_depth, pixels):
    height, width = pixels.shape
    for p in range(xyz.shape[0]):
        x = xyz[p, 0] - focus[0]
        y = xyz[p, 1] - focus[1]
        z = xyz[p, 2] - focus[2]
        depth = axes[2, 0] * x + axes[2, 1] * y + axes[2, 2] * z
        if not abs(depth) <= half_depth:
            continue
        there = scale
        if distance < np.inf:
            if distance + depth <= 0:  # behind the eye
                continue
            there = scale * distance / (distance + depth)
        column = width / 2 + (axes[0, 0] * x + axes[0, 1] * y + axes[0, 2] * z) * there
        row = height / 2 - (axes[1, 0] * x + axes[1, 1] * y + axes[1, 2] * z) * there
        if not (0 <= column < width and 0 <= row < height):
            continue
        step = np.uint64((depth + DEEPEST) / DEPTH_STEP)
        key = (step << np.uint64(32)) | np.uint64(value[p])
        i = int(row)
        j = int(column)
        pixels[i, j] = min(pixels[i, j], key)


@loop
def _grow(pixels, disc, grown):
    height, width = pixels.shape
    for i in range(height):
        for j in range(width):
            key = pixels[i, j]
            if key == EMPTY:
                continue
            for k in range(disc.shape[0]):
                row = i + disc[k, 0]
                column = j + disc[k, 1]
                if 0 <= row < height and 0 <= column < width and key < grown[row, column]:
                    grown[row, column] = key


@loop
def _light(pixels, pixels_per_step):
    deepest = 3.0  # pixels of depth at which an edge is darkest; half of it is no edge
    height, width = pixels.shape
    light = np.ones((height, width))
    for i in range(2, height - 2):
        for j in range(2, width - 2):
            if pixels[i, j] == EMPTY:
                continue
            here = np.int64(pixels[i, j] >> np.uint64(32))
            edge = 0.0
            for a, b in ((2, 0), (0, 2), (1, 1), (1, -1)):
                left = pixels[i + a, j + b]
                right = pixels[i - a, j - b]
                if EMPTY in (left, right):
                    continue
                # mean of opposite pixels, because a slope is not an edge
                mean = (np.int64(left >> np.uint64(32)) + np.int64(right >> np.uint64(32))) / 2
                behind = (here - mean) * pixels_per_step - deepest / 2
                edge += min(max(behind, 0.0), deepest)
            light[i, j] = np.exp(-0.35 * edge / deepest)
    return light
