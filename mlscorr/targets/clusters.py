"""Bright components of a cloud at several levels of intensity, as in a component tree.

A target is brighter than what surrounds it, but intensity falls with range and incidence, so no
single threshold serves. Each component at each level is a candidate; the shape decides.
"""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

LEVELS = 16  # between the darkest and the brightest point of a region, in equal ratios
FEWEST_POINTS = 20  # on a target: fewer can't tell plane and outline
LINK_SHARES = 0.2, 0.4  # of the target's size: beside a bright post; with wide scan lines
BACKGROUND = 4.0  # times the points of the fullest place: so many bright ones are road and walls
NEIGHBOURS = 2.9  # voxels, a third of the link each: 3 would be a tie that rounding decides
CHEAP = 1500  # bright points that are looked at in any case


def split_by_time(gps_time, pause):
    """Runs of points without a pause longer than this (s): a list of index arrays, in time."""
    order = np.argsort(gps_time, kind="stable")
    breaks = np.flatnonzero(np.diff(gps_time[order]) > pause) + 1
    return np.split(order, breaks)


def bright_components(xyz, intensity, size):
    """Index arrays of connected components of points brighter than each of several levels.

    Parameters
    ----------
    xyz : (n, 3) array
        Units: m.
    intensity : (n,) array
        Of any positive scale.
    size : float
        Of a target; points closer than a share of it belong together. Units: m.

    Yields (level, rows); a component that stays the same over levels comes once, at the highest.
    """
    low, high = np.percentile(intensity, 1), intensity.max()
    background = max(BACKGROUND * _fullest(xyz, size), len(intensity) / 4, CHEAP)
    seen, last = set(), 0
    for level in np.geomspace(max(high, 1.0), max(low, 1.0), LEVELS + 1)[1:]:
        bright = np.flatnonzero(intensity >= level)
        if len(bright) < FEWEST_POINTS or len(bright) == last:
            continue
        last = len(bright)
        if len(bright) > background:
            return
        parts = (part for share in LINK_SHARES for part in _components(xyz, bright, share * size))
        for rows in parts:
            if len(rows) >= FEWEST_POINTS and (key := (rows[0], rows[-1], len(rows))) not in seen:
                seen.add(key)
                yield float(level), rows


def _fullest(xyz, size):
    """Number of points in the fullest cube of a target's size."""
    return np.unique(_keys(_cells(xyz, size)), return_counts=True)[1].max()


def _cells(xyz, edge):
    """Cube (n, 3) of this edge (m) that each point lies in, counted from the lowest."""
    cells = np.floor(xyz / edge).astype(np.int64)
    return cells - cells.min(axis=0)


def _keys(cells):
    """One number (n,) for each cube, in the order of its coordinates."""
    span = cells.max(axis=0) + 1
    return (cells[:, 0] * span[1] + cells[:, 1]) * span[2] + cells[:, 2]


def _components(xyz, rows, link):
    """Rows of each connected component among some rows, each in order."""
    label = connected(xyz[rows], link)
    order = np.argsort(label, kind="stable")
    return np.split(rows[order], np.flatnonzero(np.diff(label[order])) + 1)


def connected(xyz, link):
    """Component number of each point: occupied voxels first, so that density costs nothing."""
    if len(xyz) == 0:
        return np.empty(0, int)
    cells = _cells(xyz, link / 3)
    _, first, cell_of = np.unique(_keys(cells), return_index=True, return_inverse=True)
    cells = cells[first]
    pairs = cKDTree(cells).query_pairs(NEIGHBOURS, output_type="ndarray").T
    graph = coo_array((np.ones(pairs.shape[1], bool), pairs), shape=(len(cells),) * 2)
    return connected_components(graph, directed=False)[1][cell_of]
