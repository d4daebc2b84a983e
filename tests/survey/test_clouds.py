"""Chunks of points: selected and put together without loss."""

from pathlib import Path

import numpy as np

from mlscorr.survey import CloudFile, PointCloud

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


def test_a_file_of_several_scanners_is_parted_by_ids():
    "All of a file, or the points whose ids are a scanner's; its name says which"
    ids = np.array([3, 1, 2, 3])
    whole = CloudFile(Path("merged.laz"), 4, 0.0, "week")
    part = CloudFile(Path("merged.laz"), 3, 0.0, "week", (2, 3))
    assert ids[whole.rows(ids)].tolist() == [3, 1, 2, 3]
    assert ids[part.rows(ids)].tolist() == [3, 2, 3]
    assert (whole.name, part.name) == ("merged.laz", "merged.laz (point_source_id 2, 3)")
