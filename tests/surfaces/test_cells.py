"""Moments of cells, summed by compiled loops, against numpy."""

import numpy as np

from mlscorr.surfaces import CellTable, block_chance, cell_corner, place_key
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
    assert set(cells.group) == {4, 5}
    for i in range(0, table.count, 400):
        low = cells.begin[i]
        inside = (np.abs(cloud.xyz - cells.middle[i]) <= 0.5).all(axis=1)
        inside &= (cloud.gps_time >= low) & (cloud.gps_time < low + 1.0)
        local = cloud.xyz[inside] - cells.middle[i]
        assert cells.points[i] == inside.sum()
        assert np.allclose(cells.offset[i], local.mean(axis=0), atol=1e-9)
        assert np.allclose(cells.covariance[i], np.cov(local.T, bias=True), atol=1e-9)


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


def test_sums_do_not_depend_on_chunks():
    "Cut anywhere, a cloud gives the same cells bit for bit but for neighbours across the cut"
    cloud = scattered(20_000)
    value = np.log10(1.0 + cloud.intensity)
    whole = CellTable(ORIGIN)
    parts = CellTable(ORIGIN)
    whole.add(cloud, values=value)
    for first in range(0, len(cloud), 777):
        rows = slice(first, first + 777)
        parts.add(cloud[rows], values=value[rows])
    for name in ("middle", "begin", "points", "centre", "covariance", "gps_time", "value", "key"):
        np.testing.assert_array_equal(getattr(parts.of(), name), getattr(whole.of(), name), name)


def test_every_point_knows_its_cell():
    "Rows of points lead to the cell around them, and the cell's value is the mean of theirs"
    cloud = scattered(5_000)
    value = np.arange(5_000.0)
    table = CellTable(ORIGIN, START)
    rows = table.add(cloud, PASSES, values=value)
    cells = table.of()
    inside = rows >= 0
    assert np.abs(cloud.xyz[inside] - cells.middle[rows[inside]]).max() <= 0.5
    since = cloud.gps_time[inside] - cells.begin[rows[inside]]
    assert since.min() >= 0.0 and since.max() < 1.0
    sums = np.bincount(rows[inside], value[inside])
    np.testing.assert_allclose(cells.value, sums / np.bincount(rows[inside]))


def test_a_key_is_that_of_the_points_whatever_the_table():
    "Cells have the number and the block of their points, from whichever corner they are counted"
    cloud = scattered(3_000)
    for place in ORIGIN + np.array([[0.0, 0.0, 0.0], [70.0, -300.0, 5.0]]):
        table = CellTable(cell_corner(place))
        rows = table.add(cloud)
        cells = table.of()
        np.testing.assert_array_equal(cells.key[rows], place_key(cloud.xyz, cloud.gps_time))
        np.testing.assert_array_equal(cells.chance[rows], block_chance(cloud.xyz))
