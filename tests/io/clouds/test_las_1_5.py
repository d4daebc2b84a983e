"""LAS 1.5 in and out: the range of times and the offset stay, and the offset is taken off."""

import shutil
import struct

import laspy
import numpy as np
import pytest

import mlscorr
from mlscorr.io.clouds import read_chunks, read_layout, stated_crs
from mlscorr.io.surveys import FILE_NAME
from mlscorr.survey import CloudFile, PointCloud
from tests.beds.copies import write_corrected
from tests.beds.las_1_5 import OFFSET_FLAG, as_las_1_5, from_las_1_5
from tests.io.clouds.test_las import START, correction, write_street

WEEK = 604_800.0
WEEKS = 2_300 * WEEK  # GPS time at the start of a week in 2024
POINTS = 3_000


def moved(path, target, shift):
    drive = correction(START + np.linspace(-1.0, 21.0, 50), shift)
    write_corrected(CloudFile(path, POINTS, 0.0, "week"), target, drive)
    return target


@pytest.mark.parametrize("suffix", [".las", ".laz"])
@pytest.mark.parametrize("point_format", [6, 7, 8])
def test_a_corrected_las_1_5_is_that_of_las_1_4(suffix, point_format, tmp_path):
    "The same points, VLRs and EVLRs as from 1.4; range of times, offset and flags are the input's"
    old = write_street(tmp_path / f"old{suffix}", point_format, points=POINTS)
    times = laspy.read(old).gps_time
    new = as_las_1_5(old, tmp_path / f"new{suffix}", times, offset=1250)
    shift = (0.5, -0.25, 0.125)
    expected = moved(old, tmp_path / f"out-old{suffix}", shift)
    out = moved(new, tmp_path / f"out-new{suffix}", shift)
    assert struct.unpack_from("<H", out.read_bytes(), 94)[0] == 393
    assert out.read_bytes()[6] == new.read_bytes()[6] and out.read_bytes()[6] & OFFSET_FLAG
    back = tmp_path / f"back{suffix}"
    assert from_las_1_5(out, back) == (times.max(), times.min(), 1250)
    one = laspy.read(expected)
    other = laspy.read(back)
    assert np.array_equal(one.points.array, other.points.array)
    assert [v.record_data_bytes() for v in one.evlrs] == [
        v.record_data_bytes() for v in other.evlrs
    ]
    assert read_layout(out).vlrs == [(a + 18, b + 18) for a, b in read_layout(expected).vlrs]


@pytest.mark.parametrize("offset", [0, 1000, 1250, 65_535])
def test_the_time_offset_is_taken_off(street, offset, tmp_path):
    "The same constant to the trajectory whatever offset the times were written with, to 1 us"
    folder = shutil.copytree(street, tmp_path / "survey")
    las = laspy.read(folder / "pass-1.laz")
    week = np.array(las.gps_time)
    las.gps_time = WEEKS + week - 1e6 * offset
    las.write(tmp_path / "in.laz")
    as_las_1_5(tmp_path / "in.laz", folder / "pass-1.laz", las.gps_time, offset)
    toml = (folder / FILE_NAME).read_text().replace('gps_time = "week"', 'gps_time = "auto"')
    (folder / FILE_NAME).write_text(toml)
    survey = mlscorr.read_survey(folder)
    (file,) = survey.clouds
    read = PointCloud.concatenate(list(read_chunks(file)))
    assert np.abs(read.gps_time - week).max() < (1e-6 if offset < 2_000 else 1e-4)
    said = any(f"stored minus {1e6 * offset:.0f} s" in note for note in survey.notes)
    assert said == (offset != 1000), survey.notes
    (folder / FILE_NAME).unlink()
    assert "pass-1.laz" in mlscorr.init(folder).text


def test_week_time_and_wkt_2_of_las_1_5(street, tmp_path):
    "Without flags times are seconds of the week, as ever; a CRS may be stated as WKT 2"
    import pyproj

    folder = shutil.copytree(street, tmp_path / "survey")
    las = laspy.read(folder / "pass-1.laz")
    wkt = pyproj.CRS("EPSG:32650").to_wkt("WKT2_2019")
    las.header.vlrs = [laspy.VLR("LASF_Projection", 2112, "", wkt.encode() + b"\0")]
    las.write(tmp_path / "in.laz")
    path = as_las_1_5(tmp_path / "in.laz", folder / "pass-1.laz", las.gps_time, flags=0)
    (file,) = mlscorr.read_survey(folder).clouds
    assert file.time_constant == 0.0
    assert stated_crs(read_layout(path)).to_epsg() == 32650


@pytest.mark.parametrize(
    ("name", "form", "position", "value", "words"),
    [
        (
            "offset without GPS time",
            "<B",
            6,
            OFFSET_FLAG,
            "states a time offset together with times in seconds",
        ),
        ("a format of old", "<B", 104, 1, "LAS 1.5 has point formats 6 to 10, not 1"),
        ("the header of 1.4", "<H", 94, 375, "its header has 375 bytes .* LAS 1.5 needs 393"),
        ("LAS 1.6", "<B", 25, 6, r"LAS 1\.6; only LAS 1\.0 to 1\.5 can be read"),
    ],
)
def test_a_wrong_las_1_5_is_refused(name, form, position, value, words, tmp_path):
    "Violations of the standard are reported, not guessed at"
    old = write_street(tmp_path / "old.las", 6, points=POINTS)
    path = as_las_1_5(old, tmp_path / "new.las", [START], offset=1250)
    data = bytearray(path.read_bytes())
    struct.pack_into(form, data, position, value)
    path.write_bytes(data)
    with pytest.raises(ValueError, match=rf"new\.las .*{words}"):
        read_layout(path)
