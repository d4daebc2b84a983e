"""Bright components of a piece of cloud at several levels of intensity, as in a component tree.

A target is brighter than what surrounds it, but intensity falls with range and incidence, so no
single threshold serves. Each component at each level is a candidate; the shape decides.
"""

from collections.abc import Iterator
from functools import cache

import numpy as np
from numba import njit

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
    order, counts = np.argsort(label, kind="stable"), np.bincount(label)
    ends, large = np.cumsum(counts), np.flatnonzero(counts >= SETTINGS.smallest_count)
    return [order[ends[number] - counts[number] : ends[number]] for number in large]


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
    keys, shape = np.zeros(len(points), np.int64), []
    for column in points.T:  # one by one, as they are large where a street is dense
        cells = np.floor(column / (link / 3)).astype(np.int64)
        cells -= cells.min()
        shape.append(int(cells.max()) + 3)  # with room for two voxels: no edge is near another
        keys *= shape[-1]
        keys += cells
    del cells
    order = np.argsort(keys, kind="stable")
    label = np.empty(len(keys), np.int32)
    steps = _offsets(len(shape)) @ np.cumprod([1, *shape[:0:-1]])[::-1]
    keys = keys[order]
    label[order] = _labels(keys, steps[steps > 0])
    return label


@cache
def _offsets(dimensions):
    """Offsets (m, d) of voxels less than three apart; three apart is a tie of rounding."""
    around = np.stack(np.meshgrid(*[np.arange(-2, 3)] * dimensions), axis=-1)
    offsets = around.reshape(-1, dimensions)
    return offsets[np.sum(offsets**2, axis=1) < 9]


@njit(cache=True)
def _labels(keys, steps):
    """Component number (n,) of keys in increasing order, which these steps connect."""
    voxel, occupied, count = np.empty(len(keys), np.int32), np.empty_like(keys), 0
    for i in range(len(keys)):
        if count == 0 or keys[i] != occupied[count - 1]:
            occupied[count] = keys[i]
            count += 1
        voxel[i] = count - 1
    parent = np.arange(count)
    for step in steps:
        above = 0
        for low in range(count):
            key = occupied[low] + step
            while above < count and occupied[above] < key:
                above += 1
            if above == count:
                break
            if occupied[above] == key:
                a, b = root_of(parent, low), root_of(parent, above)
                parent[max(a, b)] = min(a, b)
    number, components = np.empty(count, np.int32), 0
    for i in range(count):  # the root of each is the lowest of its voxels
        is_root = parent[i] == i
        number[i] = components if is_root else number[root_of(parent, i)]
        components += is_root
    return number[voxel]


@njit(cache=True)
def root_of(parent: np.ndarray, i: int) -> int:
    """What stands for the component of i, with the way to it shortened.

    Parameters
    ----------
    parent : (n,) int array
        What each was joined with; of a root, itself.
    i : int
    """
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i
