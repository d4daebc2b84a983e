"""A shape is like what it spans, wherever it lies and however it is turned."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mlscorr.targets.regions import jaccard_index

# m, of length to width, of the search
LONGEST = 1.0
RATIO = 1.6
DIRECTIONS = 12


def places(n=4000):
    "Points (n, 2) spread over 2 x 2 m"
    return np.random.default_rng(3).uniform(-1, 1, (n, 2))


@pytest.mark.parametrize("turn", [0.0, 0.3, 1.1])
def test_shapes_are_like_themselves_however_turned(turn):
    "The Jaccard index of a disc and a square is nearly 1; of an L it is less than 0.8"
    uv = places()
    x = np.cos(turn) * uv[:, 0] + np.sin(turn) * uv[:, 1]
    y = uv @ [-np.sin(turn), np.cos(turn)]
    square = np.maximum(np.abs(x), np.abs(y)) < 0.5
    for bright in (np.hypot(x, y) < 0.5, square):
        assert jaccard_index(uv, bright, 1.0, 1.6, 12) > 0.88
    ell = square & ((x < -0.2) | (y < -0.2))
    assert jaccard_index(uv, ell, 1.0, 1.6, 12) < 0.8


def test_a_shape_longer_than_the_ratio_is_like_nothing():
    "Twice as long as wide, where 1.6 is the limit"
    uv = places()
    strip = (np.abs(uv[:, 0]) < 0.6) & (np.abs(uv[:, 1]) < 0.3)
    assert jaccard_index(uv, strip, 1.0, 1.6, 12) == 0.0
    assert jaccard_index(uv, strip, 1.0, 2.2, 12) > 0.8


def index(uv, bright, longest=LONGEST):
    return jaccard_index(uv, bright, longest, RATIO, DIRECTIONS)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 1000), st.floats(0.2, 1.5))
def test_the_index_is_a_share(seed, size):
    "Between 0 and 1 for any bright points, and the same in any order"
    rng = np.random.default_rng(seed)
    uv = size * rng.normal(size=(60, 2))
    bright = rng.random(60) < 0.5
    value = index(uv, bright)
    order = rng.permutation(60)
    assert 0.0 <= value <= 1.0
    assert index(uv[order], bright[order]) == pytest.approx(value, abs=1e-12)


@pytest.mark.parametrize("missing, expected", [(0.0, 1.0), (0.25, 0.75), (0.5, 0.5)])
def test_dark_points_inside_count_against_it(missing, expected):
    "Of a square with a share of dark points inside, the index is what is left"
    grid = np.linspace(-0.5, 0.5, 41)
    uv = np.array([(u, v) for u in grid for v in grid])
    inner = np.abs(uv).max(axis=1) < 0.49
    bright = np.ones(len(uv), bool)
    bright[inner] = np.random.default_rng(1).random(inner.sum()) >= missing
    assert index(uv, bright) == pytest.approx(expected, abs=0.05)


def test_bright_points_far_off_count_against_it():
    "As many again beyond the longest extent halve the index; they don't stretch the shape"
    disc = places(2000)
    disc = disc[np.hypot(*disc.T) < 0.4]
    away = disc + np.array([3.0, 0.0])
    both = np.vstack([disc, away])
    assert index(disc, np.ones(len(disc), bool)) > 0.95
    assert index(both, np.ones(len(both), bool)) == pytest.approx(0.5, abs=0.03)


@pytest.mark.parametrize("turn", [0.0, 0.2, np.pi / 4, 1.2])
def test_two_quadrants_are_a_checkerboard(turn):
    "Though the smallest rectangle about two white quadrants lies along their diagonal"
    uv = places()
    x = np.cos(turn) * uv[:, 0] + np.sin(turn) * uv[:, 1]
    y = uv @ [-np.sin(turn), np.cos(turn)]
    inside = np.maximum(np.abs(x), np.abs(y)) < 0.5
    for quadrants in (x * y > 0, x * y < 0):
        assert index(uv, inside & quadrants) > 0.85


def test_a_quadrant_that_lacks_lowers_the_index():
    "Three of four are like a plate less a quarter"
    uv = places()
    three = (np.abs(uv).max(axis=1) < 0.5) & ~((uv[:, 0] > 0) & (uv[:, 1] > 0))
    assert index(uv, three) == pytest.approx(0.75, abs=0.05)


@pytest.mark.parametrize("ratio", [1.7, 2.0, 3.0, 8.0])
def test_strips_along_any_diagonal_are_no_checkerboard(ratio):
    "A full rectangle longer than the limit is like nothing, however it is turned"
    uv = places(8000)
    for turn in (0.0, 0.4, np.pi / 4):
        x = np.cos(turn) * uv[:, 0] + np.sin(turn) * uv[:, 1]
        y = uv @ [-np.sin(turn), np.cos(turn)]
        assert index(uv, (np.abs(x) < 0.8) & (np.abs(y) < 0.8 / ratio)) == 0.0


def test_nothing_bright_is_like_nothing():
    "No bright point, one, or a line have the index zero"
    uv = places(50)
    none = np.zeros(50, bool)
    one = none.copy()
    one[0] = True
    assert index(uv, none) == index(uv, one) == 0.0
    line = np.column_stack([np.linspace(-0.5, 0.5, 50), np.zeros(50)])
    assert index(line, ~none) == 0.0
