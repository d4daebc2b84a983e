"""Compact bright regions of a chunk of cloud: possible targets without control.

A target is brighter than its surroundings, whatever the effect of range on all intensities there.
Levels are therefore relative to the darker part of the neighborhood, and connected regions at every
half octave above it are tested (a component tree; Najman and Couprie 2006).
"""

from dataclasses import dataclass

import numpy as np

from mlscorr.compiled_loops import loop
from mlscorr.targets._clusters import (
    OCTAVE,
    key_of,
    neighbours,
    number_voxels,
    root_of,
    sort_by_voxel,
)
from mlscorr.targets.settings import SETTINGS

LEVELS = OCTAVE * np.iinfo(np.uint16).bits


@dataclass(frozen=True)
class BrightRegion:
    """Bright region of a cloud.

    Parameters
    ----------
    centre : (3,) array
        Units: m.
    radius : float
        Half its extent. Units: m.
    threshold : float
        Smallest intensity of its points.
    likeness : float
        Jaccard index of its points and those of the most similar shape.
    """

    centre: np.ndarray
    radius: float
    threshold: float
    likeness: float = 1.0


def bright_regions(xyz: np.ndarray, intensity: np.ndarray) -> list[BrightRegion]:
    """Flat regions of 0.1 to 1.5 m, brighter than their neighborhood and of a target's shape.

    Parameters
    ----------
    xyz : (n, 3) array
        In any order. Units: m.
    intensity : (n,) array
        On any positive scale; range affects it and the neighborhood alike.

    Returns
    -------
    list of BrightRegion
        Sorted by likeness; only the best at each position.
    """
    low = np.array([column.min() for column in xyz.T])  # faster than along the short axis
    level = _levels(intensity)
    edge = 2 * SETTINGS.largest_size / 3  # one third of a neighborhood
    cell, keys_of, keys, number = number_voxels(xyz, low, edge)
    bright = np.flatnonzero(level > _background(cell, keys_of, keys, number, level)[cell])
    thick = SETTINGS.thickness
    long = 1 / SETTINGS.smallest_width
    limits = SETTINGS.smallest_count, np.sqrt(2) * SETTINGS.largest_size, thick, long
    edge_of_voxel = SETTINGS.largest_size / 10
    table, moments = _component_tree(xyz[bright] - low, level[bright], edge_of_voxel, limits)
    order, starts = sort_by_voxel(cell, len(keys_of))
    shape = thick, *SETTINGS.rim, SETTINGS.largest_ratio, SETTINGS.rim_places // 4
    grid = order, starts, keys, number, edge
    likeness = _likeness(table[:, 0], moments, xyz, low, level, grid, shape, SETTINGS.piece_points)
    return _as_regions(table, *likeness.T, low)


def _levels(intensity):
    """Intensity (n,) in half octaves, as small integers that are at least 0."""
    steps = np.log2(np.maximum(np.arange(1 << 16), 1)) * OCTAVE
    return np.floor(steps).astype(np.int8)[np.asarray(intensity).astype(np.uint16)]


@loop
def _background(cell, keys_of, keys, number, level):
    """Level (c,) that a point must exceed to be bright, for each cell."""
    histogram = np.zeros((len(keys_of), LEVELS), np.int32)
    for i in range(len(cell)):
        histogram[cell[i], level[i]] += 1
    dark = np.empty(len(keys_of), np.int8)
    around = np.empty(LEVELS, np.int64)
    for c in range(len(keys_of)):
        for step in range(LEVELS):
            around[step] = 0
        total = 0
        occupied = 0
        for near in neighbours(keys_of[c], keys, number):
            for step in range(LEVELS):
                around[step] += histogram[near, step]
                total += histogram[near, step]
            occupied += 1
        half = total / 2
        below = 0
        step = 0
        while below + around[step] < half:
            below += around[step]
            step += 1
        # a road or wall passes through 9 of the 27 cells; a plate in the air fills its cells alone
        dark[c] = step if occupied >= 9 else -1
    return dark


def _component_tree(local, level, edge, limits):
    """Components (k, 17) of bright points (n, 3) at each level that may be a target.

    Columns: level, points, low (3), high (3), sum (3), sum of products (xx, yy, zz, xy, xz, yz).
    Their _moments are also returned.
    """
    count, extent, thick, ratio = limits
    voxel, keys_of, keys, number = number_voxels(local, np.zeros(3), edge)
    n = len(keys_of)
    brightest = np.zeros(n, np.int64)
    np.maximum.at(brightest, voxel, level)
    table = np.zeros((n, 17))
    table[:, 1] = np.bincount(voxel, minlength=n)
    table[:, 2:5] = 1e12
    table[:, 5:8] = -1e12
    for axis in range(3):
        column = local[:, axis]
        np.minimum.at(table[:, 2 + axis], voxel, column)
        np.maximum.at(table[:, 5 + axis], voxel, column)
        table[:, 8 + axis] = np.bincount(voxel, column, n)
        table[:, 11 + axis] = np.bincount(voxel, column**2, n)
    for column, (i, j) in zip((14, 15, 16), ((0, 1), (0, 2), (1, 2)), strict=True):
        table[:, column] = np.bincount(voxel, local[:, i] * local[:, j], n)
    order = np.argsort(-brightest, kind="stable")
    table = _joined(table, brightest, order, keys_of, keys, number, count, extent)
    mean, sigma, axes = _moments(table)
    may_be = (sigma[:, 0] < thick) & (sigma[:, 1] > thick) & (sigma[:, 2] < ratio * sigma[:, 1])
    return table[may_be], (mean[may_be], sigma[may_be], axes[may_be])


