"LAS and LAZ files: everything but X, Y, Z passes through; damaged files are refused."

import hashlib
import os
import resource
import signal
import struct
import subprocess
import sys

import laspy
import numpy as np
import pytest
from laspy.vlrs.vlrlist import VLRList

from mlscorr.correction import Correction
from mlscorr.frames import attitude_from_angles
from mlscorr.io.clouds import read_chunks, sample_gps_times, sha256, spread_records
from mlscorr.io.clouds.las import read_layout, read_records, records_at
from mlscorr.survey import CloudFile, Trajectory
from tests.beds.copies import write_corrected
from tests.beds.places import ROOT
from tests.beds.shared import shared

START = 357_900.0  # s of week
CORNER = np.array([532_000.0, 3_374_000.0, 40.0])  # UTM
SHIFT = np.array([0.5123, -0.2511, 0.1252])  # m
FORMATS = (1, 3, 4, 5, 6, 7, 8, 9, 10)
SAMPLES = ("las_with_several_extra_byte_bloc.laz", "mvk-thin.las", "sample_c.las")
BOUNDS = slice(179, 227)  # bytes of the header


def cloud_of(path, time_constant=0.0):
    return CloudFile(path, sample_gps_times(path)[0], time_constant, "week")


def correction(gps_time, shift=(0.0, 0.0, 0.0), position=CORNER):
    angle = np.linspace(0.0, 1.0, len(gps_time))
    attitude = attitude_from_angles(0.01 * angle, 0.02 * angle, angle)
    drive = position + np.outer(gps_time - gps_time[0], [8.0, 6.0, 0.0])
    recorded = Trajectory(gps_time, drive, attitude)
    return Correction(recorded, Trajectory(gps_time, drive + shift, attitude))


def covering(path, shift=(0.0, 0.0, 0.0)):
    "A correction whose trajectory covers all points of a file, without a gap"
    times = laspy.read(path).gps_time
    epochs = np.linspace(times.min() - 1.0, times.max() + 1.0, 2000)
    return correction(epochs, shift, position=laspy.read(path).header.offsets)


def write_street(path, point_format=6, points=12_345, nan=0, evlrs=True):
    "A file with random values in every field, extra bytes, a WKT, an unknown VLR and EVLRs"
    rng = np.random.default_rng(point_format)
    header = laspy.LasHeader(point_format=point_format)
    header.scales = [0.001, 0.001, 0.0005]
    header.offsets = CORNER
    header.global_encoding.value |= 0x10 if point_format >= 6 else 0
    header.system_identifier = "line scanner"
    header.file_source_id = 77
    header.add_extra_dim(laspy.ExtraBytesParams("amplitude", "f4", "dB"))
    header.add_extra_dim(laspy.ExtraBytesParams("ring", "u2"))
    header.vlrs.append(laspy.VLR("somebody", 4711, "no one knows", b"\1\2\3"))
    header.vlrs.append(laspy.VLR("LASF_Projection", 2112, "", b'LOCAL_CS["street"]\0'))
    las = laspy.LasData(header)
    las.points = laspy.ScaleAwarePointRecord.zeros(points, header=header)
    las.points.array.view(np.uint8)[:] = rng.integers(0, 256, las.points.array.nbytes)
    for name in "XYZ":
        las[name] = rng.integers(-90_000, 90_000, points)
    if point_format >= 9:
        las["scanner_channel"] = np.full(points, 2)
    las["return_number"] = rng.integers(1, 4, points)
    las["amplitude"] = rng.normal(size=points)
    las["gps_time"] = START + np.sort(rng.uniform(0.0, 20.0, points))
    las["gps_time"][:nan] = np.nan
    if header.version.minor >= 4 and evlrs:
        las.evlrs = VLRList([laspy.VLR("somebody", 1, "long", bytes(range(256)) * 400)])
    las.write(path)
    return path


