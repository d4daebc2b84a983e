"""Bright components of a piece of cloud at every level of intensity: a component tree.

A target is brighter than what surrounds it, but intensity falls with range and incidence, so no
single threshold works. Each component at each level is a candidate; the shape decides. Levels are
absolute, and a component is judged by itself: other objects, such as a bright wall some meters
away, do not hide it (Najman and Couprie 2006). Neighbors are found by voxels in a hash table.
"""

from collections.abc import Iterator
from functools import cache

import numpy as np
from scipy.sparse import coo_array

from mlscorr.compiled_loops import loop
from mlscorr.targets.settings import SETTINGS

EMPTY = -1
OCTAVE = 2  # levels of intensity: a step is the smallest contrast of dark and bright


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
        A component that is the same at several levels is returned once, at the highest. Components
        larger than a target and its post are omitted.
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
    """Pairs (level, sorted rows) of the components of points (n, 3) connected by a link (m)."""
    if len(xyz) == 0:
        return
    edge = link / 2
    low = np.array([column.min() for column in xyz.T])
    low = (np.floor(low / edge) - 1) * edge  # the same cells whatever other points there are
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
    """Grow components as voxels join them from the brightest level down.

    A component is a run of voxels in the order of their positions, because joining two appends
    one's voxels to the other's. It is described by its level, its first position and its number of
    voxels (k, 3). Positions (v,) of the voxels are also returned.
    """
    smallest, largest = limits
    count = len(keys_of)
    parent = np.full(count, -1)
    chain = np.full(count, -1), np.arange(count)  # next voxel of each, last of each root
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
def _join(parent, chain, sums, box, voxel, neighbor):
    """Join the components of two voxels, appending the smaller one's voxels to the larger one's."""
    a = root_of(parent, voxel)
    b = root_of(parent, neighbor)
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
    """Position (v,) of each voxel if all components follow each other."""
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
    """Connected components with enough points to be a target.

    Parameters
    ----------
    points : (n, d) array
        Units: m.
    link : float
        Points within this distance belong together. Units: m.

    Returns
    -------
    list of int arrays
        Sorted rows of each component.
    """
    label = connected(points, link)
    order = np.argsort(label, kind="stable")
    counts = np.bincount(label)
    ends = np.cumsum(counts)
    large = np.flatnonzero(counts >= SETTINGS.smallest_count)
    return [order[ends[number] - counts[number] : ends[number]] for number in large]


def connected(points: np.ndarray, link: float) -> np.ndarray:
    """Component number of each point, by occupied voxels, so that density does not cost time.

    Parameters
    ----------
    points : (n, d) array
        In two dimensions or three. Units: m.
    link : float
        Points within about this distance belong together. Depending on their position in voxels,
        the limit is 0.67 to 1.41 of it in the plane, and 0.47 to 1.45 in space. Units: m.

    Returns
    -------
    (n,) int array

    Notes
    -----
    ``benchmarks/bench_libraries.py`` compares real calls with DBSCAN, which uses the exact link.
    For parts of flat patches, Open3D takes 3 times and scikit-learn 23 times as long, and 15 % of
    them are split differently. For 626 000 points, Open3D takes 113 times as long (Rand index
    0.998).
    """
    if len(points) == 0:
        return np.empty(0, int)
    keys = np.zeros(len(points), np.int64)
    shape = []
    for column in points.T:  # one by one, because they are large in dense streets
        cells = np.floor(column / (link / 3)).astype(np.int64)
        cells -= cells.min()
        shape.append(int(cells.max()) + 3)  # two voxels of margin separate the edges
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
    """Offsets (m, d) of voxels at distances below three; exactly three would depend on rounding."""
    around = np.stack(np.meshgrid(*[np.arange(-2, 3)] * dimensions), axis=-1)
    offsets = around.reshape(-1, dimensions)
    return offsets[np.sum(offsets**2, axis=1) < 9]


@loop
def _link(occupied, steps, parent):
    """Give voxels (v,), sorted by key, the lowest voxel that steps connect as parent."""
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
    """Return the root of the component of i, and shorten the path to it.

    Parameters
    ----------
    parent : (n,) int array
        Parent of each; a root is its own parent.
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
        Not above any point. Units: m.
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
    """Sort rows (n,) by cell, and return the start of each cell among them (count + 1,).

    Parameters
    ----------
    cell : (n,) int array
        Number of each point's cell.
    count : int
        Number of cells.
    """
    rows = np.arange(len(cell))  # a sparse matrix sorts its entries by counting
    matrix = coo_array((rows, (cell, rows)), shape=(count, len(cell))).tocsr()
    return matrix.indices, matrix.indptr


@loop(cache=False)  # numba cannot call a generator that it read from its cache
def neighbours(key: int, keys: np.ndarray, number: np.ndarray) -> Iterator[int]:
    """Yield the numbers of the occupied cubes among the 27 around a key.

    Parameters
    ----------
    key : int
    keys, number : (t,) int arrays
        The hash table of ``number_voxels``.
    """
    for dx in range(-1, 2):
        for dy in range(-1, 2):
            for dz in range(-1, 2):
                neighbor = key + (dx << 42) + (dy << 21) + dz
                if neighbor >= 0:
                    slot = _slot(keys, neighbor)
                    if keys[slot] == neighbor:
                        yield number[slot]


@loop
def key_of(x: float, y: float, z: float, edge: float) -> np.int64:
    """Key of the cube that contains a position.

    Parameters
    ----------
    x, y, z, edge : float
        Units: m.
    """
    return (np.int64(x / edge) << 42) | (np.int64(y / edge) << 21) | np.int64(z / edge)


@loop
def _slot(keys, key):
    """Slot of a key, or a free slot for it, in an open hash table whose size is a power of two."""
    mask = len(keys) - 1
    slot = ((key ^ (key >> 23)) * np.int64(-7046029254386353131)) >> 20 & mask
    while keys[slot] != EMPTY and keys[slot] != key:
        slot = (slot + 1) & mask
    return slot
