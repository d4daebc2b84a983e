"""Patches are found in any order of points, in little memory."""

import numpy as np

from mlscorr.gap.observe.patch_search import find_patches
from mlscorr.io.las import read_chunks


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
