"""Shapes of targets: the side of the outline on which a beam is expected to fall.

A trial outline is a row of u, v (center, m), turn (rad), size (m) and inner (dark inner disc of a
ring as a share of the size, 0 for none).
"""

from functools import cache

import numpy as np
from scipy.special import ndtr

from mlscorr.compiled_loops import loop
from mlscorr.targets.settings import SETTINGS

# state of a beam at the plane: passed by, dark, bright
MISS = -1
DARK = 0
BRIGHT = 1
ROUND, SQUARE, CHECKERED, WHITE = range(4)  # WHITE: a checkerboard's, unbounded
FORMS = {
    "circle": ROUND,
    "hole": ROUND,
    "square": SQUARE,
    "board": SQUARE,
    "checkerboard": CHECKERED,
}
PERIOD = {"square": np.pi / 2, "board": np.pi / 2, "checkerboard": np.pi}  # of turn; rad
BY_EDGES = ("hole", "board")  # recognized by passing beams, not by intensity
TABLE_SIGMAS = 5.0  # from the outline, beyond which a beam's position gives no more information
TABLE_STEPS = 200  # steps per sigma: the tables are accurate to 5e-6 between them


def diameter(kind: str, size: float) -> float:
    """Longest extent (m) of a shape.

    Parameters
    ----------
    kind : str
    size : float
        Units: m.
    """
    if FORMS[kind] == ROUND:
        return size
    return size * np.sqrt(2)


def sides(state: np.ndarray, kind: str, by_edges: bool) -> np.ndarray:
    """Side (n,) of each beam: 1 inside, -1 outside; a checkerboard keeps the state.

    Parameters
    ----------
    state : (n,) int array
        BRIGHT, DARK or MISS.
    kind : str
    by_edges : bool
        True if intensity gives no information.
    """
    if kind == "checkerboard" and not by_edges:
        return state.astype(np.int8)
    if kind == "hole":
        inside = state == MISS
    elif by_edges:
        inside = state != MISS
    else:
        inside = state == BRIGHT
    return np.where(inside, 1, -1).astype(np.int8)


def form_of(kind: str, by_edges: bool) -> int:
    """Form used by the likelihood; by its edges, a checkerboard is a square like others.

    Parameters
    ----------
    kind : str
    by_edges : bool
        True if intensity gives no information.
    """
    if kind == "checkerboard" and by_edges:
        return SQUARE
    return FORMS[kind]


@loop
def _within(x, y, half, inner, form):
    """Distance (m) inside the outline of a position in the shape's own axes, negative outside."""
    if form == WHITE:
        if x * y > 0:
            return min(abs(x), abs(y))
        return -min(abs(x), abs(y))
    if form != ROUND:
        return half - max(abs(x), abs(y))
    radius = np.sqrt(x * x + y * y)
    if inner > 0:
        return min(half - radius, radius - inner * half)
    return half - radius


@loop
def distance_inside(points: np.ndarray, outline: np.ndarray, form: int) -> np.ndarray:
    """Distance (n,) of points inside an outline, negative outside. Units: m.

    Parameters
    ----------
    points : (n, 2) array
        Units: m.
    outline : (5,) array
        A row of trial outlines.
    form : int
        WHITE gives the distance from a checkerboard's crossing lines, positive on white.
    """
    cos = np.cos(outline[2])
    sin = np.sin(outline[2])
    distance = np.empty(len(points))
    for i in range(len(points)):
        du = points[i, 0] - outline[0]
        dv = points[i, 1] - outline[1]
        x = cos * du + sin * dv
        y = cos * dv - sin * du
        distance[i] = _within(x, y, outline[3] / 2, outline[4], form)
    return distance


@cache
def _tables(wrong):
    """Probability that a beam falls inside, at fractions of sigma around the outline, and its
    log.
    """
    z = np.arange(-TABLE_SIGMAS * TABLE_STEPS, TABLE_SIGMAS * TABLE_STEPS + 2) / TABLE_STEPS
    share = wrong + (1 - 2 * wrong) * ndtr(z)
    return share, np.log(share)


@loop
def _from_table(table, distance, width):
    """Value at a distance inside the outline; fast where it is constant, which is nearly
    everywhere.
    """
    if distance > TABLE_SIGMAS * width:
        return table[-2]
    if distance < -TABLE_SIGMAS * width:
        return table[0]
    if np.isnan(distance):  # of a beam parallel to the plane
        return distance
    place = (distance / width + TABLE_SIGMAS) * TABLE_STEPS
    entry = int(place)
    return table[entry] + (place - entry) * (table[entry + 1] - table[entry])


def log_likelihood(
    points: np.ndarray, side: np.ndarray, outlines: np.ndarray, form: int, width: float
) -> np.ndarray:
    """Log likelihood (c,) of trial outlines, given the beams' positions and sides.

    Parameters
    ----------
    points : (n, 2) array
        Units: m.
    side : (n,) int array
    outlines : (c, 5) array
    form : int
    width : float
        One sigma of a beam's position. Units: m.

    The model is Bernoulli: each point is inside or outside with a probability that decreases across
    the outline as a normal distribution of this width. A checkerboard's sides are states: next to
    the board bright and dark are equally likely, and no beam passes through it.
    """
    return _log_likelihood(points, side, outlines, form, width, *_tables(SETTINGS.wrong_side))


@loop
def _log_likelihood(points, side, outlines, form, width, share, log_share):
    result = np.zeros(len(outlines))
    for c in range(len(outlines)):
        u, v, turn, size, inner = outlines[c]
        cos = np.cos(turn)
        sin = np.sin(turn)
        total = 0.0
        for i in range(len(points)):
            du = points[i, 0] - u
            dv = points[i, 1] - v
            x = cos * du + sin * dv
            y = cos * dv - sin * du
            within = _within(x, y, size / 2, inner, form)
            if form != CHECKERED:
                total += _from_table(log_share, within * side[i], width)
                continue
            if side[i] < 0:
                total += _from_table(log_share, -within, width)
                continue
            on_board = _from_table(share, within, width)
            white = _within(x, y, size / 2, inner, WHITE) * (1 if side[i] == 1 else -1)
            right = _from_table(share, white, width)
            total += np.log(on_board * right + (1.0 - on_board) * 0.5)
        result[c] = total
    return result
