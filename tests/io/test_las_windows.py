"""Windows of a file by time hold all points of their spans, and few others."""

import laspy
import numpy as np
import pytest

from mlscorr.io.las_windows import read_windows
from mlscorr.io.settings import SETTINGS
from mlscorr.survey import CloudFile

POINTS, RATE = 400_000, 50_000.0  # and points a second


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    "A LAZ file of 8 s in order of time, which lies 100 s before the trajectory's"
    path = tmp_path_factory.mktemp("windows") / "a.laz"
    header = laspy.LasHeader(point_format=6, version="1.4")
    points = laspy.ScaleAwarePointRecord.zeros(POINTS, header=header)
    points["gps_time"] = 1000.0 + np.arange(POINTS) / RATE
    with laspy.open(path, "w", header=header) as writer:
        writer.write_points(points)
    return CloudFile(path, POINTS, 100.0, "week")


def times(file, spans, limit=100_000):
    chunks = [chunk.gps_time for chunk in read_windows(file, np.array(spans), limit)]
    return np.concatenate([np.empty(0), *chunks])


def test_spans_are_read_whole_and_once(file):
    "Two spans of half a second: each of their points once, with those of a LAZ chunk about them"
    read = times(file, [[1101.0, 1101.5], [1105.0, 1105.5], [1300.0, 1301.0]])
    for start in (1101.0, 1105.0):
        inside = read[(read >= start) & (read <= start + 0.5)]
        assert len(inside) == len(np.unique(inside)) == 25_001
    assert len(read) <= 50_001 + 4 * SETTINGS.close_places


def test_of_a_long_span_the_middle_is_read(file):
    "As when the vehicle stands beside a target: no more points than the limit"
    read = times(file, [[1100.0, 1108.0]])
    assert abs(len(read) - 100_000) <= 2
    assert abs(read.mean() - 1104.0) < 0.1


def test_a_short_file_is_read_whole_and_a_long_one_only_in_order(file, tmp_path):
    "Sorted by place, a time stands anywhere in a file"
    assert len(times(file, [[0.0, 1.0]], POINTS)) == POINTS
    las = laspy.read(file.path)
    las.points = las.points[::-1].copy()
    las.write(tmp_path / "b.laz")
    with pytest.raises(ValueError, match="not in order of time"):
        times(CloudFile(tmp_path / "b.laz", POINTS, 100.0, "week"), [[1101.0, 1102.0]])
