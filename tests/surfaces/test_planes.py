"""Planes of cells by the points themselves: clutter is left out, and nothing else matters."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.surfaces import fit_planes, search_planes
from mlscorr.survey import PointCloud

PLACE = np.array([447_000.0, 5_410_000.0, 120.0])  # m
START = 413_200.0  # s
NOISE = 0.004  # m
POINTS = 2_000


def cluttered_wall(seed, share=0.08, shift=0.0):
    "A leaning wall of 0.6 m in one cell and second, before which a share of points floats"
    rng = np.random.default_rng(seed)
    normal = np.array([0.8, 0.5, 0.3])
    normal /= np.linalg.norm(normal)
    u = np.cross(normal, [0.0, 0.0, 1.0])
    u /= np.linalg.norm(u)
    along = rng.uniform(-0.3, 0.3, (POINTS, 2)) @ np.array([u, np.cross(normal, u)])
    is_clutter = rng.random(POINTS) < share
    away = rng.normal(0.0, NOISE, POINTS) + is_clutter * rng.uniform(0.05, 0.15, POINTS)
    centre = PLACE + (0.2 + shift)
    time = START + np.sort(rng.uniform(0.0, 0.999, POINTS))
    cloud = PointCloud(centre + along + np.outer(away, normal), time, np.ones(POINTS))
    return cloud, centre, normal, is_clutter


@pytest.mark.parametrize("seed", range(5))
def test_a_plane_is_found_behind_clutter(seed):
    "Normal to 3 mrad, noise to 10 %, the place to 1 mm; at most one point in 500 of the clutter"
    cloud, centre, normal, is_clutter = cluttered_wall(seed)
    search = search_planes(cloud, PLACE)
    planes = search.planes
    assert len(planes) == 1
    assert np.linalg.norm(np.cross(planes.normal[0], normal)) < 3e-3  # rad
    assert np.sqrt(planes.variance[0]) == pytest.approx(NOISE, rel=0.1)
    off = (search.middle[0] + planes.mean[0] - centre) @ normal
    assert abs(off) < 0.001  # m
    on_plane = search.rows[search.is_on]
    assert len(on_plane) == planes.points[0] > 0.98 * np.sum(~is_clutter)
    assert is_clutter[on_plane].mean() < 0.002


def test_noise_between_neighbours_is_that_about_a_flat_plane():
    "Both variances are one where neighbours share nothing, to 15 %; a bow adds to one alone"
    cloud, centre, normal, _ = cluttered_wall(6, share=0.0)
    planes = search_planes(cloud, PLACE).planes
    assert planes.variance[0] / planes.between[0] == pytest.approx(1.0, abs=0.15)
    order = np.argsort((cloud.xyz - centre) @ np.cross(normal, [0.0, 0.0, 1.0]))
    along = ((cloud.xyz - centre) @ np.cross(normal, [0.0, 0.0, 1.0]))[order, None]
    bent = replace(cloud, xyz=cloud.xyz[order] + 0.2 * along**2 * normal)
    planes = search_planes(bent, PLACE).planes
    assert planes.variance[0] > 1.5 * planes.between[0]


def test_the_order_of_points_and_the_place_nearby_change_nothing():
    "Shuffled, and with cells counted from elsewhere, the plane has the same points, to 1e-9 m"
    cloud, *_ = cluttered_wall(1)
    search = search_planes(cloud, PLACE)
    order = np.random.default_rng(2).permutation(POINTS)
    other = search_planes(cloud[order], PLACE + np.array([900.0, -400.0, 7.3]))
    assert set(order[other.rows[other.is_on]]) == set(search.rows[search.is_on])
    assert other.middle == pytest.approx(search.middle, abs=1e-9)
    assert other.planes.mean == pytest.approx(search.planes.mean, abs=1e-9)
    assert other.planes.variance == pytest.approx(search.planes.variance, rel=1e-6)


def test_cells_and_moments_are_searched_each_by_itself():
    "Two walls a metre apart, one of them in two seconds, are three planes; too few points are none"
    first, *_ = cluttered_wall(1)
    second, *_ = cluttered_wall(2, shift=1.0)
    later = replace(second, gps_time=second.gps_time + 1.0)
    few = cluttered_wall(3, shift=2.0)[0][:10]
    search = search_planes(PointCloud.concatenate([first, second, later, few]), PLACE)
    assert len(search.planes) == 3
    assert sorted(search.begin) == [START, START, START + 1.0]
    assert len(search.rows) == search.ends[-1] == 3 * POINTS


def test_planes_of_groups_are_those_of_singular_values():
    "Mean, normal and variance equal numpy's of each group; a group without points has none"
    rng = np.random.default_rng(4)
    local = rng.normal(0.0, 1.0, (90, 3)) * [0.3, 0.2, 0.01]
    planes = fit_planes(local, np.array([0, 50, 50, 90]))
    assert planes.points.tolist() == [50, 0, 40]
    for number, part in ((0, local[:50]), (2, local[50:])):
        centred = part - part.mean(axis=0)
        _, size, axes = np.linalg.svd(centred)
        assert planes.mean[number] == pytest.approx(part.mean(axis=0), abs=1e-12)
        assert abs(planes.normal[number] @ axes[2]) == pytest.approx(1.0, abs=1e-9)
        assert planes.variance[number] == pytest.approx(size[2] ** 2 / (len(part) - 3), rel=1e-9)
    assert planes.variance[1] == 0.0
