"""Additions to a corrected copy: displacement of each point, and provenance."""

import json

import laspy
import numpy as np
import pytest

from mlscorr.io.clouds import Additions, CorrectedPart, write_parts
from tests.beds.copc_files import write_copc
from tests.beds.copies import write_corrected
from tests.io.clouds.test_las import cloud_of, covering, write_street

NAMES = ("displacement_easting", "displacement_northing", "displacement_height")
SHIFT = (0.3, -0.2, 0.1)  # m
TEXT = json.dumps({"schema": "mlscorr.provenance/1", "version": "9.9"})
KNOWN = Additions(provenance=TEXT, version="9.9")


def written(path, target, additions):
    "The corrected copy of a file with additions, as laspy reads it"
    write_parts([CorrectedPart(cloud_of(path), covering(path, SHIFT), additions=additions)], target)
    return laspy.read(target)


def of_gps_time(las):
    "Records in an order that does not depend on that of the file"
    return np.lexsort([las.points.array["intensity"], las.gps_time])


def assert_displaced(las, source):
    "Stored integers less those of the displacement are the recorded ones; the shift is known"
    old, new = of_gps_time(source), of_gps_time(las)
    for axis, name in enumerate(NAMES):
        raw = las.points.array[name]
        assert np.array_equal((las["XYZ"[axis]] - raw)[new], source["XYZ"[axis]][old])
        assert np.abs(np.asarray(las[name]) - SHIFT[axis]).max() < 1.01e-3  # m, a step of the file
    for name in ("intensity", "amplitude", "ring"):
        assert np.array_equal(np.asarray(las[name])[new], np.asarray(source[name])[old])


@pytest.mark.parametrize("suffix", [".laz", ".las"])
@pytest.mark.parametrize("point_format", [1, 6, 10])
def test_displacements_give_the_recorded_points_back(point_format, suffix, tmp_path):
    "In old, new and waveform formats the recorded integers come back exactly"
    path = write_street(tmp_path / f"in{suffix}", point_format, points=2_000)
    las = written(path, tmp_path / f"out{suffix}", Additions(displacement=True))
    assert_displaced(las, laspy.read(path))
    assert tuple(las.point_format.dimension_names)[-3:] == NAMES


def test_points_of_a_copc_carry_displacement_and_provenance(tmp_path):
    "The copy is a COPC again, with all VLRs of the first, and one more"
    path = write_street(tmp_path / "in.laz", 7, points=3_000, evlrs=False)
    copc = write_copc(path, tmp_path / "in.copc.laz")
    both = Additions(displacement=True, provenance=TEXT, version="9.9")
    las = written(copc, tmp_path / "out.copc.laz", both)
    assert_displaced(las, laspy.read(copc))
    with laspy.CopcReader.open(tmp_path / "out.copc.laz") as reader:
        assert len(reader.query()) == 3_000
        assert [v.record_id for v in reader.header.vlrs if v.user_id == "mlscorr"] == [1]


@pytest.mark.parametrize("suffix", [".laz", ".las"])
@pytest.mark.parametrize("point_format", [1, 6, 9])
def test_provenance_adds_one_vlr_and_changes_no_point(point_format, suffix, tmp_path):
    "All VLRs, EVLRs and points are those of the plain copy; the software and a VLR are new"
    path = write_street(tmp_path / f"in{suffix}", point_format, points=2_000)
    plain = tmp_path / f"plain{suffix}"
    write_corrected(cloud_of(path), plain, covering(path, SHIFT))
    old = laspy.read(plain)
    new = written(path, tmp_path / f"out{suffix}", KNOWN)
    assert new.points.array.tobytes() == old.points.array.tobytes()
    assert new.header.generating_software == "mlscorr 9.9"

    def records(header):
        return [(v.user_id, v.record_id, v.record_data_bytes()) for v in header]

    own = ("mlscorr", 1, TEXT.encode())
    assert [row for row in records(new.header.vlrs) if row != own] == records(old.header.vlrs)
    assert records(new.header.vlrs).count(own) == 1
    assert records(new.evlrs or []) == records(old.evlrs or [])


def test_provenance_is_of_the_last_correction(tmp_path):
    "A file that is corrected twice has one VLR of ours, the new one"
    path = write_street(tmp_path / "in.laz", 6, points=500)
    written(path, tmp_path / "once.laz", KNOWN)
    twice = written(tmp_path / "once.laz", tmp_path / "twice.laz", Additions(provenance="{}"))
    assert [v.record_data for v in twice.header.vlrs if v.user_id == "mlscorr"] == [b"{}"]


def test_displacements_are_not_added_twice(tmp_path):
    "A copy that has the fields is refused, in a sentence that says what to do"
    path = write_street(tmp_path / "in.laz", 6, points=100)
    displaced = Additions(displacement=True)
    written(path, tmp_path / "once.laz", displaced)
    with pytest.raises(ValueError, match="have the field displacement_easting"):
        written(tmp_path / "once.laz", tmp_path / "twice.laz", displaced)
