import numpy as np
import pytest
from scipy.stats import qmc

from mlscorr.targets._sequence import quasi_random


@pytest.mark.parametrize("dimensions", [2, 3, 5])
def test_points_fill_the_cube_more_evenly_than_random_ones(dimensions):
    "The mean of 600 is off by less than a fifth of what chance would make of it; none on a side"
    points = quasi_random(600, dimensions)
    assert points.shape == (600, dimensions)
    assert 0 < points.min() < points.max() < 1
    assert np.abs(points.mean(axis=0) - 0.5).max() < 0.2 * 5 / np.sqrt(12 * 600)


def test_points_are_those_of_another_implementation():
    "Points equal those of scipy from its second on, to the last bit, in the fourth block of 500"
    halton = qmc.Halton(5, scramble=False)
    halton.fast_forward(1 + 3 * 500)
    assert np.array_equal(quasi_random(500, 5, 3), halton.random(500))


def test_blocks_differ_and_each_comes_back():
    "Two blocks share no point, and the same block is the same"
    assert not np.isin(quasi_random(300, 2, 1), quasi_random(300, 2)).any()
    assert np.array_equal(quasi_random(300, 2, 1), quasi_random(300, 2, 1))
