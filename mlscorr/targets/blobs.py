"""Compact bright blobs of a chunk of cloud: where targets may be when nobody says where.

A target stands out against what surrounds it, whatever the range does to all intensities there.
So levels are relative to the darker part of the neighbourhood, and blobs at every half octave
above it are looked at (a component tree; Najman and Couprie 2006).
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from mlscorr.targets.agreement import agreement
from mlscorr.targets.voxels import key_of, neighbours, number_voxels, sort_by_voxel

CELL = 1.0  # m: a neighbourhood is 3 x 3 x 3 of these, so twice the largest target
LINK = 0.15  # m: bright points in voxels of this edge that touch belong together
STEPS = 2  # levels in an octave of intensity
LEVELS = 17 * STEPS  # 16 bits
SURFACE = 9  # of the 27 cells are occupied where a road or wall passes through
BACKGROUND = 0.5  # of a neighbourhood's points are darker than what is bright there
FEWEST_POINTS = 20  # as on a target near a control point
LARGEST = 2.1  # m: the diagonal of a plate of 1.5 m
LEAST_SPREAD = 0.03  # m, standard deviation across: a strip of 0.1 m has it
LARGEST_DEPTH = 0.04  # m, standard deviation across the plane, with a frame or an edge behind
LONGEST = 3.5  # times the width: a disc seen by half, not a road marking
MOST_POINTS = 20_000  # about a component, in the test of its shape
RIM = 1.15, 1.6  # times a target's half diagonal: it ends within, and is looked at so far
LEAST_LIKENESS = 0.75  # of the shape's points and the bright ones: a ring has a dark quarter
BRIGHTER = 2 * STEPS  # levels, a disc than its board: paints differ by ten times


@dataclass(frozen=True)
class Blobs:
    """Centre (n, 3) and half extent (n,) in m, number of points (n,), likeness (n,), the share
    in which bright points and the best shape agree, and the intensity (n,) of what is bright.
    """

    centre: np.ndarray
    reach: np.ndarray
    points: np.ndarray
    likeness: np.ndarray
    threshold: np.ndarray

    def __len__(self):
        return len(self.points)


def bright_blobs(xyz, intensity):
    """Flat blobs of 0.1 to 1.5 m, brighter than their neighbourhood and of a target's shape.

    Parameters
    ----------
    xyz : (n, 3) array
        In any order. Units: m.
    intensity : (n,) array
        Of any positive scale; whatever range does to it, it does to the neighbourhood too.

    Returns Blobs, the best first, of those at one place only the best.
    """
    low = np.array([column.min() for column in xyz.T])  # faster than along the short axis
    level = _levels(intensity)
    cell, keys_of, keys, number = number_voxels(xyz, low, CELL)
    dark = _background(cell, keys_of, keys, number, level)
    bright = _bright_rows(cell, level, dark)
    table = _component_tree(xyz[bright] - low, level[bright], LINK)
    order, starts = sort_by_voxel(cell, len(keys_of))
    likeness = _likeness(table, xyz, low, level, order, starts, keys, number)
    return _as_blobs(table, *likeness.T, low)


def _levels(intensity):
    """Intensity (n,) in half octaves: (n,) small integers, all at least 0."""
    return _table()[np.asarray(intensity).astype(np.uint16)]


def _table():
    steps = np.log2(np.maximum(np.arange(1 << 16), 1)) * STEPS
    return np.floor(steps).astype(np.int8)


@njit(cache=True)
def _background(cell, keys_of, keys, number, level):
    """Level (c,) that a point must exceed to be bright, for each cell."""
    histogram = np.zeros((len(keys_of), LEVELS), np.int32)
    for i in range(len(cell)):
        histogram[cell[i], level[i]] += 1
    dark = np.empty(len(keys_of), np.int8)
    around = np.empty(LEVELS, np.int64)
    for c in range(len(keys_of)):
        around[:] = 0
        occupied = 0
        for near in neighbours(keys_of[c], keys, number):
            around += histogram[near]
            occupied += 1
        wanted, below, step = BACKGROUND * around.sum(), 0, 0
        while below + around[step] < wanted:
            below += around[step]
            step += 1
        dark[c] = step if occupied >= SURFACE else -1  # a plate in the air is all there is
    return dark


@njit(cache=True)
def _bright_rows(cell, level, dark):
    """Rows (k,) of the points brighter than the background of their cell."""
    rows, count = np.empty(len(cell), np.int64), 0
    for i in range(len(cell)):
        if level[i] > dark[cell[i]]:
            rows[count] = i
            count += 1
    return rows[:count].copy()


@njit(cache=True)
def _root(parent, i):
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i


@njit(cache=True)
def _component_tree(local, level, edge):
    """Components (k, 17) of bright points (n, 3) at each level, those that may be a target.

    Columns: level, points, low (3), high (3), sum (3), sum of products (xx, yy, zz, xy, xz, yz).
    """
    voxel, keys_of, keys, number = number_voxels(local, np.zeros(3), edge)
    n = len(keys_of)
    brightest, table = np.zeros(n, np.int64), np.zeros((n, 17))
    table[:, 2:5], table[:, 5:8] = 1e12, -1e12
    for i in range(len(local)):
        v = voxel[i]
        brightest[v] = max(brightest[v], level[i])
        table[v, 1] += 1
        x, y, z = local[i, 0], local[i, 1], local[i, 2]
        for axis in range(3):
            table[v, 2 + axis] = min(table[v, 2 + axis], local[i, axis])
            table[v, 5 + axis] = max(table[v, 5 + axis], local[i, axis])
            table[v, 8 + axis] += local[i, axis]
            table[v, 11 + axis] += local[i, axis] ** 2
        table[v, 14] += x * y
        table[v, 15] += x * z
        table[v, 16] += y * z
    parent = np.full(n, -1)
    order = np.argsort(-brightest, kind="mergesort")
    touched = np.full(n, -1)
    result = np.empty((3 * n + 16, 17))
    count, first = 0, 0
    while first < n:
        now, end = brightest[order[first]], first
        while end < n and brightest[order[end]] == now:
            v = order[end]
            parent[v] = v
            for near in neighbours(keys_of[v], keys, number):
                if parent[near] >= 0:
                    _join(parent, table, v, near)
            end += 1
        for k in range(first, end):
            root = _root(parent, order[k])
            if touched[root] != now and count < len(result) and _may_be_target(table[root]):
                result[count] = table[root]
                result[count, 0] = now
                count += 1
            touched[root] = now
        first = end
    return result[:count].copy()


@njit(cache=True)
def _join(parent, table, one, other):
    """Make the components of two voxels one."""
    a, b = _root(parent, one), _root(parent, other)
    if a == b:
        return
    parent[b] = a
    table[a, 1] += table[b, 1]
    for axis in range(3):
        table[a, 2 + axis] = min(table[a, 2 + axis], table[b, 2 + axis])
        table[a, 5 + axis] = max(table[a, 5 + axis], table[b, 5 + axis])
    for column in range(8, 17):
        table[a, column] += table[b, column]


@njit(cache=True)
def _moments(row):
    """Mean (3,), standard deviations (3,) along axes, and axes (3, 3) as columns."""
    n, mean = row[1], row[8:11] / row[1]
    spread = np.empty((3, 3))
    for axis in range(3):
        spread[axis, axis] = row[11 + axis] / n - mean[axis] ** 2
    spread[0, 1] = spread[1, 0] = row[14] / n - mean[0] * mean[1]
    spread[0, 2] = spread[2, 0] = row[15] / n - mean[0] * mean[2]
    spread[1, 2] = spread[2, 1] = row[16] / n - mean[1] * mean[2]
    values, axes = np.linalg.eigh(spread)
    return mean, np.sqrt(np.maximum(values, 0.0)), axes


@njit(cache=True)
def _may_be_target(row):
    """Whether a component is compact, flat, and not a strip."""
    if row[1] < FEWEST_POINTS:
        return False
    if max(row[5] - row[2], row[6] - row[3], row[7] - row[4]) > LARGEST:
        return False
    _, sigma, _ = _moments(row)
    return sigma[0] < LARGEST_DEPTH and sigma[1] > LEAST_SPREAD and sigma[2] < LONGEST * sigma[1]


@njit(cache=True)
def _likeness(table, xyz, low, level, order, starts, keys, number):
    """How far each component agrees with a disc, a square or a checkerboard, and the level from
    which it does best: (k, 2).

    order holds the rows of the points (n, 3) sorted by cells, which start at starts.
    """
    result = np.zeros((len(table), 2))
    uv, level_of = np.empty((MOST_POINTS, 2)), np.empty(MOST_POINTS, np.int8)
    for k in range(len(table)):
        row = table[k]
        mean, sigma, axes = _moments(row)
        corner = np.sqrt(6.0) * sigma[2]  # of a square, if this is one
        reach, n = RIM[1] * corner, 0
        middle = key_of(mean[0], mean[1], mean[2], CELL)
        for near in neighbours(middle, keys, number):
            for i in order[starts[near] : starts[near + 1]]:
                x = xyz[i, 0] - low[0] - mean[0]
                y = xyz[i, 1] - low[1] - mean[1]
                z = xyz[i, 2] - low[2] - mean[2]
                if abs(x) > reach or abs(y) > reach or abs(z) > reach or n == MOST_POINTS:
                    continue
                if abs(x * axes[0, 0] + y * axes[1, 0] + z * axes[2, 0]) < 2.0 * LARGEST_DEPTH:
                    uv[n, 0] = x * axes[0, 2] + y * axes[1, 2] + z * axes[2, 2]
                    uv[n, 1] = x * axes[0, 1] + y * axes[1, 1] + z * axes[2, 1]
                    level_of[n] = level[i]
                    n += 1
        for step in range(2):  # a voxel takes the level of its brightest point, others are below
            share = agreement(uv[:n], level_of[:n] >= row[0] - step, RIM[0] * corner)
            if share > result[k, 0]:
                result[k, 0], result[k, 1] = share, row[0] - step
    return result


def _as_blobs(table, likeness, level, low):
    """Blobs of components that are like a target, the best of each place.

    Of a disc on a board in the air, both are; it is the disc that was surveyed, so that what is
    much brighter within another takes its place.
    """
    reach = np.linalg.norm(table[:, 5:8] - table[:, 2:5], axis=1) / 2
    middle = (table[:, 5:8] + table[:, 2:5]) / 2
    worth = likeness * np.sqrt(table[:, 1])
    kept = []
    for i in np.argsort(-worth, kind="stable"):
        if likeness[i] < LEAST_LIKENESS:
            continue
        apart = np.linalg.norm(middle[kept] - middle[i], axis=1)
        beside = apart > np.maximum(reach[kept], reach[i]) / 2
        around = (level[kept] <= level[i] - BRIGHTER) & (reach[kept] > reach[i])
        if (beside | around).all():
            kept = [k for k, free in zip(kept, beside, strict=True) if free] + [i]
    points, threshold = table[kept, 1].astype(int), 2.0 ** (level[kept] / STEPS)
    return Blobs(low + middle[kept], reach[kept], points, likeness[kept], threshold)
