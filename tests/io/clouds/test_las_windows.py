"""Windows of a file by time hold all points of their spans, and few others."""

import struct

import laspy
import numpy as np
import pytest

from mlscorr.io import SETTINGS
from mlscorr.io.clouds import read_chunks, read_intervals, read_layout, spread_records
from mlscorr.io.clouds.las import records_at
from mlscorr.survey import CloudFile, PointCloud

# and points a second
POINTS = 400_000
RATE = 50_000.0


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
    chunks = [chunk.gps_time for chunk in read_intervals(file, np.array(spans), limit)]
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
    with pytest.raises(ValueError, match="not in time order"):
        times(CloudFile(tmp_path / "b.laz", POINTS, 100.0, "week"), [[1101.0, 1102.0]])


def test_a_file_of_more_than_2_to_the_32_points(tmp_path):
    "Numbers of points and bytes beyond 32 bits are sought and read; the file is a sparse one"
    points = 5_000_000_000
    late = 1_000
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales = np.full(3, 0.001)
    header.offsets = [532_000.0, 3_374_000.0, 40.0]
    las = laspy.LasData(header)
    las.points = laspy.ScaleAwarePointRecord.zeros(late, header=header)
    las.gps_time, las.X = 357_900.0 + np.arange(late) * 1e-3, np.arange(late)
    las.write(tmp_path / "big.las")
    data = bytearray((tmp_path / "big.las").read_bytes())
    start = len(data) - 30 * late
    struct.pack_into("<Q", data, 247, points)
    struct.pack_into("<I", data, 107, 0)
    with (tmp_path / "big.las").open("wb") as file:
        file.write(data[:start])
        file.seek(start + 30 * (points - late))
        file.write(data[-30 * late :])
    layout = read_layout(tmp_path / "big.las")
    assert layout.points == points
    places = points - late + np.array([0, 7, late - 1])
    assert np.allclose(
        records_at(layout, places)["gps_time"], 357_900.0 + np.array([0.0, 0.007, 0.999])
    )
    assert spread_records(layout)[0][-1] == points - 1
    spans = np.array([[357_900.4, 357_900.5]])
    windows = list(read_intervals(CloudFile(layout.path, points, 0.0, "week"), spans))
    read = PointCloud.concatenate(windows)
    assert {400, 499} <= set(np.rint((read.xyz[:, 0] - 532_000.0) * 1e3).astype(int).tolist())
    assert len(read) <= 2 * SETTINGS.close_places
    last = list(read_chunks(CloudFile(layout.path, points, 0.0, "week"), first=points - 3))
    assert len(last[0]) == 3
