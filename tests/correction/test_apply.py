"""A correction takes points in four forms and gives each back, moved alike."""

import laspy
import numpy as np
import open3d as o3d
import pytest

from mlscorr.correction import Correction
from mlscorr.survey import PointCloud
from tests.beds.drives import cloud_of, drive, with_errors

NEAR = 5e-4  # m; half a step of a LAS file's coordinates


@pytest.fixture(scope="module")
def correction():
    "Of a winding drive, up to decimeters"
    recorded = drive()
    return Correction(recorded, with_errors(recorded))


@pytest.fixture(scope="module")
def cloud(correction):
    "Points within 50 m of the drive, with a class each"
    plain = cloud_of(correction.recorded)
    classes = {"classification": np.arange(len(plain)).astype(np.uint8)}
    return PointCloud(plain.xyz, plain.gps_time, np.arange(len(plain)) % 900, classes)


def las_of(cloud):
    "The same points as laspy has them"
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales = np.full(3, 0.001)
    header.offsets = np.floor(cloud.xyz.min(axis=0))
    las = laspy.LasData(header)
    las.xyz = cloud.xyz
    las.gps_time = cloud.gps_time
    return las


def test_four_forms_are_moved_alike(correction, cloud):
    "A PointCloud, a tensor cloud, arrays to 1e-9 m; points of laspy to half a step, 0.5 mm"
    moved = correction.apply(cloud).xyz
    assert 0.1 < np.abs(moved - cloud.xyz).max() < 5.0  # m
    geometry = correction.apply(cloud.to_open3d())
    assert np.abs(PointCloud.from_open3d(geometry).xyz - moved).max() < 1e-9
    xyz, gps_time = correction.apply((cloud.xyz, cloud.gps_time))
    assert np.abs(xyz - moved).max() < 1e-9 and np.array_equal(gps_time, cloud.gps_time)
    las = las_of(cloud)
    rounded = PointCloud(np.asarray(las.xyz), cloud.gps_time, cloud.intensity)
    step = np.asarray(correction.apply(las).xyz) - correction.apply(rounded).xyz
    assert np.abs(step).max() < 1.001 * NEAR


def test_what_was_given_stays_as_it_is(correction, cloud):
    "No coordinate of the four forms changes in place"
    geometry = cloud.to_open3d()
    las = las_of(cloud)
    kept = cloud.xyz.copy(), geometry.point.positions.numpy().copy(), np.asarray(las.xyz)
    for points in (cloud, geometry, (cloud.xyz, cloud.gps_time), las):
        correction.apply(points)
    now = cloud.xyz, geometry.point.positions.numpy(), np.asarray(las.xyz)
    assert all(np.array_equal(*pair) for pair in zip(kept, now, strict=True))


def test_a_moved_tensor_cloud_keeps_all_else(correction, cloud):
    "Origin, times and attributes are those of the cloud given, in the same memory"
    geometry = cloud.to_open3d()
    geometry.point["colors"] = np.zeros((len(cloud), 3), np.float32)
    moved = correction.apply(geometry)
    assert set(moved.point) == set(geometry.point)
    for name in set(geometry.point) - {"positions"}:
        assert np.array_equal(moved.point[name].numpy(), geometry.point[name].numpy())
    assert np.shares_memory(moved.point.gps_time.numpy(), cloud.gps_time)


def test_a_pair_is_the_cloud_before_and_after(correction, cloud):
    "About one origin, colored alike, apart by the correction; all but the places is shared"
    origin = np.floor(cloud.xyz[0])
    for given in (cloud, cloud.to_open3d(), (cloud.xyz, cloud.gps_time)):
        pair = correction.before_after(given, origin)
        assert list(pair) == ["before", "after"]
        before, after = (PointCloud.from_open3d(geometry).xyz for geometry in pair.values())
        assert np.abs(before - cloud.xyz).max() < 1e-9
        assert np.abs(after - correction.apply(cloud).xyz).max() < 1e-9
        for geometry in pair.values():
            assert np.array_equal(geometry.point.origin[0].numpy(), origin)
            assert geometry.point.colors.dtype == o3d.core.uint8
        for name in ("gps_time", "intensity", "colors", "origin"):
            arrays = [geometry.point[name].numpy() for geometry in pair.values()]
            assert np.shares_memory(*arrays)


