"""As much of a cloud as pictures need."""

import numpy as np

from mlscorr.report.sample import EvenSample, gather
from tests.beds.street_of_points import ORIGIN, pieces, street, target

NO_WALLS = np.empty((0, 3))


def test_a_small_cloud_is_gathered_whole_and_a_large_one_evenly():
    "All of 10 000 points where there is room; else every 2^k-th, and all near the targets"
    cloud = street(10_000, np.random.default_rng(1))
    whole = gather(pieces(cloud, 700), [], NO_WALLS)
    assert whole.step == 1
    np.testing.assert_array_equal(whole.cloud.xyz, cloud.xyz)
    row = target("T1", np.add(ORIGIN, [100.0, 0.0, 2.0]))
    thinned = gather(pieces(cloud, 700), [row], NO_WALLS, limit=1000)
    assert thinned.step == 8
    np.testing.assert_array_equal(thinned.cloud.xyz[:1250], cloud.xyz[::8])
    near = np.linalg.norm(cloud.xyz - row.observed, axis=1) < 2.0
    assert near.sum() > 5
    kept = {tuple(place) for place in thinned.cloud.xyz[1250:]}
    assert all(tuple(place) in kept for place in cloud.xyz[near])
    assert len(thinned.cloud) <= 4000


def test_the_sample_does_not_depend_on_the_chunks():
    "Chunks of 300 or of 4000 points give the same sample"
    cloud = street(10_000, np.random.default_rng(2))
    rows = [target("T1", np.add(ORIGIN, [40.0, 3.0, 2.0]))]
    samples = [gather(pieces(cloud, size), rows, NO_WALLS, limit=2000) for size in (300, 4000)]
    np.testing.assert_array_equal(*(sample.cloud.xyz for sample in samples))
    assert samples[0].step == samples[1].step == 4


def test_all_points_near_walls_are_kept():
    "Within 2 m of a place along both axes, however thin the rest becomes"
    cloud = street(10_000, np.random.default_rng(3))
    wall = np.add(ORIGIN, [[60.0, 3.0, 2.0]])
    sample = gather(pieces(cloud, 700), [], wall, limit=1000)
    near = (np.abs(cloud.xyz - wall)[:, :2] < 2.0).all(axis=1)
    kept = {tuple(place) for place in sample.cloud.xyz}
    assert near.sum() > 5
    assert all(tuple(place) in kept for place in cloud.xyz[near])


def test_a_sample_holds_no_memory_of_the_points_that_it_leaves_out():
    "After the step has doubled each part is a copy, no view of all"
    sample = EvenSample(limit=1000)
    for part in pieces(street(10_000, np.random.default_rng(4)), 700):
        sample.add(part)
    assert sample.step == 8
    assert all(part.xyz.base is None for part in sample.parts)
