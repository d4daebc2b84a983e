"""Planes that lie in the face between two cells."""

import numpy as np

from mlscorr.ties.settings import SETTINGS

ROWS, COLUMNS = np.triu_indices(3)  # of the products: xx, xy, xz, yy, yz, zz


def join_across_faces(
    middle: np.ndarray, begin: np.ndarray, group: np.ndarray, moments: np.ndarray
) -> np.ndarray:
    """Moments (n, 21) of cells; those of two that share a plane in their face stand in one.

    Each would hold half of the plane's noise, whose mean lies 0.8 sigmas off the plane.

    Parameters
    ----------
    middle : (n, 3) array
        Of the cells. Units: m.
    begin : (n,) array
        Of the cells' moments. Units: s.
    group : (n,) int array
    moments : (n, 21) array
        See mlscorr.ties.cells.
    """
    points = moments[:, 0]
    mean = moments[:, 2:5] / points[:, None]
    spread = moments[:, [5, 8, 10]] / points[:, None] - mean**2
    spread = np.sqrt(np.maximum(spread, SETTINGS.rounding**2))
    # 99 % of a plane's noise lies within 2.5 sigmas
    is_cut = (spread <= SETTINGS.roughest) & (points >= SETTINGS.points)[:, None]
    is_cut &= SETTINGS.cell / 2 - np.abs(mean) < 2.5 * spread
    joined = moments.copy()
    for axis in np.flatnonzero(is_cut.any(axis=0)):
        rows = np.flatnonzero(is_cut[:, axis])
        way = np.sign(mean[rows, axis, None]) * np.eye(3)[axis]
        beyond = _cells_at(middle, begin, group, rows, way)
        rows, beyond, way = (part[beyond >= 0] for part in (rows, beyond, way))
        is_half = is_cut[beyond, axis] & (mean[beyond, axis] * way[:, axis] < 0)
        is_less = (points[rows] < points[beyond]) | (points[rows] == points[beyond]) & (
            rows > beyond
        )
        kept = ~(is_half & is_less)  # it takes part there
        rows, beyond, way, is_half = (part[kept] for part in (rows, beyond, way, is_half))
        joined[rows] += _moved(joined[beyond], SETTINGS.cell * way)
        joined[beyond[is_half]] = 0.0
    return joined


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
    points, sums, moved = moments[:, :1], moments[:, 2:5], moments.copy()
    moved[:, 2:5] += points * way
    cross = sums[:, ROWS] * way[:, COLUMNS] + way[:, ROWS] * sums[:, COLUMNS]
    moved[:, 5:11] += cross + points * way[:, ROWS] * way[:, COLUMNS]
    moved[:, 18:21] += moments[:, 1:2] * way
    return moved