def test_a_pair_shows_intensities_as_greys_or_the_colors_of_the_cloud(correction, cloud):
    "The darkest point is black and the brightest white; colors that are there stay"
    pair = correction.before_after(cloud)
    colors = pair["after"].point.colors.numpy()
    assert colors[cloud.intensity == 0].max() == 0
    assert colors[cloud.intensity == 899].min() == 255
    red = np.tile(np.array([200, 0, 0], np.uint8), (len(cloud), 1))
    painted = PointCloud(cloud.xyz, cloud.gps_time, cloud.intensity, {"colors": red})
    pair = correction.before_after(painted)
    assert np.array_equal(pair["before"].point.colors.numpy(), red)


@pytest.mark.parametrize("form", ["tensor cloud", "arrays", "pair"])
def test_points_about_a_local_origin_are_refused(correction, cloud, form):
    "A geometry without its origin lies 3 400 km from the trajectory, which the message says"
    geometry = cloud.to_open3d()
    del geometry.point["origin"]
    local = geometry.point.positions.numpy()
    with pytest.raises(ValueError, match=r"3\d\d\d km from the trajectory.* local origin"):
        if form == "tensor cloud":
            correction.apply(geometry)
        elif form == "arrays":
            correction.apply((local, cloud.gps_time))
        else:
            correction.before_after(geometry)


def test_points_that_are_all_outside_in_time_are_refused(correction, cloud):
    "Times a week earlier: nothing would move, in no form; both ends of the trajectory are named"
    early = PointCloud(cloud.xyz, cloud.gps_time - 604_800.0, cloud.intensity)
    words = f"{len(cloud)} of {len(cloud)} points .*different time systems"
    forms = (early.to_open3d(), (early.xyz, early.gps_time), las_of(early))
    for points in forms:
        with pytest.raises(ValueError, match=words):
            correction.apply(points)
    with pytest.raises(ValueError, match=words):
        correction.before_after(early)


def test_some_points_outside_warn_and_stay(correction, cloud):
    "3 of the points have times of next week: they stay where they are, in every form"
    gps_time = cloud.gps_time.copy()
    gps_time[:3] += 604_800.0
    late = PointCloud(cloud.xyz, gps_time, cloud.intensity)
    with pytest.warns(UserWarning, match=f"3 of {len(cloud)} points"):
        moved = correction.apply(late.to_open3d())
    there = PointCloud.from_open3d(moved).xyz
    assert np.abs(there[:3] - cloud.xyz[:3]).max() < 1e-9
    assert np.abs(there[3:] - correction.apply(cloud).xyz[3:]).max() < 1e-9


def test_what_holds_no_points_is_refused(correction, cloud):
    "A legacy cloud, places without times, times of other points, a text, a place that is NaN"
    legacy = cloud.to_open3d().to_legacy()
    with pytest.raises(ValueError, match="legacy"):
        correction.apply(legacy)
    with pytest.raises(TypeError, match="ndarray"):
        correction.apply(cloud.xyz)
    with pytest.raises(ValueError, match="gps_time"):
        correction.apply((cloud.xyz, cloud.gps_time[:-1]))
    with pytest.raises(TypeError, match="str"):
        correction.apply("cloud.laz")
    broken = cloud.xyz.copy()
    broken[7, 2] = np.nan
    with pytest.raises(ValueError, match=f"1 of {len(cloud)} points .* point 7"):
        correction.apply((broken, cloud.gps_time))
