"""Shapes of targets: which side of its outline a beam that crossed its plane should tell.

A trial outline is a row of u, v (centre, m), turn (rad), size (m) and inner (share of the size
that a ring's dark inner disc takes, 0 for none).
"""

from math import log

import numpy as np
from numba import njit
from scipy.special import ndtr

PASSED, DARK, BRIGHT = -1, 0, 1  # what a beam did at the plane: went by, met dark, met bright
ROUND, SQUARE, CHECKERED = range(3)
FORMS = {
    "circle": ROUND,
    "hole": ROUND,
    "square": SQUARE,
    "board": SQUARE,
    "checkerboard": CHECKERED,
}
PERIOD = {"square": np.pi / 2, "board": np.pi / 2, "checkerboard": np.pi}  # of turn; rad
BY_EDGES = ("hole", "board")  # told by where beams pass, not by intensity
WRONG_SIDE = 0.01  # share of beams that tell the wrong side whatever their distance (mixed returns)
LOG_WRONG, LOG_RIGHT = log(WRONG_SIDE), log(1 - WRONG_SIDE)
CERTAIN = 5.0  # sigmas from the outline, beyond which only WRONG_SIDE counts
PER_SIGMA = 200  # entries of the tables, exact to 5e-6 between them


def diameter(kind, size):
    """Longest extent (m) of a shape of this size (m)."""
    return size * (1.0 if FORMS[kind] == ROUND else np.sqrt(2))


def sides(state, kind, by_edges):
    """Side (n,) that each beam tells: 1 inside, -1 outside; a checkerboard's state stays as is."""
    if kind == "checkerboard" and not by_edges:
        return state.astype(np.int8)
    if kind == "hole":
        inside = state == PASSED
    elif by_edges:
        inside = state != PASSED
    else:
        inside = state == BRIGHT
    return np.where(inside, 1, -1).astype(np.int8)


def form_of(kind, by_edges):
    """Form that the likelihood uses: by its edges, a checkerboard is a square like others."""
    return SQUARE if kind == "checkerboard" and by_edges else FORMS[kind]


@njit(cache=True)
def _within(x, y, half, inner, form):
    """Distance (m) inside the outline of a place in the shape's own axes, negative outside."""
    if form != 0:
        return half - max(abs(x), abs(y))
    radius = np.sqrt(x * x + y * y)
    return min(half - radius, radius - inner * half) if inner > 0 else half - radius


@njit(cache=True)
def _on_white(x, y):
    """Distance (m) from a checkerboard's crossing lines, positive on white."""
    return min(abs(x), abs(y)) if x * y > 0 else -min(abs(x), abs(y))


@njit(cache=True)
def distance_inside(points, outline, form):
    """Distance (n,) in m of points (n, 2) inside an outline (5,), negative outside."""
    cos, sin, distance = np.cos(outline[2]), np.sin(outline[2]), np.empty(len(points))
    for i in range(len(points)):
        du, dv = points[i, 0] - outline[0], points[i, 1] - outline[1]
        x, y = cos * du + sin * dv, cos * dv - sin * du
        distance[i] = _within(x, y, outline[3] / 2, outline[4], form)
    return distance


@njit(cache=True)
def distance_on_white(points, outline):
    """Distance (n,) in m of points (n, 2) from a checkerboard's crossing, positive on white."""
    cos, sin, distance = np.cos(outline[2]), np.sin(outline[2]), np.empty(len(points))
    for i in range(len(points)):
        du, dv = points[i, 0] - outline[0], points[i, 1] - outline[1]
        distance[i] = _on_white(cos * du + sin * dv, cos * dv - sin * du)
    return distance


def _table():
    """Probability that a beam tells inside, at every fraction of a sigma from the outline."""
    z = np.arange(-CERTAIN * PER_SIGMA, CERTAIN * PER_SIGMA + 2) / PER_SIGMA
    return WRONG_SIDE + (1 - 2 * WRONG_SIDE) * ndtr(z)


SHARE = _table()
LOG_SHARE = np.log(SHARE)


@njit(cache=True)
def _looked_up(table, z):
    """Value of a table between its entries, z sigmas inside and not farther than CERTAIN."""
    if np.isnan(z):  # of a beam along the plane
        return z
    place = (z + CERTAIN) * PER_SIGMA
    entry = int(place)
    return table[entry] + (place - entry) * (table[entry + 1] - table[entry])


@njit(cache=True)
def _share(distance, width):
    """Probability that a beam at this distance inside tells inside, blurred by width (m)."""
    if distance > CERTAIN * width:
        return 1.0 - WRONG_SIDE
    if distance < -CERTAIN * width:
        return WRONG_SIDE
    return _looked_up(SHARE, distance / width)


@njit(cache=True)
def _log_share(distance, width):
    """Logarithm of _share: quick where it is constant, which is nearly everywhere."""
    if distance > CERTAIN * width:
        return LOG_RIGHT
    if distance < -CERTAIN * width:
        return LOG_WRONG
    return _looked_up(LOG_SHARE, distance / width)


@njit(cache=True)
def log_likelihood(points, side, outlines, form, width):
    """Log likelihood (c,) of trial outlines (c, 5), given points (n, 2) and their sides (n,).

    Source: Bernoulli, each point inside or outside with a probability that falls across the
    outline as a normal distribution of this width (m). A checkerboard's sides are states: beside
    the board bright and dark are equally likely, on it no beam passes.
    """
    result = np.zeros(len(outlines))
    for c in range(len(outlines)):
        u, v, turn, size, inner = outlines[c]
        cos, sin, total = np.cos(turn), np.sin(turn), 0.0
        for i in range(len(points)):
            du, dv = points[i, 0] - u, points[i, 1] - v
            x, y = cos * du + sin * dv, cos * dv - sin * du
            within = _within(x, y, size / 2, inner, form)
            if form != 2:
                total += _log_share(within * side[i], width)
                continue
            if side[i] < 0:
                total += _log_share(-within, width)
                continue
            on_board = _share(within, width)
            white = _on_white(x, y) * (1 if side[i] == 1 else -1)
            total += np.log(on_board * _share(white, width) + (1.0 - on_board) * 0.5)
        result[c] = total
    return result
