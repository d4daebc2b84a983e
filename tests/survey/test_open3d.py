"""Clouds as Open3D's tensor geometries and back, at map coordinates."""

import tracemalloc

import numpy as np
import open3d as o3d
import pytest

from mlscorr.survey import PointCloud

ORIGIN = np.array([532_000.0, 3_374_000.0, 42.0])  # m; UTM, zone 50
START = 357_700.0  # s of the GPS week
TYPES = ("u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f4", "f8", "?")


def cloud_of(n, rng, attributes=None):
    "Points within 50 m, with times and intensities"
    return PointCloud.from_arrays(
        ORIGIN + rng.uniform(-50.0, 50.0, (n, 3)),
        START + np.sort(rng.uniform(0.0, 60.0, n)),
        rng.integers(0, 65_536, n).astype(np.uint16),
        attributes,
    )


@pytest.fixture
def cloud(rng):
    "400 points with an attribute of each type, and vectors"
    attributes = {f"as_{kind}": rng.integers(0, 2, 400).astype(kind) for kind in TYPES}
    attributes["rgb"] = rng.integers(0, 65_536, (400, 3)).astype(np.uint16)
    return cloud_of(400, rng, attributes)


@pytest.fixture
def rng():
    return np.random.default_rng(7)


def assert_same(one, other):
    "The same points, to 1e-9 m about the origin, with the same attributes of the same types"
    np.testing.assert_allclose(one.xyz - ORIGIN, other.xyz - ORIGIN, rtol=0, atol=1e-9)
    assert np.array_equal(one.gps_time, other.gps_time)
    assert np.array_equal(one.intensity, other.intensity)
    assert one.intensity.dtype == other.intensity.dtype
    assert set(one.attributes) == set(other.attributes)
    for name, values in one.attributes.items():
        assert np.array_equal(values, other.attributes[name])
        assert values.dtype == other.attributes[name].dtype


@pytest.mark.parametrize("origin", [None, ORIGIN, [531_900.25, 3_374_100.0, 0.0]])
def test_a_cloud_comes_back_as_it_went(cloud, origin):
    "Places to 1e-9 m, times and attributes exactly, with their types, about any origin near it"
    geometry = cloud.to_open3d(origin)
    assert geometry.point.positions.dtype == o3d.core.float64
    assert_same(PointCloud.from_open3d(geometry), cloud)


def test_parts_that_open3d_takes_come_back(cloud):
    "Selecting, cropping and thinning in Open3D keep the origin with the points"
    geometry = cloud.to_open3d()
    rows = np.arange(0, 400, 3)
    picked = geometry.select_by_index(o3d.core.Tensor.from_numpy(rows))
    assert_same(PointCloud.from_open3d(picked), cloud[rows])
    low = o3d.core.Tensor([-20.0, -20.0, -20.0])
    cropped = geometry.crop(o3d.t.geometry.AxisAlignedBoundingBox(low, -low))
    positions = geometry.point.positions.numpy()
    inside = (np.abs(positions) <= 20.0).all(axis=1)
    assert 10 < inside.sum() < 100
    assert_same(PointCloud.from_open3d(cropped), cloud[inside])
    thinned = PointCloud.from_open3d(geometry.uniform_down_sample(4))
    assert_same(thinned, cloud[::4])


def test_clouds_of_two_origins_are_put_together(cloud):
    "Each point is where it was, though a kilometer lies between both origins"
    early, late = cloud[:150], cloud[150:]
    beside = ORIGIN + np.array([1000.0, 0.0, -5.0])
    geometry = early.to_open3d(ORIGIN).append(late.to_open3d(beside))
    assert_same(PointCloud.from_open3d(geometry), cloud)


def test_a_cloud_that_was_moved_in_open3d_comes_back_moved(cloud):
    "Open3D moves a cloud about its origin by 1.25 m, and it is there in the map"
    geometry = cloud.to_open3d().translate([1.25, 0.0, 0.0], relative=True)
    moved = PointCloud.from_open3d(geometry).xyz
    np.testing.assert_allclose(moved - cloud.xyz, np.tile([1.25, 0, 0], (400, 1)), atol=1e-9)


def test_attributes_share_the_memory_of_the_cloud(cloud):
    "A time that is changed in the geometry is changed in the cloud, and no copy is made"
    geometry = cloud.to_open3d()
    for name in ("gps_time", "intensity", *cloud.attributes):
        values = getattr(cloud, name, None)
        if values is None:
            values = cloud.attributes[name]
        assert np.shares_memory(geometry.point[name].numpy(), values)


def test_a_geometry_takes_no_more_memory_than_the_cloud(rng):
    "At its peak, to_open3d takes less memory than the cloud itself has: both are twice the cloud"
    cloud = cloud_of(1_000_000, rng)
    size = cloud.xyz.nbytes + cloud.gps_time.nbytes + cloud.intensity.nbytes
    cloud[:10].to_open3d()  # Open3D is loaded
    tracemalloc.start()
    geometry = cloud.to_open3d()
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert len(geometry.point.positions) == 1_000_000
    assert peak < size


