"""Patches are found in any order of points, in little memory."""

from dataclasses import fields
from functools import partial

import numpy as np
import pytest

from mlscorr.gap.residuals import SETTINGS, find_patches
from mlscorr.io.clouds import read_chunks


def test_little_memory_is_enough_for_any_cloud(survey):
    "A pool of 200 patches holds no more, with the same blocks of ground in both passes"
    few = find_patches(survey, pool=200)
    assert 20 <= len(few) <= 200
    assert set(np.unique(few.pass_number)) == {1, 2}


def test_patches_do_not_depend_on_the_order_of_points(survey, patches):
    "Points in another order give the same planes; only the pulses between them are not told"
    rng = np.random.default_rng(1)
    mixed = find_patches(
        survey, chunks=lambda file: (c[rng.permutation(len(c))] for c in read_chunks(file))
    )
    assert len(mixed) == len(patches)
    for name in ("centre", "variance"):
        one, two = (np.sort(getattr(p, name), axis=0) for p in (mixed, patches))
        np.testing.assert_allclose(one, two, rtol=1e-6, atol=1e-7)


def assert_equal(first, second):
    "Patches equal bit for bit, in the same order"
    assert len(first) == len(second)
    for name in (field.name for field in fields(first) if field.name != "cloud"):
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name), name)
    for one, two in zip(first.cloud, second.cloud, strict=True):
        np.testing.assert_array_equal(one.xyz, two.xyz)
        np.testing.assert_array_equal(one.gps_time, two.gps_time)


@pytest.mark.long
@pytest.mark.parametrize("size", [3_001, 20_000, 123_457])
@pytest.mark.parametrize("pool", [SETTINGS.pool, 200])
def test_patches_do_not_depend_on_where_a_cloud_is_cut_into_chunks(survey, size, pool):
    "Chunks of any size give the patches of the whole, bit for bit, also where few of them are kept"
    whole = find_patches(survey, pool, partial(read_chunks, chunk_size=10**9))
    assert_equal(find_patches(survey, pool, partial(read_chunks, chunk_size=size)), whole)


@pytest.mark.long
def test_beams_that_come_late_are_not_cut_off(survey):
    "Points up to 0.4 s late, and a drive told backwards, are cut nowhere either"
    file = survey.clouds[0]
    rng = np.random.default_rng(2)
    (cloud,) = read_chunks(file)
    late = np.argsort(cloud.gps_time + rng.uniform(0.0, 0.4, len(cloud)))
    for order in (late, np.arange(len(cloud))[::-1]):
        moved = cloud[order]
        pieces = [moved[first : first + 5_000] for first in range(0, len(moved), 5_000)]
        found = [find_patches(survey, chunks=lambda _, c=c: c) for c in (pieces, [moved])]
        assert len(found[0]) > 100
        assert_equal(*found)
