"""How far bright points on a plane are those of a target's shape."""

import numpy as np
from numba import njit

DIRECTIONS = 12  # in which a component is measured
LARGEST_RATIO = 1.6  # of length and width, where part is hidden


@njit(cache=True)
def agreement(uv, bright, longest):
    """Largest share of common points of the bright ones and those in a shape that spans them.

    The shape spans those that are no farther (m) from the middle than the longest.
    """
    spanned = bright & (uv[:, 0] ** 2 + uv[:, 1] ** 2 <= longest**2)
    best_area, turn, diameter = np.inf, 0.0, 0.0
    for step in range(DIRECTIONS):
        angle = np.pi / 2 * step / DIRECTIONS
        low_x, high_x, low_y, high_y = _extent(uv, spanned, angle)
        diameter += (high_x - low_x + high_y - low_y) / (2 * DIRECTIONS)
        if (high_x - low_x) * (high_y - low_y) < best_area:
            best_area, turn = (high_x - low_x) * (high_y - low_y), angle
    low_x, high_x, low_y, high_y = _extent(uv, spanned, turn)
    width, height = high_x - low_x, high_y - low_y
    if not 0.0 < max(width, height) <= LARGEST_RATIO * min(width, height):
        return 0.0
    both, either = np.zeros(4), np.zeros(4)
    inside = np.zeros(4, np.bool_)
    for i in range(len(uv)):
        x = np.cos(turn) * uv[i, 0] + np.sin(turn) * uv[i, 1] - (low_x + high_x) / 2
        y = np.cos(turn) * uv[i, 1] - np.sin(turn) * uv[i, 0] - (low_y + high_y) / 2
        inside[0] = x * x + y * y <= diameter**2 / 4
        inside[1] = abs(x) <= width / 2 and abs(y) <= height / 2
        inside[2] = inside[1] and x * y > 0
        inside[3] = inside[1] and x * y <= 0
        for shape in range(4):
            both[shape] += inside[shape] and bright[i]
            either[shape] += inside[shape] or bright[i]
    return (both / np.maximum(either, 1.0)).max()


@njit(cache=True)
def _extent(uv, bright, angle):
    """Bounds of the bright points along a direction and across it."""
    low_x, high_x, low_y, high_y = np.inf, -np.inf, np.inf, -np.inf
    cos, sin = np.cos(angle), np.sin(angle)
    for i in range(len(uv)):
        if bright[i]:
            x, y = cos * uv[i, 0] + sin * uv[i, 1], cos * uv[i, 1] - sin * uv[i, 0]
            low_x, high_x = min(low_x, x), max(high_x, x)
            low_y, high_y = min(low_y, y), max(high_y, y)
    return low_x, high_x, low_y, high_y