def _moments(table):
    """Means (k, 3), standard deviations (k, 3) along axes, and axes (k, 3, 3) as columns."""
    mean = table[:, 8:11] / table[:, 1:2]
    products = table[:, [11, 14, 15, 14, 12, 16, 15, 16, 13]].reshape(-1, 3, 3)
    spread = products / table[:, 1, None, None] - mean[:, :, None] * mean[:, None]
    values, axes = np.linalg.eigh(spread)
    return mean, np.sqrt(np.maximum(values, 0.0)), axes


@loop
def _joined(table, brightest, order, keys_of, keys, number, smallest, largest):
    """Rows (k, 17) of the components of voxels at each level, limited in points and size.

    A component that grows at a level has a voxel of that level, which no other one has.
    """
    n = len(order)
    parent = np.full(n, -1)
    touched = np.full(n, -1)
    result = np.empty((n, 17))
    count = 0
    first = 0
    while first < n:
        now = brightest[order[first]]
        end = first
        while end < n and brightest[order[end]] == now:
            v = order[end]
            parent[v] = v
            for near in neighbours(keys_of[v], keys, number):
                if parent[near] >= 0:
                    _join(parent, table, v, near)
            end += 1
        for k in range(first, end):
            root = root_of(parent, order[k])
            if touched[root] == now:
                continue
            touched[root] = now
            extent = 0.0
            for axis in range(3):
                extent = max(extent, table[root, 5 + axis] - table[root, 2 + axis])
            if table[root, 1] >= smallest and extent <= largest:
                result[count, 0] = now
                for column in range(1, 17):
                    result[count, column] = table[root, column]
                count += 1
        first = end
    return result[:count].copy()


@loop
def _join(parent, table, voxel, neighbor):
    """Join the components of two voxels."""
    a = root_of(parent, voxel)
    b = root_of(parent, neighbor)
    if a == b:
        return
    parent[b] = a
    table[a, 1] += table[b, 1]
    for axis in range(3):
        table[a, 2 + axis] = min(table[a, 2 + axis], table[b, 2 + axis])
        table[a, 5 + axis] = max(table[a, 5 + axis], table[b, 5 + axis])
    for column in range(8, 17):
        table[a, column] += table[b, column]


@loop
def _likeness(levels, moments, xyz, low, level, grid, shape, largest):
    """Likeness of components to a disc, square or checkerboard, and its best level: (k, 2).

    grid has the rows of the points (n, 3) sorted by cells, and the cells' hash table.
    """
    order, starts, keys, number, edge = grid
    thick, end, border, ratio, directions = shape
    means, sigmas, all_axes = moments
    result = np.zeros((len(levels), 2))
    uv = np.empty((largest, 2))
    level_of = np.empty(largest, np.int8)
    bright = np.empty(largest, np.bool_)
    for k in range(len(levels)):
        mean = means[k]
        axes = all_axes[k]
        corner = np.sqrt(6.0) * sigmas[k, 2]  # of a square, if this is one
        around = border * corner
        n = 0
        middle = key_of(mean[0], mean[1], mean[2], edge)
        for near in neighbours(middle, keys, number):
            for place in range(starts[near], starts[near + 1]):
                i = order[place]
                x = xyz[i, 0] - low[0] - mean[0]
                y = xyz[i, 1] - low[1] - mean[1]
                z = xyz[i, 2] - low[2] - mean[2]
                if abs(x) > around or abs(y) > around or abs(z) > around or n == largest:
                    continue
                if abs(x * axes[0, 0] + y * axes[1, 0] + z * axes[2, 0]) < 2.0 * thick:
                    uv[n, 0] = x * axes[0, 2] + y * axes[1, 2] + z * axes[2, 2]
                    uv[n, 1] = x * axes[0, 1] + y * axes[1, 1] + z * axes[2, 1]
                    level_of[n] = level[i]
                    n += 1
        for step in range(2):  # a voxel takes the level of its brightest point, others are below
            for i in range(n):
                bright[i] = level_of[i] >= levels[k] - step
            share = jaccard_index(uv[:n], bright[:n], end * corner, ratio, directions)
            if share > result[k, 0]:
                result[k, 0] = share
                result[k, 1] = levels[k] - step
    return result


