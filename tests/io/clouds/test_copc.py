"""COPC in and out: its points in order of time, and an octree about where they are corrected to."""

import json
import shutil
import struct

import laspy
import lazrs
import numpy as np
import pytest
from laspy import CopcReader
from laspy.copc import Bounds, load_octree_for_query
from typer.testing import CliRunner

import mlscorr
from mlscorr.cli import app
from mlscorr.io.clouds import read_chunks, read_intervals, read_layout
from mlscorr.io.clouds._time_order import in_time_order
from mlscorr.io.clouds.las import read_records, records_at
from mlscorr.io.settings import Settings
from mlscorr.io.store import check_space, glance
from mlscorr.io.surveys import FILE_NAME
from mlscorr.survey import CloudFile, PointCloud
from tests.beds.copc_files import write_copc
from tests.beds.copies import write_corrected
from tests.io.clouds.test_las import CORNER, START, correction, write_street

POINTS = 20_000
SMALL = Settings(chunk_points=1_500, close_places=400)  # an octree of many parts


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    "A LAZ of a surface, dense in its middle, in order of time, and a COPC of its points"
    folder = tmp_path_factory.mktemp("pair")
    laz = write_street(folder / "in.laz", 7, points=POINTS, evlrs=False)
    las = laspy.read(laz)
    rng = np.random.default_rng(5)
    x, y = rng.uniform(-80.0, 80.0, (2, POINTS)) * rng.choice([0.02, 1.0], POINTS, p=[0.7, 0.3])
    las.xyz = CORNER + np.column_stack([x, y, np.sin(x) + 0.002 * y])
    las.write(laz)
    return laz, write_copc(laz, folder / "in.copc.laz", evlr=b"what others say")


def cloud_of(path):
    return CloudFile(path, POINTS, 0.0, "week")


def moved(path, target, shift=(0.0, 0.0, 0.0)):
    "Correct a file by a shift, all along the street"
    zero = correction(START + np.linspace(-1.0, 21.0, 50), shift)
    write_corrected(cloud_of(path), target, zero)
    return target


def rows_of(points):
    "Records as bytes, in an order of their own"
    return np.sort(points.array.view(f"S{points.array.itemsize}"))


def xyz_of(points):
    return np.column_stack([points.x, points.y, points.z])


def nodes_of(reader):
    "Nodes of a COPC with the coordinates (m) and times (s) of their points, decoded one by one"
    header = reader.header
    nodes = []
    laszip = bytes(reader.laszip_vlr.record_data)
    for node in load_octree_for_query(reader.source, reader.copc_info, reader.root_page):
        reader.source.seek(node.offset)
        data = reader.source.read(node.byte_size)
        records = np.empty(node.point_count, header.point_format.dtype())
        table = [(node.point_count, node.byte_size)]
        lazrs.decompress_points_with_chunk_table(data, laszip, records.view(np.uint8), table)
        xyz = np.column_stack([records[axis] for axis in "XYZ"]) * header.scales + header.offsets
        nodes.append((node, xyz, records["gps_time"]))
    return nodes


# ---- in


def test_points_of_a_copc_are_read_in_order_of_time(pair):
    "Chunks are those of the LAZ of the same points to the bit, whatever their order in the octree"
    laz, copc = (list(read_chunks(cloud_of(path), 7_000)) for path in pair)
    raw = np.concatenate([r["gps_time"].copy() for r in read_records(read_layout(pair[1]), 3_000)])
    assert (np.diff(raw) < 0).mean() > 0.3
    for one, other in zip(laz, copc, strict=True):
        assert np.array_equal(one.xyz, other.xyz)
        assert np.array_equal(one.gps_time, other.gps_time)
        assert np.array_equal(one.intensity, other.intensity)


def test_echoes_of_a_pulse_come_in_their_order(tmp_path):
    "Of points with one time the first return comes first, however the octree mixed them"
    laz = write_street(tmp_path / "in.laz", 6, points=4_000, evlrs=False)
    las = laspy.read(laz)
    las.gps_time = START + np.arange(4_000) // 4 * 1e-3
    las.return_number = np.tile([1, 2, 3, 4], 1_000)
    las.write(laz)
    copc = write_copc(laz, tmp_path / "in.copc.laz")
    first, second = (PointCloud.concatenate(list(read_chunks(cloud_of(p)))) for p in (laz, copc))
    assert np.array_equal(first.xyz, second.xyz)