def is_flagged(las):
    "Flags of points of a file that are withheld or of a noise class"
    return np.array(las.withheld, bool) | np.isin(las.classification, [7, 18])


def assert_same_but_coordinates(before, after):
    "All that laspy can read of two files is equal, X, Y, Z and the bounds excepted"
    old = laspy.read(before)
    new = laspy.read(after)
    for name in old.point_format.dimension_names:
        if name not in "XYZ":
            assert np.asarray(old[name]).tobytes() == np.asarray(new[name]).tobytes(), name
    skipped = (*range(96, 105), *range(179, 227), *range(227, 243))
    head = [np.frombuffer(path.read_bytes()[:227], np.uint8) for path in (before, after)]
    kept = np.setdiff1d(np.arange(227), skipped)
    assert np.array_equal(head[0][kept], head[1][kept])
    assert list(old.header.number_of_points_by_return) == list(
        new.header.number_of_points_by_return
    )
    for records in ("vlrs", "evlrs"):
        lists = [getattr(las, records) or [] for las in (old, new)]
        bytes_of = [
            [(v.user_id, v.record_id, v.description, v.record_data_bytes()) for v in vlrs]
            for vlrs in lists
        ]
        assert bytes_of[0] == bytes_of[1]
    assert new.header.parse_crs() == old.header.parse_crs() or "LOCAL" in str(old.vlrs)


@pytest.mark.long
@pytest.mark.parametrize("name", SAMPLES)
def test_a_zero_correction_returns_real_files_unchanged(name, tmp_path):
    "A zero correction leaves every bit of every point of real files, and every record, as it was"
    path = shared("data", "las_samples", name)
    target = tmp_path / name
    assert write_corrected(cloud_of(path), target, covering(path)) == 0
    assert laspy.read(target).points.array.tobytes() == laspy.read(path).points.array.tobytes()
    assert_same_but_coordinates(path, target)
    if target.suffix == ".las":
        old = bytearray(path.read_bytes())
        new = bytearray(target.read_bytes())
        old[BOUNDS] = new[BOUNDS]
        assert old == new


@pytest.mark.parametrize("suffixes", [(".laz", ".laz"), (".las", ".las"), (".laz", ".las")])
@pytest.mark.parametrize("point_format", FORMATS)
def test_a_zero_correction_changes_no_bit_in_any_format(point_format, suffixes, tmp_path):
    "In every point format with time, compressed or not, a zero correction changes no bit"
    path = write_street(tmp_path / f"in{suffixes[0]}", point_format)
    target = tmp_path / f"out{suffixes[1]}"
    assert write_corrected(cloud_of(path), target, covering(path)) == 0
    assert laspy.read(target).points.array.tobytes() == laspy.read(path).points.array.tobytes()
    assert_same_but_coordinates(path, target)
    assert laspy.read(target).header.are_points_compressed == (suffixes[1] == ".laz")


def test_compressing_and_expanding_gives_the_same_file(tmp_path):
    "LAS to LAZ and back gives the first file again, EVLRs, unknown bytes and all"
    path = write_street(tmp_path / "a.las")
    write_corrected(cloud_of(path), tmp_path / "b.laz", covering(path))
    write_corrected(cloud_of(tmp_path / "b.laz"), tmp_path / "c.las", covering(path))
    old = bytearray(path.read_bytes())
    new = bytearray((tmp_path / "c.las").read_bytes())
    old[BOUNDS] = new[BOUNDS]
    assert old == new


@pytest.mark.parametrize("minor", [0, 1])
def test_old_versions_keep_their_version(minor, tmp_path):
    "LAS 1.0 and 1.1, which differ from 1.2 in the meaning of reserved bytes, stay what they are"
    data = bytearray(write_street(tmp_path / "new.las", 1).read_bytes())
    data[25] = minor
    path = tmp_path / "old.las"
    path.write_bytes(data)
    write_corrected(cloud_of(path), tmp_path / "out.las", covering(path))
    data[BOUNDS] = (tmp_path / "out.las").read_bytes()[BOUNDS]
    assert (tmp_path / "out.las").read_bytes() == data


