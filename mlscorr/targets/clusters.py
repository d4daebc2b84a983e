"""Bright components of a piece of cloud at several levels of intensity, as in a component tree.

A target is brighter than what surrounds it, but intensity falls with range and incidence, so no
single threshold serves. Each component at each level is a candidate; the shape decides.
"""

from collections.abc import Iterator

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from mlscorr.targets.settings import SETTINGS


def bright_components(
    xyz: np.ndarray, intensity: np.ndarray, size: float
) -> Iterator[tuple[float, np.ndarray]]:
    """Connected components of points brighter than each of several levels.

    Parameters
    ----------
    xyz : (n, 3) array
        Units: m.
    intensity : (n,) array
        Of any positive scale.
    size : float
        Of a target; points closer than a share of it belong together. Units: m.

    Yields
    ------
    level : float
    rows : (k,) int array
        A component that stays the same over levels comes once, at the highest.
    """
    low, high = np.percentile(intensity, 1), intensity.max()
    background = max(SETTINGS.cheap_count, len(intensity) / 4)
    known, last = set(), 0
    levels = np.geomspace(max(high, 1.0), max(low, 1.0), SETTINGS.intensity_steps + 1)
    for level in levels[1:]:
        bright = np.flatnonzero(intensity >= level)
        if len(bright) < SETTINGS.smallest_count or len(bright) == last:
            continue
        if len(bright) > background:
            return
        last = len(bright)
        for share in SETTINGS.link_shares:
            for part in components(xyz[bright], share * size):
                rows = bright[part]
                if (key := (rows[0], rows[-1], len(rows))) not in known:
                    known.add(key)
                    yield float(level), rows


def _cells(xyz, edge):
    """Cube (n, d) of this edge (m) that each point lies in, counted from the lowest."""
    cells = np.floor(xyz / edge).astype(np.int64)
    return cells - cells.min(axis=0)


def components(points: np.ndarray, link: float) -> list[np.ndarray]:
    """Connected components of enough points to be a target.

    Parameters
    ----------
    points : (n, d) array
        Units: m.
    link : float
        Points as near as this belong together. Units: m.

    Returns
    -------
    list of int arrays
        Rows of each, in order.
    """
    label = connected(points, link)
    order = np.argsort(label, kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(label[order])) + 1)
    return [part for part in parts if len(part) >= SETTINGS.smallest_count]


def connected(points: np.ndarray, link: float) -> np.ndarray:
    """Component number of each point: occupied voxels first, so that density costs nothing.

    Parameters
    ----------
    points : (n, d) array
        In two dimensions or three. Units: m.
    link : float
        Points as near as this belong together. Units: m.

    Returns
    -------
    (n,) int array
    """
    if len(points) == 0:
        return np.empty(0, int)
    cells = _cells(points, link / 3)
    keys = np.ravel_multi_index(tuple(cells.T), cells.max(axis=0) + 1)
    _, first, cell_of = np.unique(keys, return_index=True, return_inverse=True)
    cells = cells[first]
    link_cells = np.nextafter(3.0, 0.0)  # three voxels apart is a tie that rounding would decide
    pairs = cKDTree(cells).query_pairs(link_cells, output_type="ndarray").T
    graph = coo_array((np.ones(pairs.shape[1], bool), pairs), shape=(len(cells),) * 2)
    return connected_components(graph, directed=False)[1][cell_of]
