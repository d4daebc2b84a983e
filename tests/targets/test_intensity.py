"""Intensities that tell nothing are named with their reason."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mlscorr.targets import why_useless


def test_why_useless_names_the_reason():
    "All equal, or a flag of two values; 8 bits in 16 are of use"
    assert "all points is 7" in why_useless(np.full(5, 7))
    assert "only 2" in why_useless(np.arange(10) % 2)
    assert why_useless(np.arange(256)) is None


@pytest.mark.parametrize("levels", [1, 2, 3, 4, 5])
def test_levels_count_and_not_points(levels):
    "Three levels of a million points are a class; four of a few points may tell bright from dark"
    values = np.resize(np.arange(levels) * 1000, 1_000 * levels)
    told = why_useless(values)
    assert (told is None) == (levels >= 4)
    if 1 < levels < 4:
        assert told == f"The intensity has only {levels} different values."


@given(st.lists(st.integers(0, 65_535), max_size=30), st.integers(1, 256), st.randoms())
def test_neither_order_nor_scale_matters(values, factor, random):
    "Shuffled, and multiplied, the intensities are as useful as before"
    shuffled = list(values)
    random.shuffle(shuffled)
    before = why_useless(np.array(values, float))
    after = why_useless(factor * np.array(shuffled, float))
    assert (before is None) == (after is None)


def test_no_points_are_told():
    "A cloud without a point has an intensity that is missing"
    assert why_useless(np.zeros(0)) == "No point has an intensity."
