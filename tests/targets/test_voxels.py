"""Cubes of a cloud are numbered once, whatever its size and order."""

from itertools import pairwise, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mlscorr.targets._clusters import key_of, neighbours, number_voxels, sort_by_voxel


def test_voxels_are_numbered_once_and_know_their_neighbours():
    "As many cubes as numpy counts, the points of each together, and 27 about one within a block"
    xyz = np.random.default_rng(4).uniform(0, 1, (5000, 3))
    cell, keys_of, keys, number = number_voxels(xyz, np.zeros(3), 0.2)
    cubes, count = np.unique(np.floor(xyz / 0.2), axis=0, return_counts=True)
    assert len(keys_of) == len(cubes) == 125
    order, starts = sort_by_voxel(cell, len(keys_of))
    assert sorted(np.diff(starts)) == sorted(count)
    assert all(len(set(cell[order[a:b]])) == 1 for a, b in pairwise(starts))
    assert len(set(neighbours(key_of(0.5, 0.5, 0.5, 0.2), keys, number))) == 27


def cubes_of(xyz, edge):
    "Cube of each point (n, 3) by numpy"
    return np.floor(xyz / edge).astype(int)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 1000), n=st.integers(1, 400), edge=st.sampled_from([0.05, 0.3, 2.0]))
def test_points_share_a_number_where_they_share_a_cube(seed, n, edge):
    "And only there; the key of each number is that of its points' cube"
    xyz = np.random.default_rng(seed).uniform(0.0, 3.0, (n, 3))
    cell, keys_of, _, _ = number_voxels(xyz, np.zeros(3), edge)
    cubes = cubes_of(xyz, edge)
    _, expected = np.unique(cubes, axis=0, return_inverse=True)
    pairs = np.unique(np.column_stack([cell, expected.ravel()]), axis=0)
    assert len(pairs) == len(keys_of) == len(set(cell.tolist())) == len(set(expected.ravel()))
    for row in range(n):
        assert keys_of[cell[row]] == key_of(*xyz[row], edge)


def test_the_table_grows_with_the_cloud():
    "40 000 cubes of a kilometre of street, forty times its first size, keep their numbers"
    rng = np.random.default_rng(2)
    xyz = rng.uniform(0.0, [1000.0, 20.0, 10.0], (40_000, 3))
    cell, keys_of, keys, number = number_voxels(xyz, np.zeros(3), 0.1)
    assert len(keys_of) == len(np.unique(cubes_of(xyz, 0.1), axis=0)) > 39_000
    assert len(keys) & (len(keys) - 1) == 0 and len(keys) > len(keys_of)
    stored = keys >= 0
    assert stored.sum() == len(keys_of)
    np.testing.assert_array_equal(keys_of[number[stored]], keys[stored])
    np.testing.assert_array_equal(keys_of[cell[:100]], [key_of(*p, 0.1) for p in xyz[:100]])


def test_the_origin_does_not_matter():
    "At UTM size about the lowest place the numbers are those of local coordinates, bit for bit"
    local = np.round(np.random.default_rng(3).uniform(0.0, 5.0, (500, 3)) * 1024) / 1024
    corner = np.array([532_000.0, 3_374_000.0, 42.0])
    here = number_voxels(local, np.zeros(3), 0.25)
    there = number_voxels(local + corner, corner, 0.25)
    for first, second in zip(here[:2], there[:2], strict=True):
        np.testing.assert_array_equal(first, second)


@settings(max_examples=25, deadline=None)
@given(st.lists(st.integers(0, 6), max_size=60))
def test_rows_are_sorted_by_cell_and_keep_their_order(cells):
    "As numpy's stable sort does, with starts of all cells, also of empty ones"
    cell = np.array(cells, dtype=np.int32)
    order, starts = sort_by_voxel(cell, 7)
    np.testing.assert_array_equal(order, np.argsort(cell, kind="stable"))
    np.testing.assert_array_equal(np.diff(starts), np.bincount(cell, minlength=7))
    assert starts[0] == 0 and starts[-1] == len(cell)


@pytest.mark.parametrize("place", [(0, 0, 0), (0, 2, 1), (3, 0, 3), (2, 2, 2)])
def test_neighbours_are_those_that_touch(place):
    "In a block of 4 x 4 x 4 of which every other cube is occupied, corners and edges included"
    occupied = [cube for cube in product(range(4), repeat=3) if sum(cube) % 2 == 0]
    xyz = (np.array(occupied) + 0.5) * 0.5
    _, keys_of, keys, number = number_voxels(xyz, np.zeros(3), 0.5)
    key = key_of(*((np.array(place) + 0.5) * 0.5), 0.5)
    found = {int(keys_of[i]) for i in neighbours(key, keys, number)}
    expected = {
        int(key_of(*((np.array(cube) + 0.5) * 0.5), 0.5))
        for cube in occupied
        if np.abs(np.subtract(cube, place)).max() <= 1
    }
    assert found == expected
