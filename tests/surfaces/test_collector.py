"""Features of clouds that stream in chunks."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.surfaces import FeatureCollector
from mlscorr.survey import MountedScanner, Mounting, PointCloud, Scanner
from tests.beds import tie_streets as street


def assert_same(first, second, shift=0.0):
    "Features equal but for rounding, and differences across borders of chunks"
    assert len(first) == len(second) > 100
    assert np.abs(second.centre - shift - first.centre).max() < 1e-6
    assert np.abs(second.direction - first.direction).max() < 1e-6
    assert np.array_equal(first.points, second.points)
    assert np.array_equal(first.pass_number, second.pass_number)
    assert np.allclose(first.variance, second.variance, rtol=0.1)


@pytest.mark.parametrize("cells_in_memory", [10**9, 100])
def test_chunks_are_as_good_as_the_whole(cells_in_memory):
    "Cells that straddle chunks are merged, also when those that have passed are closed early"
    survey = street.survey()
    parts = street.clouds()
    collector = FeatureCollector(survey, cells_in_memory)
    for file, cloud in zip(survey.clouds, parts, strict=True):
        for first in range(0, len(cloud), 7_001):
            collector.add(file, cloud[first : first + 7_001])
    assert_same(street.features(), collector.features())


def test_the_order_of_chunks_does_not_matter():
    "Chunks and files in any order give the same features and numbers of passes"
    survey = street.survey()
    collector = FeatureCollector(survey)
    pieces = [
        (file, cloud[first : first + 9_001])
        for file, cloud in zip(survey.clouds, street.clouds(), strict=True)
        for first in range(0, len(cloud), 9_001)
    ]
    for row in np.random.default_rng(3).permutation(len(pieces)):
        collector.add(*pieces[row])
    assert_same(street.features(), collector.features())


def test_features_move_with_the_origin():
    "A survey 300 km east and 700 km north of another one has the same features there"
    shift = np.array([300_000.0, 700_000.0, 40.0])
    survey = street.survey()
    path = replace(survey.trajectory, position=survey.trajectory.position + shift)
    moved = replace(survey, trajectory=path)
    parts = [replace(cloud, xyz=cloud.xyz + shift) for cloud in street.clouds()]
    assert_same(street.features(), street.collect(moved, parts), shift)


def test_passes_count_in_time_whatever_the_order_of_the_files():
    "The file that was recorded first holds pass 1"
    survey = street.survey()
    survey = replace(survey, clouds=survey.clouds[::-1])
    features = street.collect(survey, street.clouds()[::-1])
    early = features.gps_time < street.START + street.PAUSE / 2
    assert np.array_equal(features.pass_number, np.where(early, 1, 2))


def test_clouds_without_features_have_none():
    "No points, points in the air and a hundred times the same point: no feature, no warning"
    survey = street.survey()
    rng = np.random.default_rng(1)
    collector = FeatureCollector(survey)
    assert len(collector.features()) == 0
    scattered = rng.normal(0, 30, (5_000, 3))
    for points in (np.empty((0, 3)), scattered, np.tile([3.0, 4.0, 1.0], (100, 1))):
        time = np.full(len(points), street.START + 1.0)
        cloud = PointCloud(street.ORIGIN + points, time, np.ones(len(points), np.uint16))
        collector.add(survey.clouds[0], cloud)
        assert len(collector.features()) == 0


def test_a_wall_knows_when_each_end_was_seen():
    "At 8 m/s a wall along the way is seen at 1/8 s per metre, forward there and backward back"
    features = street.features()
    walls = features[(np.abs(features.direction[:, 1]) > 0.95) & (features.extent > 0.2)]
    for number, sign in ((1, 1.0), (2, -1.0)):
        along = np.median(walls.sweep[walls.pass_number == number, 0])
        assert abs(along - sign / street.SPEED) < 0.01  # s/m


def test_each_file_is_seen_from_its_own_scanner():
    "Two scanners with lever arms and noises of their own: what each finds alone, in one survey"
    survey = street.survey()
    parts = street.clouds()
    straight = Rotation.identity()
    mounted = [
        MountedScanner(
            str(x),
            Scanner(range_noise=0.01 + 0.001 * x),
            Mounting(np.array([0.0, 0.0, x]), straight),
            (file,),
        )
        for x, file in zip((2.0, -1.0), survey.clouds, strict=True)
    ]
    features = street.collect(replace(survey, scanners=tuple(mounted)), parts)
    for number, scanner in enumerate(mounted):
        alone = replace(survey, mounting=scanner.mounting, scanner=scanner.scanner)
        other = street.collect(alone, parts)
        inside = features.scanner == number
        same = other.pass_number == number + 1
        np.testing.assert_array_equal(features.centre[inside], other.centre[same])
        np.testing.assert_array_equal(features.variance[inside], other.variance[same])
    from_one = street.collect(replace(survey, mounting=mounted[0].mounting), parts)
    assert not np.array_equal(features.centre, from_one.centre)  # a post lies behind what is seen
