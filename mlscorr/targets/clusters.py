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
    seen = set()
    for level in np.geomspace(max(high, 1.0), max(low, 1.0), LEVELS + 1)[1:]:
        bright = np.flatnonzero(intensity >= level)
        if len(bright) < FEWEST_POINTS:
            continue
        if len(bright) > background:
            return
        parts = (part for share in LINK_SHARES for part in _components(xyz, bright, share * size))
        for rows in parts:
            if len(rows) >= FEWEST_POINTS and (key := (rows[0], rows[-1], len(rows))) not in seen:
                seen.add(key)
                yield float(level), rows


def _fullest(xyz, size):
    """Number of points in the fullest cube of a target's size."""
    return np.unique(np.floor(xyz / size).astype(np.int64), axis=0, return_counts=True)[1].max()


def _components(xyz, rows, link):
    """Rows of each connected component among some rows, each in order."""
    label = connected(xyz[rows], link)
    order = np.argsort(label, kind="stable")
    return np.split(rows[order], np.flatnonzero(np.diff(label[order])) + 1)


def connected(xyz, link):
    """Component number of each point: occupied voxels first, so that density costs nothing."""
    voxel = link / 3
    cells, cell_of = np.unique(np.floor(xyz / voxel).astype(np.int64), axis=0, return_inverse=True)
    pairs = cKDTree(cells * voxel).query_pairs(link, output_type="ndarray").T
    graph = coo_array((np.ones(pairs.shape[1], bool), pairs), shape=(len(cells),) * 2)
    return connected_components(graph, directed=False)[1][cell_of.ravel()]
