"""Chunks of points: selected and put together without loss."""

import numpy as np

from mlscorr.survey import PointCloud

CLOUD = PointCloud(np.arange(30.0).reshape(10, 3), np.arange(10.0), np.arange(10))


def test_chunks_put_together_are_the_whole():
    "Parts in their order give each coordinate, time and intensity again"
    whole = PointCloud.concatenate([CLOUD[:3], CLOUD[3:3], CLOUD[3:]])
    assert np.array_equal(whole.xyz, CLOUD.xyz) and len(whole) == 10
    assert np.array_equal(whole.gps_time, CLOUD.gps_time)
    assert np.array_equal(whole.intensity, CLOUD.intensity)


def test_a_selection_keeps_points_whole():
    "A mask takes coordinates, times and intensities of the same points"
    late = CLOUD[CLOUD.gps_time > 6.5]
    assert late.intensity.tolist() == [7, 8, 9] and late.xyz[0].tolist() == [21.0, 22.0, 23.0]
