"""Figures of bins with sigmas by a bootstrap over blocks."""

import numpy as np
import pytest

from mlscorr.gap.contrast.tables import (
    block_of,
    effective,
    joined_bins,
    limit,
    sums_by_block,
    weights_of,
    with_sigma,
)


def mean(sums):
    return sums[..., 0] / sums[..., 1]


def figures(values, block, rng):
    sums = sums_by_block(block, np.zeros(len(block), int), 1, [values, np.ones(len(values))])
    return with_sigma(sums, mean, weights_of(block.max() + 1, rng))


def test_the_sigma_is_that_of_blocks_and_not_of_things():
    "50 blocks of 40 things that go together: the mean scatters by 1 / root 50, over 200 worlds"
    block = np.repeat(np.arange(50), 40)
    drawn = []
    stated = []
    for seed in range(200):
        rng = np.random.default_rng(seed)
        values = rng.standard_normal(50)[block] + 0.1 * rng.standard_normal(len(block))
        (value,), (sigma,), (blocks,) = figures(values, block, rng)
        drawn.append(value)
        stated.append(sigma)
    assert blocks == pytest.approx(50)
    assert np.median(stated) == pytest.approx(np.std(drawn), rel=0.15)
    assert np.std(drawn) == pytest.approx(1 / np.sqrt(50), rel=0.15)


def test_too_small_a_number_of_blocks_tells_nothing():
    "Of 4 blocks neither value nor sigma is told"
    block = np.repeat(np.arange(4), 100)
    (value,), (sigma,), _ = figures(np.ones(400), block, np.random.default_rng(0))
    assert np.isnan(value) and np.isnan(sigma)


def test_blocks_count_as_if_all_weighed_alike():
    "One heavy block among light ones is little more than one"
    assert effective(np.ones(9)) == pytest.approx(9)
    assert effective(np.array([100.0, 1.0, 1.0])) == pytest.approx(1.04, abs=0.01)


def test_bins_with_little_in_them_are_joined():
    "Ten blocks near, two in each of four bins behind: these become one, nothing is all"
    weight = np.zeros((20, 7))
    weight[:10, 1] = 1.0
    for number in range(4):
        weight[10 + 2 * number : 12 + 2 * number, 2 + number] = 1.0
    assert joined_bins(weight) == [slice(1, 2), slice(2, 6)]
    assert joined_bins(np.zeros((3, 4))) == [slice(0, 4)]


def test_places_of_a_block_go_together_at_utm_size():
    "Two places 3 m apart in one square of 16 m, one 20 m away in another"
    place = np.array(
        [[532000.0, 3374000.0, 3.0], [532003.0, 3374001.0, 9.0], [532023.0, 3374000, 0]]
    )
    block = block_of(place)
    assert block[0] == block[1] != block[2]


def test_the_more_is_looked_at_the_more_it_takes():
    "One bin of many blocks: 2.6 sigmas; 50 bins of 8 blocks: more than 6"
    assert limit(np.array([1e6]), 1)[0] == pytest.approx(2.576, abs=0.01)
    assert limit(np.array([8.0]), 50)[0] > 6
