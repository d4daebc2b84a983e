"""Moments of a stream are whole, wherever it was cut into chunks."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.surfaces import MomentStream
from mlscorr.survey import PointCloud, Trajectory

START = 413_200.0  # s
POINTS = 5_000


@pytest.mark.parametrize("size", [70, 999, POINTS])
@pytest.mark.parametrize("order", ["up", "down", "late"])
def test_every_moment_comes_once_and_whole(size, order):
    "Points up to 0.4 s late, or backwards: each second is given once, with all of its points"
    rng = np.random.default_rng(1)
    time = START + np.sort(rng.uniform(0.0, 20.0, POINTS))
    if order == "down":
        time = time[::-1]
    elif order == "late":
        time = time[np.argsort(time + rng.uniform(0.0, 0.4, POINTS))]
    cloud = PointCloud(np.outer(time - START, [1.0, 0.0, 0.0]), time, np.ones(POINTS))
    path = np.array([[0.0, 0.0, 0.0], [25.0, 0.0, 0.0]])
    trajectory = Trajectory(START + np.array([-1.0, 25.0]), path, Rotation.identity(2))
    stream = MomentStream(trajectory)
    found = {}

    def keep(until=np.inf):
        for segment, part, number in stream.moments(until):
            assert segment == 0
            np.testing.assert_array_equal(part.gps_time, time[number])
            (second,) = np.unique(np.floor(part.gps_time))
            assert second not in found
            found[second] = len(part)

    for first in range(0, POINTS, size):
        rows = np.arange(first, min(first + size, POINTS))
        stream.add(cloud[rows], rows)
        keep(time[rows[-1]])
    keep()
    seconds, count = np.unique(np.floor(time), return_counts=True)
    assert found == dict(zip(seconds, count, strict=True))