def test_a_cloud_outlives_its_arrays(rng):
    "The geometry keeps the arrays that it shares, once the cloud itself is gone"
    geometry = cloud_of(5, rng).to_open3d(ORIGIN)
    times = geometry.point.gps_time.numpy().copy()
    for _ in range(50):
        np.full(5, np.nan)
    assert np.array_equal(geometry.point.gps_time.numpy(), times)
    assert np.array_equal(geometry.point.origin.numpy(), np.tile(ORIGIN, (5, 1)))


def test_an_empty_cloud_goes_and_comes(rng):
    "A chunk without a point is no error"
    assert len(PointCloud.from_open3d(cloud_of(0, rng).to_open3d())) == 0


def test_an_attribute_of_the_other_byte_order_keeps_its_values(rng):
    "Big-endian numbers of a file become those of the machine"
    values = np.arange(5.0).astype(">f8")
    geometry = cloud_of(5, rng, {"range": values}).to_open3d()
    assert geometry.point["range"].numpy()[:, 0].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]


@pytest.mark.parametrize(
    ("attributes", "words"),
    [
        ({"origin": np.zeros((5, 3))}, "origin"),
        ({"positions": np.zeros((5, 3))}, "positions"),
        ({"range": np.zeros(5, np.float16)}, "range has the type float16"),
        ({"name": np.array(["wall"] * 5)}, "name has the type <U4"),
    ],
)
def test_attributes_that_open3d_cannot_hold_are_refused(rng, attributes, words):
    "By name and type, before anything is lost"
    with pytest.raises(ValueError, match=words):
        cloud_of(5, rng, attributes).to_open3d()


@pytest.mark.parametrize("origin", [[1.0, 2.0], [np.nan, 0.0, 0.0]])
def test_an_origin_that_is_no_place_is_refused(rng, origin):
    "Two numbers, and one that is not finite"
    with pytest.raises(ValueError, match="is invalid"):
        cloud_of(5, rng).to_open3d(origin)


def test_a_cloud_without_times_is_refused(rng):
    "The message names the attributes that it has, and the one that it needs"
    geometry = cloud_of(5, rng).to_open3d()
    del geometry.point["gps_time"]
    with pytest.raises(ValueError, match=r"intensity\).*gps_time"):
        PointCloud.from_open3d(geometry)


def test_a_legacy_cloud_is_refused(rng):
    "It has no place for times"
    with pytest.raises(ValueError, match="legacy"):
        PointCloud.from_open3d(cloud_of(5, rng).to_open3d().to_legacy())


def test_a_cloud_without_places_is_refused():
    "An empty geometry is not an empty cloud"
    with pytest.raises(ValueError, match="no positions"):
        PointCloud.from_open3d(o3d.t.geometry.PointCloud())


def test_places_that_are_not_finite_are_refused(rng):
    "The number of points and the first of them are named"
    geometry = cloud_of(5, rng).to_open3d()
    positions = geometry.point.positions.numpy()
    positions[[2, 4], 1] = np.nan
    with pytest.raises(ValueError, match=r"2 of 5 points .* point 2"):
        PointCloud.from_open3d(geometry)


def test_arrays_of_other_lengths_are_refused(rng):
    "Times of other points, and coordinates without height"
    with pytest.raises(ValueError, match="xyz 5, gps_time 4"):
        PointCloud.from_arrays(np.zeros((5, 3)), np.zeros(4))
    with pytest.raises(ValueError, match=r"\(5, 2\)"):
        PointCloud.from_arrays(np.zeros((5, 2)), np.zeros(5))


def test_float32_at_map_size_warns_of_what_is_lost(rng):
    "3 374 000 m in float32 goes in steps of 0.25 m: up to 0.125 m is lost, and the warning says so"
    xyz = cloud_of(50, rng).xyz
    with pytest.warns(UserWarning, match=r"0\.25 m, with errors of up to 0\.125 m"):
        rounded = PointCloud.from_arrays(xyz.astype(np.float32), np.zeros(50))
    lost = np.abs(rounded.xyz - xyz).max()
    assert 0.05 < lost <= 0.125
    geometry = o3d.t.geometry.PointCloud(o3d.core.Tensor.from_numpy(xyz.astype(np.float32)))
    geometry.point["gps_time"] = np.zeros((50, 1))
    with pytest.warns(UserWarning, match=r"up to 0\.125 m"):
        PointCloud.from_open3d(geometry)


def test_float32_about_an_origin_is_as_good_as_a_las_file(rng):
    "Within 50 m of its origin float32 keeps 0.01 mm, and nothing is warned of"
    cloud = cloud_of(50, rng)
    geometry = cloud.to_open3d(ORIGIN)
    geometry.point.positions = geometry.point.positions.to(o3d.core.float32)
    np.testing.assert_allclose(PointCloud.from_open3d(geometry).xyz, cloud.xyz, rtol=0, atol=1e-5)
