import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.targets._plane import fit_plane, most_common
from tests.targets.planes import plane_through

ORIGIN = np.array([523_000.0, 3_378_000.0, 42.0])  # m, UTM


@pytest.mark.parametrize("seed", range(5))
def test_fit_plane_with_outliers(seed):
    "30 % of points up to 1 m off do not turn a plane by more than 0.3 deg, at UTM coordinates"
    rng = np.random.default_rng(seed)
    turn = Rotation.random(random_state=seed).as_matrix()
    local = np.column_stack([rng.uniform(-0.3, 0.3, (400, 2)), 0.004 * rng.standard_normal(400)])
    local[:120, 2] += rng.uniform(-1, 1, 120)
    plane = fit_plane(local @ turn.T + ORIGIN, 0.03)
    assert abs(plane.axes[2] @ turn[:, 2]) > np.cos(np.radians(0.3))
    assert abs((plane.origin - ORIGIN) @ turn[:, 2]) < 0.001  # m
    assert plane.inliers[120:].mean() > 0.95
    assert plane.sigma == pytest.approx(0.004, rel=0.3)


def test_fit_plane_needs_three_points():
    "Two points are refused with the number"
    with pytest.raises(ValueError, match="needs at least 3 points; there are 2"):
        fit_plane(np.zeros((2, 3)), 0.03)


def test_a_beam_crosses_the_plane_where_geometry_says():
    "A point 1 m behind a plane 4 m off is seen through a place a fifth nearer the axis"
    plane = plane_through(np.array([0.0, 4.0, 0.0]), np.array([0.0, 1.0, 0.0]))
    point = np.array([[0.5, 5.0, 0.25]])
    crossing = plane.crossing(point, point) @ plane.axes[:2] + plane.origin
    assert crossing[0] == pytest.approx([0.4, 4.0, 0.2])  # m


def test_axes_are_turned_like_those_of_another_plane():
    "A fit with its normal reversed and its axes turned gets those of the plane it is like"
    plane = plane_through(np.zeros(3), np.array([0.0, 0.0, 1.0]))
    other = plane_through(np.ones(3), np.array([0.0, 0.0, -1.0]))
    turned = other.turned_like(plane)
    assert turned.axes == pytest.approx(plane.axes)
    assert turned.origin == pytest.approx(other.origin)


def test_nearer_points_support_a_plane_more():
    "Two points on a plane weigh more than two half the tolerance off another; far ones nothing"
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    beside = [[0.5, 0.5, 0.015], [0.2, 0.7, -0.015]]
    upon = [[0.5, 0.5, 1.0], [0.2, 0.7, 1.0]]
    far = np.random.default_rng(0).uniform(10.0, 14.0, (50, 3))
    xyz = np.concatenate([corners, beside, np.add(corners, [0, 0, 1]), upon, far])
    triples = np.array([[0, 1, 2], [5, 6, 7]])
    assert np.flatnonzero(most_common(xyz, triples, 0.03)).tolist() == [5, 6, 7, 8, 9]
    assert np.flatnonzero(most_common(xyz[:8], triples, 0.03)).tolist() == [0, 1, 2, 3, 4]


def test_points_on_a_line_have_no_plane():
    "Three of a line span no plane, so that none of its points lies on one"
    line = np.arange(10.0)[:, None] * [1.0, 2.0, 0.5]
    assert not most_common(line, np.array([[0, 1, 2], [3, 3, 5]]), 0.03).any()
    assert fit_plane(line, 0.03).inliers.all()
