"""Moments of cells, summed by compiled loops, against numpy."""

import numpy as np

from mlscorr.surfaces import CellTable, covariances
from mlscorr.survey import PointCloud

ORIGIN = np.array([447_000.0, 5_410_000.0, 120.0])  # m
START = 413_200.0  # s
PASSES = np.array([[START, START + 10.0], [START + 60.0, START + 70.0]])


def scattered(n, seed=1):
    "Points to both sides of the origin, during both passes and between them"
    rng = np.random.default_rng(seed)
    xyz = ORIGIN + rng.uniform(-6, 6, (n, 3))
    return PointCloud(xyz, np.sort(START + rng.uniform(0, 70, n)), rng.integers(0, 99, n))


def table_of(cloud):
    "A CellTable with a cloud, and the first times of both passes"
    table = CellTable(ORIGIN, START)
    starts = np.full(2, np.inf)
    table.add(cloud, PASSES, 4, starts)
    return table, starts


def test_moments_are_those_of_numpy():
    "Number, mean and covariance of each cell equal numpy's of the same points to 1e-12 m^2"
    cloud = scattered(40_000)
    table, _ = table_of(cloud)
    cells = table.of()
    covariance = covariances(cells.moments)
    assert set(cells.group) == {4, 5}
    for i in range(0, table.count, 400):
        low = cells.begin[i]
        inside = (np.abs(cloud.xyz - cells.middle[i]) <= 0.5).all(axis=1)
        inside &= (cloud.gps_time >= low) & (cloud.gps_time < low + 1.0)
        local = cloud.xyz[inside] - cells.middle[i]
        assert cells.points[i] == inside.sum()
        assert np.allclose(cells.offset[i], local.mean(axis=0), atol=1e-9)
        assert np.allclose(covariance[i], np.cov(local.T, bias=True), atol=1e-9)


def test_points_without_a_pose_are_left_out():
    "Points between the passes are in no cell, and each pass begins with its first point"
    cloud = scattered(5_000)
    table, starts = table_of(cloud)
    time = cloud.gps_time
    inside = [(time >= low) & (time <= high) for low, high in PASSES]
    assert table.of().points.sum() == sum(map(np.sum, inside))
    assert np.array_equal(starts, [time[rows].min() for rows in inside])


def test_differences_are_those_of_neighbours_in_one_cell():
    "Only points that follow each other in one cell and moment are compared"
    steps = np.array([[0.1, 0.1, 0.1], [0.13, 0.1, 0.1], [1.5, 0.1, 0.1], [0.2, 0.1, 0.1]])
    cloud = PointCloud(ORIGIN + steps, START + np.arange(4) / 100, np.ones(4))
    table, _ = table_of(cloud)
    moments = table.of().moments
    assert np.array_equal(moments[:, 11], [1, 0])
    assert np.isclose(moments[0, 12], 0.03**2, atol=1e-9)


def test_cells_that_are_removed_leave_the_others():
    "After half of the cells are removed, more points add up as if the others stood alone"
    cloud = scattered(9_000)
    table, starts = table_of(cloud)
    early = table.moment < 30
    late = table.of(~early)
    table.remove(early)
    table.add(cloud, PASSES, 4, starts)
    again = table.of()[: len(late)]
    assert np.array_equal(again.middle, late.middle)
    assert np.array_equal(again.begin, late.begin)
    assert np.allclose(again.moments, 2 * late.moments)
