"""Bright components of a piece of cloud at every level of intensity: a component tree.

A target is brighter than what surrounds it, but intensity falls with range and incidence, so no
single threshold serves. Each component at each level is a candidate; the shape decides. Levels are
absolute and a component is judged by itself: what else a piece holds, as a bright wall some meters
away, hides none (Najman and Couprie 2006). Neighbours are found by voxels in a hash table.
"""

from collections.abc import Iterator
from functools import cache

import numpy as np
from scipy.sparse import coo_array

from mlscorr.compiled_loops import loop
from mlscorr.targets.settings import SETTINGS

EMPTY = -1
OCTAVE = 2  # levels of intensity: a step is the least by which dark and bright are told apart


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
        A component that stays the same over levels comes once, at the highest. One that reaches
        farther than a target and its post is none of them.
    """
    level = np.floor(OCTAVE * np.log2(np.maximum(intensity, 1.0))).astype(np.int16)
    known = set()
    for share in SETTINGS.link_shares:
        for number, rows in _component_tree(xyz, level, share * size):
            key = rows[0], rows[-1], len(rows)
            if key not in known:
                known.add(key)
                yield float(2.0 ** (number / OCTAVE)), rows


def _component_tree(xyz, level, link):
    """(level, rows in order) of the components of points (n, 3) that a link (m) connects."""
    if len(xyz) == 0:
        return
    edge = link / 2
    low = np.array([column.min() for column in xyz.T])
    low = (np.floor(low / edge) - 1) * edge  # the same cells whatever else there is
    voxel, keys_of, *table = number_voxels(xyz, low, edge)
    brightest_first = np.argsort(-level, kind="stable")
    limits = SETTINGS.smallest_count, 2 * SETTINGS.near_radius
    entries, place = _grow(xyz, level, brightest_first, voxel, keys_of, *table, limits)
    order = np.argsort(place[voxel], kind="stable")
    sorted_place = place[voxel[order]]
    for number, first, count in entries:
        start, end = np.searchsorted(sorted_place, (first, first + count))
        rows = order[start:end]
        yield number, np.sort(rows[level[rows] >= number])


@loop
def _grow(xyz, level, brightest_first, voxel, keys_of, keys, number, limits):
    """Components as voxels join them from the brightest level down.

    A component is a run of voxels in the order of their places, as joining two puts one's voxels
    behind the other's: its level, its first place and its number of voxels (k, 3) describe it.
    Places (v,) of the voxels come too.
    """
    smallest, largest = limits
    count = len(keys_of)
    parent = np.full(count, -1)
    chain = np.full(count, -1), np.arange(count)  # the voxel behind each, the last of each root
    sums = np.zeros((2, count), np.int64)  # voxels and points of each root
    box = np.full((3, count), np.inf), np.full((3, count), -np.inf)
    touched = np.full(count, -1)
    entries = np.empty((len(xyz), 3), np.int64)  # each has a point that none before it has
    length = 0
    start = 0
    n = len(brightest_first)
    while start < n:
        now = level[brightest_first[start]]
        end = start
        while end < n and level[brightest_first[end]] == now:
            row = brightest_first[end]
            new = voxel[row]
            if parent[new] < 0:
                parent[new] = new
                sums[0, new] = 1
                for near in neighbours(keys_of[new], keys, number):
                    if parent[near] >= 0:
                        _join(parent, chain, sums, box, new, near)
            root = root_of(parent, new)
            sums[1, root] += 1
            for axis in range(3):
                box[0][axis, root] = min(box[0][axis, root], xyz[row, axis])
                box[1][axis, root] = max(box[1][axis, root], xyz[row, axis])
            end += 1
        for k in range(start, end):
            root = root_of(parent, voxel[brightest_first[k]])
            if touched[root] == now:
                continue
            touched[root] = now
            extent = 0.0
            for axis in range(3):
                extent = max(extent, box[1][axis, root] - box[0][axis, root])
            if sums[1, root] >= smallest and extent <= largest:
                entries[length, 0] = now
                entries[length, 1] = root
                entries[length, 2] = sums[0, root]
                length += 1
        start = end
    place = _places(parent, chain[0])
    for entry in range(length):  # a root is its component's first voxel
        entries[entry, 1] = place[entries[entry, 1]]
    return entries[:length].copy(), place


@loop
def _join(parent, chain, sums, box, voxel, beside):
    """Join the components of two voxels, the smaller's voxels behind the larger's."""
    a = root_of(parent, voxel)
    b = root_of(parent, beside)
    if a == b:
        return
    if sums[0, a] < sums[0, b]:
        a, b = b, a
    behind, last = chain
    parent[b] = a
    behind[last[a]] = b
    last[a] = last[b]
    for row in range(2):
        sums[row, a] += sums[row, b]
    for axis in range(3):
        box[0][axis, a] = min(box[0][axis, a], box[0][axis, b])
        box[1][axis, a] = max(box[1][axis, a], box[1][axis, b])


@loop
def _places(parent, behind):
    """Place (v,) of each voxel when all components follow each other."""
    place_of = np.empty(len(parent), np.int64)
    place = 0
    for root in range(len(parent)):
        member = root if parent[root] == root else -1
        while member >= 0:
            place_of[member] = place
            place += 1
            member = behind[member]
    return place_of


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
    counts = np.bincount(label)
    ends = np.cumsum(counts)
    large = np.flatnonzero(counts >= SETTINGS.smallest_count)
    return [order[ends[number] - counts[number] : ends[number]] for number in large]


def connected(points: np.ndarray, link: float) -> np.ndarray:
    """Component number of each point: occupied voxels first, so that density costs nothing.

    Parameters
    ----------
    points : (n, d) array
        In two dimensions or three. Units: m.
    link : float
        Points about as near as this belong together: in the plane the limit is between 0.67 and
        1.41 of it, in space between 0.47 and 1.45, as they lie in their voxels. Units: m.

    Returns
    -------
    (n,) int array

    Notes
    -----
    Of real calls, ``benchmarks/bench_libraries.py`` measured against DBSCAN, which keeps the link
    exactly: parts of flat patches take Open3D 3 times and scikit-learn 23 times as long, and 15 %
    of them are parted otherwise; 626 000 points take Open3D 113 times as long (Rand index 0.998).
    """
    if len(points) == 0:
        return np.empty(0, int)
    keys = np.zeros(len(points), np.int64)
    shape = []
    for column in points.T:  # one by one, as they are large where a street is dense
        cells = np.floor(column / (link / 3)).astype(np.int64)
        cells -= cells.min()
        shape.append(int(cells.max()) + 3)  # with room for two voxels: no edge is near another
        keys *= shape[-1]
        keys += cells
    del cells
    order = np.argsort(keys, kind="stable")
    steps = _offsets(len(shape)) @ np.cumprod([1, *shape[:0:-1]])[::-1]
    keys = keys[order]
    is_first = np.diff(keys, prepend=keys[0] - 1) > 0
    occupied = keys[is_first]
    parent = np.arange(len(occupied))
    _link(occupied, steps[steps > 0], parent)
    number = np.cumsum(parent == np.arange(len(parent)), dtype=np.int32) - 1
    voxel = np.cumsum(is_first, dtype=np.int32) - 1
    label = np.empty(len(keys), np.int32)
    label[order] = number[parent][voxel]
    return label


@cache
def _offsets(dimensions):
    """Offsets (m, d) of voxels less than three apart; three apart is a tie of rounding."""
    around = np.stack(np.meshgrid(*[np.arange(-2, 3)] * dimensions), axis=-1)
    offsets = around.reshape(-1, dimensions)
    return offsets[np.sum(offsets**2, axis=1) < 9]


@loop
def _link(occupied, steps, parent):
    """Give voxels (v,) by their rising keys the lowest of those that steps connect for a parent."""
    count = len(occupied)
    for step in steps:
        above = 0
        for low in range(count):
            key = occupied[low] + step
            while above < count and occupied[above] < key:
                above += 1
            if above == count:
                break
            if occupied[above] == key:
                a = root_of(parent, low)
                b = root_of(parent, above)
                parent[max(a, b)] = min(a, b)
    for i in range(count):
        parent[i] = root_of(parent, i)


@loop
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


@loop
def number_voxels(xyz: np.ndarray, low: np.ndarray, edge: float) -> tuple[np.ndarray, ...]:
    """Number the occupied cubes.

    Parameters
    ----------
    xyz : (n, 3) array
        Units: m.
    low : (3,) array
        Not above any of them. Units: m.
    edge : float
        Units: m.

    Returns
    -------
    of_point : (n,) int array
        Number of each point's cube.
    keys_of : (c,) int array
        Key of each cube.
    keys, number : (t,) int arrays
        The hash table, for ``neighbours``.
    """
    size = 1024
    keys = np.full(size, EMPTY)
    number = np.empty(size, np.int64)
    of_point = np.empty(len(xyz), np.int32)
    known = np.empty(len(xyz), np.int64)
    count = 0
    last_key = np.int64(EMPTY)
    last = 0
    for i in range(len(xyz)):
        key = key_of(xyz[i, 0] - low[0], xyz[i, 1] - low[1], xyz[i, 2] - low[2], edge)
        if key != last_key:
            slot = _slot(keys, key)
            if keys[slot] == EMPTY:
                keys[slot] = key
                number[slot] = count
                known[count] = key
                count += 1
                if 2 * count > size:
                    size *= 4
                    keys = np.full(size, EMPTY)
                    number = np.empty(size, np.int64)
                    for k in range(count):
                        slot = _slot(keys, known[k])
                        keys[slot] = known[k]
                        number[slot] = k
                    slot = _slot(keys, key)
            last_key = key
            last = number[slot]
        of_point[i] = last
    return of_point, known[:count].copy(), keys, number


def sort_by_voxel(cell: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows (n,) sorted by cell, and where each cell starts among them (count + 1,).

    Parameters
    ----------
    cell : (n,) int array
        Number of each point's cell.
    count : int
        Of cells.
    """
    rows = np.arange(len(cell))  # a matrix sorts its entries by counting
    matrix = coo_array((rows, (cell, rows)), shape=(count, len(cell))).tocsr()
    return matrix.indices, matrix.indptr