def test_a_copc_over_the_end_of_a_week_counts_on(tmp_path):
    "Seconds of week start again within it: points come as in the LAZ, the old week's first"
    laz = write_street(tmp_path / "in.laz", 6, points=4_000, evlrs=False)
    las = laspy.read(laz)
    counted = np.linspace(604_790.0, 604_810.0, 4_000)
    las.gps_time = counted % 604_800.0
    las.withheld[:] = 0
    las.classification[:] = 2
    las.write(laz)
    copc = write_copc(laz, tmp_path / "in.copc.laz")
    files = [CloudFile(path, 4_000, 0.0, "week", new_week=302_400.0) for path in (laz, copc)]
    first, second = (PointCloud.concatenate(list(read_chunks(file))) for file in files)
    assert np.array_equal(first.xyz, second.xyz)
    assert np.abs(second.gps_time - counted).max() < 1e-9
    windows = read_intervals(files[1], np.array([[604_799.0, 604_801.0]]), limit=500)
    assert PointCloud.concatenate(list(windows)).gps_time == pytest.approx(604_800.0, abs=1.3)


def test_any_point_of_unlike_chunks_is_found(pair):
    "Each place of the file is sought as if all before it was read: chunks begin anywhere"
    layout = read_layout(pair[1])
    raw = np.concatenate([r["gps_time"].copy() for r in read_records(layout, 2_999)])
    places = np.unique(np.random.default_rng(0).integers(0, POINTS, 60))
    assert np.array_equal(records_at(layout, places)["gps_time"], raw[places])
    late = next(read_records(layout, 500, first=17_123))["gps_time"]
    assert np.array_equal(late, raw[17_123:17_623])


def test_windows_of_a_copc_are_those_of_the_laz(pair):
    "Spans of time hold the same points; at a glance a long file is not put in order, and says so"
    spans = START + np.array([[3.0, 3.2], [11.0, 12.5]])
    laz, copc = (
        PointCloud.concatenate(list(read_intervals(cloud_of(path), spans, limit=2_000)))
        for path in pair
    )
    assert np.array_equal(laz.xyz, copc.xyz) and len(copc) < POINTS


def test_a_glance_leaves_a_long_copc_as_it_is(pair):
    "Seconds do not do for sorting: windows are refused, chunks come as they stand"
    with glance(1_000):
        with pytest.raises(ValueError, match=r"in\.copc\.laz are not in time order"):
            list(read_intervals(cloud_of(pair[1]), np.array([[START, START + 1.0]]), limit=2_000))
        assert (np.diff(next(read_chunks(cloud_of(pair[1]))).gps_time) < 0).any()


@pytest.mark.long
def test_a_survey_in_copc_is_corrected_as_in_laz(street, tmp_path):
    "The same figures, and the same points to the digit, as COPC again; slow by two corrections"
    folder = shutil.copytree(street, tmp_path / "survey")
    write_copc(folder / "pass-1.laz", folder / "pass-1.copc.laz")
    (folder / "pass-1.laz").unlink()
    toml = (folder / FILE_NAME).read_text().replace("pass-1.laz", "pass-1.copc.laz")
    (folder / FILE_NAME).write_text(toml)
    before = (folder / "pass-1.copc.laz").read_bytes()
    reports = []
    clouds = []
    for source, name in ((street, "pass-1.laz"), (folder, "pass-1.copc.laz")):
        out = tmp_path / name
        run = CliRunner().invoke(app, ["correct", str(source), "-o", str(out), "--no-report"])
        assert run.exit_code == 0, run.stderr
        reports.append(json.loads((out / "report.json").read_text()))
        clouds.append(laspy.read(out / name).points)
    for key in ("targets", "control", "check", "model", "coverage"):
        assert reports[0][key] == reports[1][key], key
    assert np.array_equal(*map(rows_of, clouds))
    assert (folder / "pass-1.copc.laz").read_bytes() == before
    with CopcReader.open(str(out / name)) as reader:
        assert len(reader.query()) == len(clouds[0])


# ---- out


