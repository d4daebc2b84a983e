"""Moments of cells, summed by compiled loops, against numpy."""

import numpy as np

from mlscorr.survey import PointCloud
from mlscorr.ties._cells import CellTable

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
    table = CellTable(ORIGIN, START, 1.0, 1.0)
    starts = np.full(2, np.inf)
    table.add(cloud, PASSES, 4, starts)
    return table, starts


def test_moments_are_those_of_numpy():
    "Number, mean and covariance of each cell equal numpy's of the same points to 1e-12 m^2"
    cloud = scattered(40_000)
    table, _ = table_of(cloud)
    middle, begin, group, moments = table.of(np.ones(table.count, bool))
    for i in range(0, table.count, 400):
        low = begin[i] if group[i] in (4, 5) else np.nan
        inside = (np.abs(cloud.xyz - middle[i]) <= 0.5).all(axis=1)
        inside &= (cloud.gps_time >= low) & (cloud.gps_time < low + 1.0)
        local = cloud.xyz[inside] - middle[i]
        assert moments[i, 0] == inside.sum()
        assert np.allclose(moments[i, 2:5], local.sum(axis=0), atol=1e-9)
        rows, columns = np.triu_indices(3)
        assert np.allclose(moments[i, 5:11], (local.T @ local)[rows, columns], atol=1e-9)


def test_points_without_a_pose_are_left_out():
    "Points between the passes are in no cell, and each pass begins with its first point"
    cloud = scattered(5_000)
    table, starts = table_of(cloud)
    *_, moments = table.of(np.ones(table.count, bool))
    time = cloud.gps_time
    inside = [(time >= low) & (time <= high) for low, high in PASSES]
    assert moments[:, 0].sum() == sum(map(np.sum, inside))
    assert np.array_equal(starts, [time[rows].min() for rows in inside])


def test_differences_are_those_of_neighbours_in_one_cell():
    "Only points that follow each other in one cell and moment are compared"
    steps = np.array([[0.1, 0.1, 0.1], [0.13, 0.1, 0.1], [1.5, 0.1, 0.1], [0.2, 0.1, 0.1]])
    cloud = PointCloud(ORIGIN + steps, START + np.arange(4) / 100, np.ones(4))
    table, _ = table_of(cloud)
    *_, moments = table.of(np.ones(table.count, bool))
    assert np.array_equal(moments[:, 11], [1, 0])
    assert np.isclose(moments[0, 12], 0.03**2, atol=1e-9)


def test_cells_that_are_removed_leave_the_others():
    "After half of the cells are removed, more points add up as if the others stood alone"
    cloud = scattered(9_000)
    table, starts = table_of(cloud)
    early = table.moment < 30
    middle, begin, *_, moments = table.of(~early)
    table.remove(early)
    table.add(cloud, PASSES, 4, starts)
    again = table.of(np.ones(table.count, bool))
    assert np.array_equal(again[0][: len(middle)], middle)
    assert np.array_equal(again[1][: len(begin)], begin)
    assert np.allclose(again[3][: len(middle)], 2 * moments)
