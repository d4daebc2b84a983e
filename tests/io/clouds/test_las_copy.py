"""Copies of drawn clouds: nothing but the bounds is new, and chunks of any size are the whole."""

import tempfile
from pathlib import Path

import laspy
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from mlscorr.io.clouds import read_chunks, sample_gps_times, sha256
from mlscorr.survey import CloudFile, PointCloud
from tests.beds.copies import write_corrected

BOUNDS = slice(179, 227)  # bytes of the header
clouds = st.fixed_dictionaries(
    {
        "point_format": st.sampled_from([1, 3, 6, 7, 8]),
        "points": st.integers(1, 400),
        "scale": st.sampled_from([0.0001, 0.001, 0.01]),
        "offset": st.tuples(st.floats(1e5, 9e5), st.floats(0.0, 9e6), st.floats(-50.0, 900.0)),
        "start": st.floats(0.0, 604_000.0),
        "seed": st.integers(0, 2**32 - 1),
    }
)


class Nothing:
    "A correction that moves no point"

    def apply(self, cloud):
        return PointCloud(cloud.xyz, cloud.gps_time, cloud.intensity)


def write_drawn(path, point_format, points, scale, offset, start, seed):
    "A LAS file with any bytes in each record, but with times in seconds"
    header = laspy.LasHeader(point_format=point_format)
    header.scales, header.offsets = np.full(3, scale), np.array(offset)
    header.add_extra_dim(laspy.ExtraBytesParams("ring", "u2"))
    cloud = laspy.LasData(header)
    raw = np.random.default_rng(seed).integers(0, 256, points * header.point_format.size, np.uint8)
    records = raw.view(header.point_format.dtype())
    records["gps_time"] = start + np.arange(points) / 1e3
    cloud.points = laspy.ScaleAwarePointRecord(
        records, header.point_format, header.scales, header.offsets
    )
    cloud.write(path)
    return CloudFile(path, points, 0.0, "week")


@settings(max_examples=20, deadline=None)
@given(drawn=clouds, compressed=st.booleans())
def test_a_zero_correction_keeps_every_byte(drawn, compressed):
    "All bytes of header, records and what is between are those of the input, bounds excepted"
    with tempfile.TemporaryDirectory() as folder:
        file = write_drawn(Path(folder) / "cloud.las", **drawn)
        between = Path(folder) / ("between.laz" if compressed else "between.las")
        write_corrected(file, between, Nothing())
        again = CloudFile(between, sample_gps_times(between)[0], 0.0, "week")
        write_corrected(again, Path(folder) / "copy.las", Nothing())
        before = bytearray(file.path.read_bytes())
        after = bytearray((Path(folder) / "copy.las").read_bytes())
        before[BOUNDS] = after[BOUNDS] = bytes(48)
        assert before == after


@settings(max_examples=20, deadline=None)
@given(drawn=clouds, chunk_size=st.integers(1, 500))
def test_chunks_are_the_whole(drawn, chunk_size):
    "Chunks of any size join to what laspy reads at once less what is flagged as noise, to the bit"
    with tempfile.TemporaryDirectory() as folder:
        file = write_drawn(Path(folder) / "cloud.las", **drawn)
        chunks = list(read_chunks(file, chunk_size))
        whole = laspy.read(file.path)
    is_noise = np.array(whole.withheld, bool) | np.isin(whole.classification, [7, 18])
    whole.points = whole.points[~is_noise]
    assert all(0 < len(chunk) <= chunk_size for chunk in chunks)
    joined = np.concatenate([np.empty((0, 3)), *(chunk.xyz for chunk in chunks)])
    assert np.array_equal(joined, np.column_stack([whole.x, whole.y, whole.z]))
    times = np.concatenate([np.empty(0), *(chunk.gps_time for chunk in chunks)])
    assert np.array_equal(times, whole.gps_time)


def test_a_sum_tells_files_apart(tmp_path):
    "Equal bytes have the SHA-256 of the standard's example, others another"
    (tmp_path / "abc").write_bytes(b"abc")
    (tmp_path / "abd").write_bytes(b"abd")
    assert sha256(tmp_path / "abc").startswith("ba7816bf8f01cfea414140de5dae2223b00361a396177a9c")
    assert sha256(tmp_path / "abd") != sha256(tmp_path / "abc")