@loop(cache=False)  # numba can't call a generator that it read from its cache
def neighbours(key: int, keys: np.ndarray, number: np.ndarray) -> Iterator[int]:
    """Numbers of the occupied cubes among the 27 about a key.

    Parameters
    ----------
    key : int
    keys, number : (t,) int arrays
        The hash table of ``number_voxels``.
    """
    for dx in range(-1, 2):
        for dy in range(-1, 2):
            for dz in range(-1, 2):
                beside = key + (dx << 42) + (dy << 21) + dz
                if beside >= 0:
                    slot = _slot(keys, beside)
                    if keys[slot] == beside:
                        yield number[slot]


@loop
def key_of(x: float, y: float, z: float, edge: float) -> np.int64:
    """Key of the cube that holds a place.

    Parameters
    ----------
    x, y, z, edge : float
        Units: m.
    """
    return (np.int64(x / edge) << 42) | (np.int64(y / edge) << 21) | np.int64(z / edge)


@loop
def _slot(keys, key):
    """Where a key stands, or would stand, in an open hash table of a power of two."""
    mask = len(keys) - 1
    slot = ((key ^ (key >> 23)) * np.int64(-7046029254386353131)) >> 20 & mask
    while keys[slot] != EMPTY and keys[slot] != key:
        slot = (slot + 1) & mask
    return slot
