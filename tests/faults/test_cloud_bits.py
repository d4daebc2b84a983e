"""Single bits of LAS and LAZ files turned: the same points, or a refusal in our own words."""

import struct

import laspy
import numpy as np
import pytest

from mlscorr.io.clouds import read_layout, sample_gps_times
from mlscorr.io.clouds.las import read_records
from mlscorr.survey import CloudFile
from tests.beds.copies import write_corrected
from tests.io.clouds.test_las import START, correction, write_street

POINTS = 300
HEADER = 430  # bytes: that of LAS 1.4 and the first VLR


def copied(path, target):
    "Copy a cloud with a correction of zero; returns the bytes of the copy's points"
    points = sample_gps_times(path)[0]
    zero = correction(START + np.linspace(-1.0, 21.0, 50))
    write_corrected(CloudFile(path, points, 0.0, "week"), target, zero)
    (records,) = read_records(read_layout(target), POINTS)
    return records.tobytes()


def turned(path, byte, bit):
    "Turn one bit of a file"
    data = bytearray(path.read_bytes())
    data[byte] ^= 1 << bit
    path.write_bytes(data)


@pytest.mark.parametrize("byte", range(32, 46))
def test_a_damaged_laszip_vlr_is_refused(byte, tmp_path, capfd):
    "Each bit that says what items a point has, and in which version, is found when it is turned"
    path = write_street(tmp_path / "in.laz", 7, points=POINTS)
    start = path.read_bytes().find(b"laszip encoded") - 2 + 54
    for bit in range(8):
        turned(path, start + byte, bit)
        with pytest.raises(ValueError, match=r"in\.laz is damaged: its (LASzip|LAZ chunks)"):
            sample_gps_times(path)
        turned(path, start + byte, bit)
    assert "panicked" not in capfd.readouterr().err


@pytest.mark.parametrize(("suffix", "point_format"), [(".las", 1), (".las", 6), (".laz", 6)])
def test_a_header_that_announces_less_points_is_refused(suffix, point_format, tmp_path):
    """No point is lost without a word where the header's number of points is too low; LAZ chunks of
    old formats do not say how many they hold
    """
    path = write_street(tmp_path / f"in{suffix}", point_format, points=POINTS)
    is_new = point_format >= 6
    for points in (1, POINTS - 1, POINTS + 1):
        data = bytearray(path.read_bytes())
        struct.pack_into("<Q" if is_new else "<I", data, 247 if is_new else 107, points)
        bad = tmp_path / f"bad{suffix}"
        bad.write_bytes(data)
        with pytest.raises(ValueError, match=rf"{points}.*{POINTS}|{POINTS}.*{points}"):
            sample_gps_times(bad)


def test_two_different_numbers_of_points_are_refused(tmp_path):
    "LAS 1.4 holds the number twice; where they differ nobody knows which of them is true"
    path = write_street(tmp_path / "in.las", points=POINTS)
    turned(path, 107, 3)
    with pytest.raises(ValueError, match=r"300 points, and 8.*older versions"):
        sample_gps_times(path)


def test_a_pointwise_file_is_named_as_such(tmp_path):
    "The oldest LAZ files have no chunks: they are not cut off, and need to be compressed anew"
    path = write_street(tmp_path / "in.laz", 1, points=POINTS)
    data = bytearray(path.read_bytes())
    data[data.find(b"laszip encoded") - 2 + 54] = 1
    path.write_bytes(data)
    with pytest.raises(ValueError, match=r"point by point.*Compress it again"):
        sample_gps_times(path)


@pytest.mark.long
@pytest.mark.parametrize("suffix", [".las", ".laz"])
def test_no_bit_of_a_header_changes_the_points(suffix, tmp_path, capfd):
    "Any bit of header and VLRs turned: the copy has the points of the input, or there is none"
    path = write_street(tmp_path / f"in{suffix}", points=POINTS)
    target = tmp_path / f"out{suffix}"
    whole = laspy.read(path).points.array.tobytes()
    rng = np.random.default_rng(18)
    refused = 0
    for byte, bit in zip(rng.permutation(HEADER)[:60], rng.integers(0, 8, 60), strict=True):
        turned(path, byte, bit)
        try:
            assert copied(path, target) == whole, (byte, bit)
        except ValueError as error:
            assert str(path) in str(error), (byte, bit)
            refused += 1
        turned(path, byte, bit)
    assert refused
    assert "panicked" not in capfd.readouterr().err
