"""How far bright points on a plane are those of a target's shape."""

import numpy as np
from numba import njit


@njit(cache=True)
def jaccard_index(
    uv: np.ndarray, bright: np.ndarray, longest: float, largest_ratio: float, directions: int
) -> float:
    """Largest share of common points of the bright ones and those in a shape that spans them.

    Parameters
    ----------
    uv : (n, 2) array
        Places in a plane. Units: m.
    bright : (n,) bool array
    longest : float
        The shape spans those that are no farther from the middle. Units: m.
    largest_ratio : float
        Of its length and width.
    directions : int
        In which it is measured.
    """
    spanned = bright & (uv[:, 0] ** 2 + uv[:, 1] ** 2 <= longest**2)
    best_area = np.inf
    turn = 0.0
    diameter = 0.0
    for step in range(directions):
        angle = np.pi / 2 * step / directions
        low_x, high_x, low_y, high_y = _extent(uv, spanned, angle)
        diameter += (high_x - low_x + high_y - low_y) / (2 * directions)
        if (high_x - low_x) * (high_y - low_y) < best_area:
            best_area = (high_x - low_x) * (high_y - low_y)
            turn = angle
    low_x, high_x, low_y, high_y = _extent(uv, spanned, turn)
    width = high_x - low_x
    height = high_y - low_y
    first = 0
    if max(width, height) > largest_ratio * min(width, height):
        # the white quadrants of a checkerboard fill the rectangle along their diagonal, which is
        # as small as their own; what fills a rectangle needs twice of it when turned by 45 deg
        turn = turn + np.pi / 4
        first = 2
        low_x, high_x, low_y, high_y = _extent(uv, spanned, turn)
        width = high_x - low_x
        height = high_y - low_y
        if not width * height < np.sqrt(2.0) * best_area:
            return 0.0
    if not 0.0 < max(width, height) <= largest_ratio * min(width, height):
        return 0.0
    both = np.zeros(4)
    either = np.zeros(4)
    inside = np.zeros(4, np.bool_)
    for i in range(len(uv)):
        x = np.cos(turn) * uv[i, 0] + np.sin(turn) * uv[i, 1] - (low_x + high_x) / 2
        y = np.cos(turn) * uv[i, 1] - np.sin(turn) * uv[i, 0] - (low_y + high_y) / 2
        inside[0] = x * x + y * y <= diameter**2 / 4
        inside[1] = abs(x) <= width / 2 and abs(y) <= height / 2
        inside[2] = inside[1] and x * y > 0
        inside[3] = inside[1] and x * y <= 0
        for shape in range(first, 4):
            both[shape] += inside[shape] and bright[i]
            either[shape] += inside[shape] or bright[i]
    return (both / np.maximum(either, 1.0)).max()


@njit(cache=True)
def _extent(uv, bright, angle):
    """Bounds of the bright points along a direction and across it."""
    low_x = np.inf
    high_x = -np.inf
    low_y = np.inf
    high_y = -np.inf
    cos = np.cos(angle)
    sin = np.sin(angle)
    for i in range(len(uv)):
        if bright[i]:
            x = cos * uv[i, 0] + sin * uv[i, 1]
            y = cos * uv[i, 1] - sin * uv[i, 0]
            low_x = min(low_x, x)
            high_x = max(high_x, x)
            low_y = min(low_y, y)
            high_y = max(high_y, y)
    return low_x, high_x, low_y, high_y
