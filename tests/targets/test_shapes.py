import numpy as np
import pytest
from scipy.special import ndtr

from mlscorr.targets import diameter
from mlscorr.targets.shapes import (
    BRIGHT,
    DARK,
    FORMS,
    MISS,
    WHITE,
    distance_inside,
    log_likelihood,
    sides,
)


def test_the_likelihood_from_a_table_is_that_of_the_normal_distribution():
    "Of 300 beams about a disc, told to 5e-6 each; a beam along the plane makes it no number"
    rng = np.random.default_rng(3)
    points = rng.uniform(-0.5, 0.5, (300, 2))
    side = rng.choice([-1, 1], 300).astype(np.int8)
    trials = np.array([[0.0, 0.0, 0.0, 0.6, 0.0], [0.05, 0.1, 0.0, 0.5, 0.0]])
    inside = trials[:, 3:4] / 2 - np.linalg.norm(points - trials[:, None, :2], axis=2)
    exact = np.log(0.01 + 0.98 * ndtr(inside * side / 0.05)).sum(axis=1)
    assert log_likelihood(points, side, trials, 0, 0.05) == pytest.approx(exact, abs=300 * 5e-6)
    points[0] = np.nan
    assert np.isnan(log_likelihood(points, side, trials, 0, 0.05)).all()


@pytest.mark.parametrize("kind", FORMS)
def test_distances_inside_are_those_to_the_outline(kind):
    "Half a size at the centre, nothing on the rim, also where it is turned and moved"
    outline = np.array([2.0, -1.0, 0.4, 0.6, 0.0])
    edge = outline[:2] + 0.3 * np.array([np.cos(0.4), np.sin(0.4)])
    points = np.array([outline[:2], edge])
    assert distance_inside(points, outline, FORMS[kind]) == pytest.approx([0.3, 0.0], abs=1e-12)


def test_a_ring_has_an_inner_edge():
    "Within the dark disc of a ring a place is outside by its distance from the inner edge"
    ring = np.array([0.0, 0.0, 0.0, 0.6, 0.5])
    assert distance_inside(np.zeros((1, 2)), ring, FORMS["circle"]) == pytest.approx([-0.15])


def test_white_quadrants_change_across_the_crossing():
    "Positive where both coordinates have one sign, by the nearer line"
    board = np.array([0.0, 0.0, 0.0, 0.6, 0.0])
    points = np.array([[0.1, 0.2], [-0.1, 0.2], [-0.2, -0.1]])
    assert distance_inside(points, board, WHITE) == pytest.approx([0.1, -0.1, 0.1])


def test_sides_follow_the_kind():
    "A disc is where it is bright, a hole where beams go by, a board where they are met"
    state = np.array([BRIGHT, DARK, MISS])
    assert sides(state, "circle", False).tolist() == [1, -1, -1]
    assert sides(state, "hole", True).tolist() == [-1, -1, 1]
    assert sides(state, "board", True).tolist() == [1, 1, -1]
    assert sides(state, "checkerboard", False).tolist() == state.tolist()


def test_the_longest_extent_of_a_square_is_its_diagonal():
    "Of a disc it is the diameter"
    assert diameter("circle", 0.6) == 0.6
    assert diameter("square", 0.6) == pytest.approx(0.6 * np.sqrt(2))