@pytest.mark.parametrize("suffix", [".las", ".laz"])
def test_waveforms_behind_the_points_are_kept(suffix, tmp_path):
    "Waveforms inside a LAS 1.3 file, which no count announces, move along with their position"
    data = bytearray(write_street(tmp_path / "in.las", 4).read_bytes())
    data[6] |= 2
    struct.pack_into("<Q", data, 227, len(data))
    path = tmp_path / "waves.las"
    target = tmp_path / f"out{suffix}"
    path.write_bytes(bytes(data) + b"waveforms" * 1000)
    write_corrected(cloud_of(path), target, covering(path))
    out = target.read_bytes()
    assert out[struct.unpack_from("<Q", out, 227)[0] :] == b"waveforms" * 1000


def test_a_known_shift_is_recovered(tmp_path):
    "A shift of decimetres is found again in each point to half the file's scale, and in bounds"
    path = write_street(tmp_path / "in.laz")
    target = tmp_path / "out.laz"
    done = []
    flagged = []

    def watch(times, is_noise):
        done.append(times)
        flagged.append(is_noise)

    assert write_corrected(cloud_of(path), target, covering(path, SHIFT), watch) == 0
    assert np.array_equal(np.concatenate(flagged), is_flagged(laspy.read(path)))
    old = laspy.read(path)
    new = laspy.read(target)
    half_scale = 0.5 * old.header.scales + 1e-9  # m
    assert (np.abs(new.xyz - old.xyz - SHIFT) <= half_scale).all()
    assert np.array_equal(new.header.mins, new.xyz.min(axis=0))
    assert np.array_equal(new.header.maxs, new.xyz.max(axis=0))
    assert np.array_equal(np.concatenate(done), old.gps_time)
    assert_same_but_coordinates(path, target)


@pytest.mark.long
def test_chunks_are_the_whole(tmp_path):
    "Chunks of any size join to the points that laspy reads at once, less those flagged as noise"
    path = write_street(tmp_path / "in.laz", points=123_456)
    whole = laspy.read(path)
    whole.points = whole.points[~is_flagged(whole)]
    for size in (7_777, 50_000, 1_000_000):
        chunks = list(read_chunks(cloud_of(path, 86_400.0), size))
        assert np.array_equal(np.vstack([c.xyz for c in chunks]), whole.xyz)
        times = np.concatenate([c.gps_time for c in chunks])
        assert np.array_equal(times, whole.gps_time + 86_400.0)
        assert np.array_equal(np.concatenate([c.intensity for c in chunks]), whole.intensity)


@pytest.mark.parametrize("point_format", [9, 10])
def test_waveforms_of_several_channels_are_not_compressed(point_format, tmp_path):
    "lazrs loses waveforms where scanner channels alternate, so that is refused; LAS keeps them"
    path = write_street(tmp_path / "in.las", point_format)
    las = laspy.read(path)
    las["scanner_channel"] = np.arange(len(las)) % 2
    las.write(path)
    with pytest.raises(ValueError, match="2 scanner channels"):
        write_corrected(cloud_of(path), tmp_path / "out.laz", covering(path))
    write_corrected(cloud_of(path), tmp_path / "out.las", covering(path))
    assert laspy.read(tmp_path / "out.las").points.array.tobytes() == las.points.array.tobytes()


@pytest.mark.long
@pytest.mark.parametrize("suffix", [".las", ".laz"])
def test_samples_are_spread_over_the_file(suffix, tmp_path):
    "The sampled times are those of points from the first to the last, with count and time flag"
    path = write_street(tmp_path / f"in{suffix}", points=123_456)
    points, is_standard, times = sample_gps_times(path)
    whole = laspy.read(path).gps_time
    assert (points, is_standard) == (123_456, False)
    places = spread_records(read_layout(path))[0]
    assert np.array_equal(times, whole[places]) and len(places) == 65
    assert np.abs(places - np.linspace(0, points - 1, 65)).max() < points / 64
    backwards = places[::-1]
    assert np.array_equal(records_at(read_layout(path), backwards)["gps_time"], whole[backwards])
    data = bytearray(path.read_bytes())
    data[6] |= 1
    path.write_bytes(data)
    assert sample_gps_times(path)[1]