@pytest.mark.parametrize("shift", [(0.0, 0.0, 0.0), (2.51, -1.8, 0.4), (300.0, 0.0, 0.0)])
def test_a_corrected_copc_is_a_copc(pair, shift, tmp_path, monkeypatch):
    "Each point, with all its fields, in one node and its cube; more than memory holds, moved far"
    monkeypatch.setattr("mlscorr.io.clouds._copc_writer.SETTINGS", SMALL)
    laz = laspy.read(moved(pair[0], tmp_path / "out.laz", shift))
    with CopcReader.open(str(moved(pair[1], tmp_path / "out.copc.laz", shift))) as reader:
        nodes = nodes_of(reader)
        info = reader.copc_info
        assert np.array_equal(rows_of(reader.query()), rows_of(laz.points))
    assert sum(node.point_count for node, *_ in nodes) == POINTS
    for node, xyz, times in nodes:
        assert (xyz >= node.bounds.mins).all() and (xyz < node.bounds.maxs).all(), node
        assert (np.diff(times) >= 0).all()
    assert max(node.key.level for node, *_ in nodes) >= 4
    assert info.spacing == 2 * info.halfsize / 128
    assert (info.gps_min, info.gps_max) == (laz.gps_time.min(), laz.gps_time.max())
    keys = {(n.key.level, n.key.x, n.key.y, n.key.z) for n, *_ in nodes}
    assert all(k[0] == 0 or (k[0] - 1, *(i >> 1 for i in k[1:])) in keys for k in keys)
    layout = read_layout(tmp_path / "out.copc.laz")
    assert b"what others say" in (tmp_path / "out.copc.laz").read_bytes()[layout.tail :]
    assert np.allclose(reader.header.mins, laz.header.mins, atol=1e-9)


def test_levels_are_samples_of_the_cloud(pair, tmp_path, monkeypatch):
    "A point for each cell of a node's grid above the leaves, but for the few of small children"
    monkeypatch.setattr("mlscorr.io.clouds._copc_writer.SETTINGS", SMALL)
    with CopcReader.open(str(moved(pair[1], tmp_path / "out.copc.laz"))) as reader:
        nodes = nodes_of(reader)
        info = reader.copc_info
        corner = info.center - info.halfsize
        for level in range(2):
            points = xyz_of(reader.query(level=level))
            cells = np.floor((points - corner) / (info.spacing / 2**level)).astype(int)
            alone = len(np.unique(cells, axis=0)) / len(cells)
            assert alone > 0.9, (level, alone)
        inside = [n for n, *_ in nodes if n.key.level == 0]
        assert len(inside) == 1 and inside[0].point_count < POINTS / 2


def test_a_box_and_a_level_are_read_by_others(pair, tmp_path, monkeypatch):
    "laspy finds by the hierarchy exactly the points inside a box"
    monkeypatch.setattr("mlscorr.io.clouds._copc_writer.SETTINGS", SMALL)
    with CopcReader.open(str(moved(pair[1], tmp_path / "out.copc.laz"))) as reader:
        whole = xyz_of(reader.query())
        box = Bounds(*(CORNER[:2] + np.array([[-20.0, 5.0], [10.0, 31.0]])))
        some = xyz_of(reader.query(bounds=box))
        levels = [len(reader.query(level=level)) for level in range(12)]
    inside = ((whole[:, :2] >= box.mins) & (whole[:, :2] <= box.maxs)).all(axis=1)
    assert np.array_equal(np.unique(some, axis=0), np.unique(whole[inside], axis=0))
    assert sum(levels) == POINTS