def _as_regions(table, likeness, level, low):
    """Regions of target-like components, the best at each position.

    A disc on a board in the air gives two, of which the disc was surveyed. A region within another
    that is four times as bright therefore replaces it.
    """
    radius = np.linalg.norm(table[:, 5:8] - table[:, 2:5], axis=1) / 2
    middle = (table[:, 5:8] + table[:, 2:5]) / 2
    kept: list[int] = []
    for i in np.argsort(-likeness * np.sqrt(table[:, 1]), kind="stable"):
        if likeness[i] < SETTINGS.smallest_likeness:
            continue
        distance = np.linalg.norm(middle[kept] - middle[i], axis=1)
        is_separate = distance > np.maximum(radius[kept], radius[i]) / 2
        around = (level[kept] <= level[i] - 2 * OCTAVE) & (radius[kept] > radius[i])
        if (is_separate | around).all():
            kept = [k for k, free in zip(kept, is_separate, strict=True) if free] + [i]
    threshold = 2.0 ** (level / OCTAVE)
    return [BrightRegion(low + middle[k], radius[k], threshold[k], likeness[k]) for k in kept]


@loop
def jaccard_index(
    uv: np.ndarray, bright: np.ndarray, longest: float, largest_ratio: float, directions: int
) -> float:
    """Jaccard index of the bright points and those in a shape around them, for the best shape.

    Parameters
    ----------
    uv : (n, 2) array
        Positions in a plane. Units: m.
    bright : (n,) bool array
    longest : float
        The shape spans points up to this distance from the middle. Units: m.
    largest_ratio : float
        Largest ratio of length to width.
    directions : int
        Number of directions tested.
    """
    spanned = np.empty(len(uv), np.bool_)
    for i in range(len(uv)):
        spanned[i] = bright[i] and uv[i, 0] ** 2 + uv[i, 1] ** 2 <= longest**2
    best_area = np.inf
    turn = 0.0
    diameter = 0.0
    for step in range(directions):
        angle = np.pi / 2 * step / directions
        low_x, high_x, low_y, high_y = _extent(uv, spanned, angle)
        diameter += (high_x - low_x + high_y - low_y) / (2 * directions)
        if (high_x - low_x) * (high_y - low_y) < best_area:
            best_area = (high_x - low_x) * (high_y - low_y)
            turn = angle
    low_x, high_x, low_y, high_y = _extent(uv, spanned, turn)
    width = high_x - low_x
    height = high_y - low_y
    first = 0
    if max(width, height) > largest_ratio * min(width, height):
        # the white quadrants of a checkerboard fill the rectangle along their diagonal, which is as
        # small as their own; other shapes that fill a rectangle need twice its area when turned by
        # 45 deg
        turn = turn + np.pi / 4
        first = 2
        low_x, high_x, low_y, high_y = _extent(uv, spanned, turn)
        width = high_x - low_x
        height = high_y - low_y
        if not width * height < np.sqrt(2.0) * best_area:
            return 0.0
    if not 0.0 < max(width, height) <= largest_ratio * min(width, height):
        return 0.0
    both = np.zeros(4)
    either = np.zeros(4)
    inside = np.zeros(4, np.bool_)
    for i in range(len(uv)):
        x = np.cos(turn) * uv[i, 0] + np.sin(turn) * uv[i, 1] - (low_x + high_x) / 2
        y = np.cos(turn) * uv[i, 1] - np.sin(turn) * uv[i, 0] - (low_y + high_y) / 2
        inside[0] = x * x + y * y <= diameter**2 / 4
        inside[1] = abs(x) <= width / 2 and abs(y) <= height / 2
        inside[2] = inside[1] and x * y > 0
        inside[3] = inside[1] and x * y <= 0
        for shape in range(first, 4):
            both[shape] += inside[shape] and bright[i]
            either[shape] += inside[shape] or bright[i]
    share = 0.0
    for shape in range(first, 4):
        share = max(share, both[shape] / max(either[shape], 1.0))
    return share


@loop
def _extent(uv, bright, angle):
    """Bounds of the bright points along a direction and across it."""
    low_x = np.inf
    high_x = -np.inf
    low_y = np.inf
    high_y = -np.inf
    cos = np.cos(angle)
    sin = np.sin(angle)
    for i in range(len(uv)):
        if bright[i]:
            x = cos * uv[i, 0] + sin * uv[i, 1]
            y = cos * uv[i, 1] - sin * uv[i, 0]
            low_x = min(low_x, x)
            high_x = max(high_x, x)
            low_y = min(low_y, y)
            high_y = max(high_y, y)
    return low_x, high_x, low_y, high_y