def test_points_outside_are_counted_and_left_alone(tmp_path):
    "Points before, behind and in a gap of the trajectory are counted and keep their coordinates"
    path = write_street(tmp_path / "in.laz")
    target = tmp_path / "out.laz"
    epochs = np.concatenate([np.arange(2.0, 8.0, 0.01), np.arange(11.0, 18.0, 0.01)])
    constant = 1_400_000_000.0
    moved = correction(START + constant + epochs, SHIFT)
    outside = write_corrected(cloud_of(path, constant), target, moved)
    old = laspy.read(path)
    new = laspy.read(target)
    inside = moved.recorded.segment(old.gps_time + constant) >= 0
    assert outside == np.count_nonzero(~inside) > 1000
    assert np.array_equal(new.xyz[~inside], old.xyz[~inside])
    assert (np.abs(new.xyz[inside] - old.xyz[inside] - SHIFT) < 0.00051).all()  # m


def test_the_order_of_points_does_not_matter():
    "Shuffled points over jittered epochs and gaps of any length get what sorted points get"
    rng = np.random.default_rng(3)
    steps = rng.uniform(0.8, 1.2, 20_000) * 0.005
    steps[rng.choice(20_000, 9, replace=False)] = rng.uniform(1.0, 900.0, 9)
    epochs = START + np.cumsum(steps)
    moving = correction(epochs, np.outer(np.sin(epochs), SHIFT))
    times = np.append(rng.uniform(epochs[0] - 1, epochs[-1] + 1, 50_000), epochs)
    xyz = CORNER + rng.uniform(-50.0, 50.0, (len(times), 3))
    order = np.argsort(times)
    shuffled, inside = moving.increments(xyz, times)
    in_order, inside_in_order = moving.increments(xyz[order], times[order])
    assert np.abs(shuffled[order] - in_order).max() < 1e-12  # m
    assert np.array_equal(inside[order], inside_in_order)
    assert np.array_equal(inside, moving.recorded.segment(times) >= 0)


def damaged(path, name):
    "Bytes of a good file made bad in one way"
    data = bytearray(path.read_bytes())
    start = struct.unpack_from("<I", data, 96)[0]
    table = struct.unpack_from("<Q", data, start)[0]
    laszip = data.find(b"laszip encoded") - 2 + 54
    if name.startswith("cut "):
        return data[: int(len(data) * float(name[4:]))]
    form, position, value = {
        "2^40 points": ("<Q", 247, 2**40),
        "one point more": ("<Q", 247, 200_000),
        "2^31-1 VLRs": ("<I", 100, 2**31 - 1),
        "2^32-1 EVLRs": ("<I", 243, 2**32 - 1),
        "EVLRs behind the end": ("<Q", 235, 2**50),
        "points behind the end": ("<I", 96, 2**31),
        "points in the header": ("<I", 96, 100),
        "header size": ("<H", 94, 65_535),
        "record length": ("<H", 105, 12),
        "longer records": ("<H", 105, 200),
        "format 0": ("<B", 104, 0x80),
        "format 2": ("<B", 104, 0x82),
        "format 60": ("<B", 104, 0xBC),
        "LAS 1.9": ("<B", 25, 9),
        "scale 0": ("<d", 131, 0.0),
        "offset NaN": ("<d", 155, np.nan),
        "0 points": ("<Q", 247, 0),
        "2^32-1 chunks": ("<I", table + 4, 2**32 - 1),
        "chunks of 2^32-2 points": ("<I", laszip + 12, 2**32 - 2),
        "chunks of 0 points": ("<I", laszip + 12, 0),
        "unknown compression": ("<H", laszip + 34, 99),
        "garbage": ("<4s", 0, b"ply\n"),
    }[name]
    struct.pack_into(form, data, position, value)
    return data


