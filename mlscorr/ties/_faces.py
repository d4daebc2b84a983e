"""Planes that lie in the face between two cells, and poles that the face cuts."""

import numpy as np

from mlscorr.ties.settings import SETTINGS

ROWS, COLUMNS = np.triu_indices(3)  # of the products: xx, xy, xz, yy, yz, zz


def join_across_faces(
    middle: np.ndarray, begin: np.ndarray, group: np.ndarray, moments: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Moments of cells, of which those of two that share a plane or pole in their face are joined.

    Each would hold half of the plane's noise, whose mean lies 0.8 sigmas off the plane, or a part
    of the pole, whose middle is not the whole's.

    Parameters
    ----------
    middle : (n, 3) array
        Of the cells. Units: m.
    begin : (n,) array
        Of the cells' moments. Units: s.
    group : (n,) int array
    moments : (n, 21) array
        See mlscorr.ties._cells.

    Returns
    -------
    joined : (n, 21) array
    way : (n, 3) array
        To the cells beyond, whose points stand in each one too, if there are any. Units: cells.
    """
    points = moments[:, 0]
    mean = moments[:, 2:5] / points[:, None]
    spread = moments[:, [5, 8, 10]] / points[:, None] - mean**2
    spread = np.sqrt(np.maximum(spread, SETTINGS.rounding**2))
    # a pole's points are spread by its radius over sqrt(3), which along both axes no wall's are,
    # and more along it; of a square one a cell may hold one side, beyond which it is as wide
    widest = np.minimum(SETTINGS.thickest / np.sqrt(3), spread[:, 2:])
    is_pole = (spread[:, :2] <= widest).all(axis=1, keepdims=True)
    spread[:, :2] = np.where(is_pole, spread[:, :2].max(axis=1, keepdims=True), spread[:, :2])
    is_thin = (spread <= SETTINGS.roughest) | (is_pole & [True, True, False])
    # 99 % of a plane's noise lies within 2.5 sigmas
    is_cut = is_thin & (points >= SETTINGS.feature_points)[:, None]
    is_cut &= SETTINGS.cell / 2 - np.abs(mean) < 2.5 * spread
    rank = np.argsort(np.argsort(points, kind="stable"))
    joined = moments.copy()
    ways = np.zeros_like(mean)
    for axis in np.flatnonzero(is_cut.any(axis=0)):
        rows = np.flatnonzero(is_cut[:, axis])
        way = np.sign(mean[rows, axis, None]) * np.eye(3)[axis]
        ways[rows] += way
        beyond = _cells_at(middle, begin, group, rows, way)
        rows, beyond, way = (part[beyond >= 0] for part in (rows, beyond, way))
        is_half = is_cut[beyond, axis] & (mean[beyond, axis] * way[:, axis] < 0)
        kept = ~(is_half & (rank[rows] < rank[beyond]))  # the smaller half takes part there
        rows, beyond, way, is_half = (part[kept] for part in (rows, beyond, way, is_half))
        joined[rows] += _moved(joined[beyond], SETTINGS.cell * way)
        joined[beyond[is_half]] = 0.0
    return joined, ways


def _cells_at(middle, begin, group, rows, way):
    """Rows (k,) of the cells a way of cells (k, 3) from rows, of their moment and group; or -1."""
    place = np.round((middle - middle.min(axis=0)) / SETTINGS.cell).astype(np.int64) + 1
    own = np.unique(np.column_stack([begin, group]), axis=0, return_inverse=True)[1].ravel()
    size = (own.max() + 1, *(place.max(axis=0) + 2))
    keys = np.ravel_multi_index((own, *place.T), size)
    partner = np.ravel_multi_index((own[rows], *(place[rows] + way.astype(np.int64)).T), size)
    order = np.argsort(keys)
    nearest = order[np.minimum(np.searchsorted(keys, partner, sorter=order), len(keys) - 1)]
    return np.where(keys[nearest] == partner, nearest, -1)


def _moved(moments, way):
    """Moments (k, 21) about the middle of cells a way (k, 3) before. Units of the way: m."""
    points = moments[:, :1]
    sums = moments[:, 2:5]
    moved = moments.copy()
    moved[:, 2:5] += points * way
    cross = sums[:, ROWS] * way[:, COLUMNS] + way[:, ROWS] * sums[:, COLUMNS]
    moved[:, 5:11] += cross + points * way[:, ROWS] * way[:, COLUMNS]
    moved[:, 18:21] += moments[:, 1:2] * way
    return moved
