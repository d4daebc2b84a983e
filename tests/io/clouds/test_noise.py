"""Points flagged as noise: which they are in each point format, and that none is measured."""

import laspy
import numpy as np
import pytest

from mlscorr.io.clouds import counted_noise, read_chunks
from mlscorr.survey import CloudFile

# s of week; UTM
START = 357_900.0
CORNER = [532_000.0, 3_374_000.0, 40.0]
POINTS = 1_000


def write_flagged(path, point_format):
    "A file with all classes of its format, every fifth point withheld, and what of them is noise"
    header = laspy.LasHeader(point_format=point_format)
    header.scales = [0.001] * 3
    header.offsets = CORNER
    las = laspy.LasData(header)
    number = np.arange(POINTS)
    las.xyz = np.array(CORNER) + np.outer(number, [0.01, 0.0, 0.0])
    las.gps_time = START + number * 0.001
    classes = number % (256 if point_format >= 6 else 32)
    las.classification = classes
    las.withheld = number % 5 == 0
    las.synthetic = las.key_point = number % 2 == 0
    if point_format >= 6:
        las.overlap = number % 3 == 0
    las.write(path)
    return classes, number % 5 == 0


@pytest.mark.parametrize("point_format", [1, 3, 6, 7, 8])
@pytest.mark.parametrize("chosen", [(7, 18), (), (2, 7, 31)])
def test_withheld_points_and_some_classes_are_not_read(point_format, chosen, tmp_path):
    "Read are all points but withheld ones and those of the classes, in order, and both are counted"
    path = tmp_path / "cloud.laz"
    classes, is_withheld = write_flagged(path, point_format)
    is_noise = is_withheld | np.isin(classes, chosen)
    file = CloudFile(path, POINTS, 0.0, "week", noise_classes=chosen)
    with counted_noise() as count:
        times = np.concatenate([chunk.gps_time for chunk in read_chunks(file, 300)])
        list(read_chunks(file))  # once more is counted once
    assert np.array_equal(times, START + np.flatnonzero(~is_noise) * 0.001)
    assert count.totals == (is_noise.sum(), POINTS)
    assert str(is_noise.sum()) in count.sentence


def test_a_cloud_without_flags_is_read_whole(tmp_path):
    "Without flags all points are read, and nothing is reported"
    path = tmp_path / "cloud.las"
    header = laspy.LasHeader(point_format=6)
    header.offsets = CORNER
    las = laspy.LasData(header)
    las.xyz = np.array(CORNER) + np.outer(np.arange(POINTS), [0.01, 0.0, 0.0])
    las.gps_time = START + np.arange(POINTS) * 0.001
    las.write(path)
    with counted_noise() as count:
        chunks = list(read_chunks(CloudFile(path, POINTS, 0.0, "week")))
    assert sum(map(len, chunks)) == POINTS
    assert count.sentence == ""