DAMAGES = [
    "cut 0",
    "cut 0.001",
    "cut 0.005",
    "cut 0.5",
    "cut 0.95",
    "cut 0.999",
    "2^40 points",
    "one point more",
    "2^31-1 VLRs",
    "2^32-1 EVLRs",
    "EVLRs behind the end",
    "points behind the end",
    "points in the header",
    "header size",
    "record length",
    "longer records",
    "format 0",
    "format 2",
    "format 60",
    "LAS 1.9",
    "scale 0",
    "offset NaN",
    "0 points",
    "2^32-1 chunks",
    "chunks of 2^32-2 points",
    "chunks of 0 points",
    "unknown compression",
    "garbage",
]


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "suffix"),
    [(name, ".laz") for name in DAMAGES]
    + [(name, ".las") for name in DAMAGES if "chunks" not in name and "compression" not in name],
)
def test_damaged_files_are_refused(name, suffix, tmp_path):
    "A file that is cut off, damaged or without time is refused in a sentence that names it"
    path = tmp_path / f"bad{suffix}"
    path.write_bytes(damaged(write_street(tmp_path / f"in{suffix}", points=120_000), name))
    with pytest.raises(ValueError, match=r"bad\.la[sz].* .*\.$"):
        sample_gps_times(path)
    with pytest.raises(ValueError, match=r"bad\.la[sz]"):
        next(read_chunks(CloudFile(path, 120_000, 0.0, "week")))


@pytest.mark.parametrize("suffix", [".las", ".laz"])
def test_no_cut_goes_unseen(suffix, tmp_path):
    "Wherever a file is cut off, at a record's boundary too, it is refused"
    whole = write_street(tmp_path / f"in{suffix}", points=2_000, evlrs=False).read_bytes()
    path = tmp_path / f"bad{suffix}"
    for size in range(0, len(whole), 509):
        path.write_bytes(whole[:size])
        with pytest.raises(ValueError, match="bad"):
            sample_gps_times(path)


def test_a_missing_file_is_named(tmp_path):
    "A file that is not there is named, with the setting that asks for it"
    with pytest.raises(ValueError, match=r"\. Check cloud\.files"):
        sample_gps_times(tmp_path / "no.laz")


def test_points_without_a_time_stay_as_they_are(tmp_path):
    "Points whose gps_time is NaN are read by nobody, counted as untouched, and kept to the bit"
    path = write_street(tmp_path / "in.laz", nan=5)
    target = tmp_path / "out.laz"
    assert np.isfinite(sample_gps_times(path)[2]).all()
    cloud = CloudFile(path, 12_345, 0.0, "week")
    is_measured = np.isfinite(laspy.read(path).gps_time) & ~is_flagged(laspy.read(path))
    assert sum(map(len, read_chunks(cloud))) == is_measured.sum()
    moved = correction(START + np.arange(-1.0, 22.0), SHIFT)
    with pytest.warns(UserWarning, match="5 of 12345 points of .*in.laz have a gps_time that is"):
        assert write_corrected(cloud, target, moved) == 5
    old = laspy.read(path)
    new = laspy.read(target)
    assert np.array_equal(new.xyz[:5], old.xyz[:5])
    assert (np.abs(new.xyz[5:] - old.xyz[5:] - SHIFT) < 0.00051).all()  # m


@pytest.mark.parametrize("failure", [KeyboardInterrupt, MemoryError])
def test_an_interrupted_write_leaves_nothing(failure, tmp_path):
    "Whatever interrupts the writing, neither target nor part of it stays, the input does"

    def interrupt(*_):
        raise failure

    path = write_street(tmp_path / "in.laz")
    before = sha256(path)
    with pytest.raises(failure):
        write_corrected(cloud_of(path), tmp_path / "out.laz", covering(path), interrupt)
    assert os.listdir(tmp_path) == ["in.laz"]
    assert sha256(path) == before == hashlib.sha256(path.read_bytes()).hexdigest()