def test_points_at_one_place_end_in_one_node(pair, tmp_path, monkeypatch):
    "No halving parts what has the same coordinates: the smallest node takes it all"
    monkeypatch.setattr("mlscorr.io.clouds._copc_writer.SETTINGS", SMALL)
    las = laspy.read(pair[0])
    las.X[: POINTS // 2] = 7
    las.Y[: POINTS // 2] = 8
    las.Z[: POINTS // 2] = 9
    las.write(tmp_path / "in.laz")
    copc = write_copc(tmp_path / "in.laz", tmp_path / "in.copc.laz")
    with CopcReader.open(str(moved(copc, tmp_path / "out.copc.laz"))) as reader:
        assert len(reader.query()) == POINTS
        assert max(node.point_count for node, *_ in nodes_of(reader)) > POINTS // 2 - 40


def test_a_copc_becomes_a_plain_las(pair, tmp_path):
    "An output other than LAZ has no octree records"
    plain = moved(pair[1], tmp_path / "out.las")
    assert np.array_equal(rows_of(laspy.read(plain).points), rows_of(laspy.read(pair[0]).points))
    assert read_layout(plain).owner(read_layout(plain).vlrs[0][0])[0] != b"copc"


def test_an_interrupted_copc_leaves_nothing(pair, tmp_path):
    "An interrupted correction leaves neither a file nor a temporary one next to it"

    class Stopped:
        def apply(self, cloud):
            raise ValueError("stopped")

    with pytest.raises(ValueError, match="stopped"):
        write_corrected(cloud_of(pair[1]), tmp_path / "out.copc.laz", Stopped())
    assert not list(tmp_path.iterdir())


def test_a_full_disk_is_told_of_before_the_work(tmp_path):
    "The room that sorting takes is asked for at once"
    with pytest.raises(OSError, match=r"GB free; 1000000000\.0 GB are needed to sort"):
        check_space(tmp_path, 10**18, "to sort.")


# ---- wrong


def damaged(path, name):
    "Bytes of a COPC made bad in one way"
    data = bytearray(path.read_bytes())
    info = 375 + 54
    root, size = struct.unpack_from("<2Q", data, info + 40)
    if name == "cut":
        return data[: root + size // 2]
    form, position, value = {
        "root behind the end": ("<Q", info + 40, len(data)),
        "root of no page": ("<Q", info + 48, 33),
        "a node less": ("<Q", info + 48, size - 32),
        "a node of other points": ("<i", root + 28, 1),
        "a chunk elsewhere": ("<Q", root + 16, 1_000),
        "a page in circles": ("<QII", root + size - 16, (root, size, 2**32 - 1)),
        "info of another length": ("<H", 375 + 20, 159),
        "point format 1": ("<B", 104, 0x81),
    }[name]
    struct.pack_into(form, data, position, *(value if isinstance(value, tuple) else (value,)))
    return data


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("cut", "is truncated"),
        ("root behind the end", "is truncated: its COPC hierarchy should extend to byte"),
        ("root of no page", "33 bytes are not a page of a COPC hierarchy"),
        ("a node less", "its COPC hierarchy .* Write it again"),
        ("a node of other points", "its COPC hierarchy .* Write it again"),
        ("a chunk elsewhere", "its COPC hierarchy .* Write it again"),
        ("a page in circles", "has page .* twice"),
        ("info of another length", "damaged"),
        ("point format 1", "formats 6 to 8, not 1"),
    ],
)
def test_a_hierarchy_that_lies_is_refused(pair, name, words, tmp_path):
    "A COPC whose octree is cut off or not that of its chunks is refused in a sentence"
    bad = tmp_path / "bad.copc.laz"
    bad.write_bytes(damaged(pair[1], name))
    with pytest.raises(ValueError, match=rf"bad\.copc\.laz .*{words}"):
        read_layout(bad)


@pytest.mark.long
def test_a_copc_without_times_is_refused(street, tmp_path):
    "An octree made of points without gps_time has zeros there: no trajectory covers them"
    folder = shutil.copytree(street, tmp_path / "survey")
    las = laspy.read(folder / "pass-1.laz")
    las.gps_time = np.zeros(len(las.points))
    las.write(tmp_path / "in.laz")
    write_copc(tmp_path / "in.laz", folder / "pass-1.laz")
    with pytest.raises(ValueError, match=r"pass-1\.laz .*gps_time 0"):
        mlscorr.read_survey(folder)


@pytest.mark.long
def test_a_header_with_a_wrong_box_costs_a_look_more(pair, tmp_path):
    "Bounds that are no numbers, or of a continent, do not spoil the cube"
    data = bytearray(pair[1].read_bytes())
    with CopcReader.open(str(moved(pair[1], tmp_path / "good.copc.laz"))) as reader:
        centre = reader.copc_info.center
    for bounds in ([np.nan] * 6, [9e6, -9e6] * 3, [0.0] * 6):
        struct.pack_into("<6d", data, 179, *bounds)
        (tmp_path / "in.copc.laz").write_bytes(data)
        out = moved(tmp_path / "in.copc.laz", tmp_path / "out.copc.laz")
        with CopcReader.open(str(out)) as reader:
            assert reader.copc_info.halfsize == 128.0, bounds
            assert np.abs(reader.copc_info.center - centre).max() <= 1.0, bounds


def test_one_sorted_copy_stays_at_a_time(pair, tmp_path):
    "Many files do not fill the disk: a copy goes once another is made and nobody reads it"
    other = shutil.copy(pair[1], tmp_path / "other.copc.laz")
    first = in_time_order(read_layout(pair[1]))
    half_read = read_chunks(cloud_of(pair[1]), 7_000)
    read = len(next(half_read))
    path = first.path
    del first
    second = in_time_order(read_layout(other))
    assert path.exists() and second.path.exists()
    las = laspy.read(pair[0])
    measured = ~np.array(las.withheld, bool) & ~np.isin(las.classification, [7, 18])
    assert read + sum(len(chunk) for chunk in half_read) == measured.sum()
    assert not path.exists() and second.path.exists()
