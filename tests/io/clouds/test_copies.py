"""The same points in two files are told by their number, bounds and times, however written."""

import laspy
import numpy as np
import pytest

from mlscorr.io.clouds import find_copies
from tests.beds.copc_files import write_copc
from tests.beds.foreign_clouds import write_e57

EAST = 532_000.0
NORTH = 3_374_000.0
START = 413_200.0
WEEK = 604_800.0 * 2300
POINTS = 3_000


def times_of(seed=1):
    return START + np.sort(np.random.default_rng(seed).uniform(0.0, 20.0, POINTS))


def write_las(path, gps_time=None, order=slice(None), is_standard=False, scale=0.001, away=0.0):
    "A cloud of one street: its points in an order, times in a system, coordinates in steps"
    rng = np.random.default_rng(3)
    place = np.array([EAST, NORTH, 40.0]) + np.round(rng.uniform(-30.0, 30.0, (POINTS, 3)), 3)
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales = [scale] * 3
    header.offsets = [EAST, NORTH, 0.0]
    header.global_encoding.gps_time_type = laspy.header.GpsTimeType(int(is_standard))
    las = laspy.LasData(header)
    las.xyz = place[order] + away
    times = times_of() if gps_time is None else gps_time
    las.gps_time = times[order] + (WEEK - 1e9) * is_standard
    las.intensity = np.arange(POINTS)[order]
    las.write(path)
    return path


def as_laz(path, first):
    laspy.read(first).write(path)


def as_copc(path, first):
    write_copc(first, path)


def by_place(path, first):
    write_las(path, order=np.random.default_rng(4).permutation(POINTS))


def in_standard_time(path, first):
    write_las(path, is_standard=True)


def in_other_steps_and_order(path, first):
    write_las(path, scale=0.002, order=slice(None, None, -1), is_standard=True)


def as_e57(path, first):
    las = laspy.read(first)
    places = dict(zip(("cartesianX", "cartesianY", "cartesianZ"), las.xyz.T, strict=True))
    fields = {**places, "timeStamp": np.array(las.gps_time), "intensity": np.array(las.intensity)}
    write_e57(path, [{"fields": fields}])


@pytest.mark.parametrize(
    ("name", "write"),
    [
        ("a.laz", as_laz),
        ("a.copc.laz", as_copc),
        ("b.las", by_place),
        ("b.las", in_standard_time),
        ("b.las", in_other_steps_and_order),
        ("b.e57", as_e57),
    ],
)
def test_points_written_anew_are_a_copy(name, write, tmp_path):
    "In another format, order, time system or step: no byte of them need be the same"
    first = write_las(tmp_path / "a.las")
    copy = tmp_path / name
    write(copy, first)
    assert find_copies([first, copy]) == {copy: first}
    assert find_copies([copy, first]) == {first: copy}


@pytest.mark.parametrize(
    "change",
    [
        {"gps_time": times_of() + 30.0},
        {"gps_time": times_of(2)},
        {"away": 0.01},
        {"gps_time": times_of()[::-1] + 0.001, "is_standard": True},
    ],
)
def test_points_of_another_pass_are_none(change, tmp_path):
    "The same places half a minute later, at other times of one span, or 1 cm beside: two passes"
    paths = [write_las(tmp_path / "a.las"), write_las(tmp_path / "b.las", **change)]
    assert find_copies(paths) == {}


def test_clouds_whose_headers_differ_are_not_read(tmp_path):
    "Number and bounds tell, of files that hold no point behind their header: a thousand are quick"
    paths = [write_las(tmp_path / f"{k}.las", away=float(k)) for k in range(3)]
    for path in paths:
        with laspy.open(path) as reader:
            start = reader.header.offset_to_point_data
        path.write_bytes(path.read_bytes()[:start])
    assert find_copies(paths) == {}