@pytest.mark.parametrize("suffix", [".las", ".laz"])
def test_a_full_disk_is_told_as_the_system_tells_it(suffix, tmp_path):
    "A file that may not grow further raises the system's OSError and leaves nothing"
    path = write_street(tmp_path / "in.laz", points=120_000)
    cloud = cloud_of(path)
    correct = covering(path)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1_500_000, limits[1]))
    try:
        with pytest.raises(OSError, match="File too large"):
            write_corrected(cloud, tmp_path / f"out{suffix}", correct)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert os.listdir(tmp_path) == ["in.laz"]


def test_a_killed_write_leaves_no_target(tmp_path):
    "A process killed while it writes leaves no file under the target's name; the next succeeds"
    path = write_street(tmp_path / "in.laz")
    target = tmp_path / "out.laz"
    script = (
        "import os, sys; sys.path.insert(0, sys.argv[1]); "
        "from tests.io.clouds import test_las as t; "
        "from pathlib import Path; p = Path(sys.argv[2]); "
        "t.write_corrected(t.cloud_of(p), p.with_name('out.laz'), t.covering(p), "
        "lambda *_: os.kill(os.getpid(), 9))"
    )
    command = [sys.executable, "-c", script, str(ROOT), str(path)]
    assert subprocess.run(command, check=False).returncode == -signal.SIGKILL
    assert not target.exists()
    write_corrected(cloud_of(path), target, covering(path))
    assert sorted(os.listdir(tmp_path)) == ["in.laz", "out.laz"]


def test_the_input_is_never_the_output(tmp_path):
    "The input under its own name, a symbolic or a hard link is refused as output and unharmed"
    path = write_street(tmp_path / "in.laz")
    before = sha256(path)
    (tmp_path / "symbolic.laz").symlink_to(path)
    (tmp_path / "hard.laz").hardlink_to(path)
    for name in ("in.laz", "symbolic.laz", "hard.laz", "../" + tmp_path.name + "/in.laz"):
        with pytest.raises(ValueError, match="would replace the input"):
            write_corrected(cloud_of(path), tmp_path / name, covering(path))
    with pytest.raises(ValueError, match=r"must end in \.las or \.laz"):
        write_corrected(cloud_of(path), tmp_path / "out.txt", covering(path))
    assert sha256(path) == before


def test_coordinates_that_overflow_are_refused(tmp_path):
    "A correction of thousands of kilometres does not fit 32 bits and is refused, not wrapped"
    path = write_street(tmp_path / "in.laz")
    with pytest.raises(ValueError, match="can't be stored in 32 bits with the file's scale"):
        write_corrected(cloud_of(path), tmp_path / "out.laz", covering(path, (3e6, 0.0, 0.0)))
    assert os.listdir(tmp_path) == ["in.laz"]


def test_a_single_point_that_cannot_be_decoded_is_named_as_one(tmp_path):
    "Point 4999 of 5000 in a file that is cut off meanwhile; two are points 4998 to 4999"
    path = tmp_path / "tile.las"
    cloud = laspy.LasData(laspy.LasHeader(point_format=6, version="1.4"))
    cloud.x, cloud.gps_time = 532_000 + np.arange(5000.0), 357_700 + np.arange(5000) / 7
    cloud.write(path)
    layout = read_layout(path)
    path.write_bytes(path.read_bytes()[:-9000])
    with pytest.raises(ValueError, match=r"^Point 4999 of 5000 in "):
        records_at(layout, [4999])
    with pytest.raises(ValueError, match=r"^Points 4998 to 4999 of 5000 in "):
        list(read_records(layout, 100, 4998, 5000))
