"""Files by URL: read by ranges, the same as from a disk, and what is said where they can't be."""

import pickle
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import s3fs

from mlscorr.io.clouds import (
    cloud_writer,
    read_chunks,
    read_intervals,
    read_layout,
    sample_gps_times,
)
from mlscorr.io.store import (
    FileIdentity,
    TaskStore,
    as_path,
    check_unchanged,
    digest,
    files_like,
    input_file,
    is_remote,
    is_there,
    open_file,
    sibling,
)
from mlscorr.io.surveys import read_survey, write_survey_copy
from mlscorr.survey import CloudFile, PointCloud
from tests.beds.foreign_clouds import points_of, write_ply
from tests.beds.object_store import object_store

CORNER = np.array([532_000.0, 3_374_000.0, 40.0])  # m
# s, points/s
START = 413_200.0
RATE = 1e5


@pytest.fixture(scope="module")
def store(street, tmp_path_factory):
    "An ObjectStore whose bucket has the survey of a street, and a cloud of 1.5 million points"
    clouds = tmp_path_factory.mktemp("clouds")
    rng = np.random.default_rng(3)
    points = 1_500_000
    xyz = CORNER + rng.uniform(-900, 900, (points, 3))  # nothing to compress
    times = START + np.arange(points) / RATE
    for name in ("long.laz", "long.las"):
        with cloud_writer(clouds / name, CORNER) as writer:
            writer.write(PointCloud(xyz, times, rng.integers(0, 65_536, points)))
    with object_store("streets") as (store, files):
        files.put(f"{street}/", "streets/monday/", recursive=True)
        files.put(f"{clouds}/", "streets/", recursive=True)
        store.clouds = clouds
        store.files = files
        yield store


def test_a_survey_in_a_store_is_the_one_on_a_disk(store, street):
    "Trajectory, control and clouds are the same by URL, patterns and paths with .. included"
    text = (street / "survey.toml").read_text().replace('"pass-1.laz"', '"../monday/pass-?.laz"')
    store.files.pipe_file("streets/monday/other.toml", text.encode())
    here = read_survey(street)
    there = read_survey("s3://streets/monday")
    for far in (there, read_survey("s3://streets/monday/other.toml")):
        assert digest(here.trajectory, here.control) == digest(far.trajectory, far.control)
        assert [str(cloud.path) for cloud in far.clouds] == ["s3://streets/monday/pass-1.laz"]
        chunks = zip(read_chunks(here.clouds[0]), read_chunks(far.clouds[0]), strict=True)
        assert all(np.array_equal(a.xyz, b.xyz) for a, b in chunks)
    check_unchanged(there.inputs)


def test_a_survey_here_may_name_files_there(store, street, tmp_path):
    "URLs stand in a survey.toml on a disk, for clouds, trajectory and control"
    text = (street / "survey.toml").read_text()
    for name in ("pass-1.laz", "trajectory.csv", "control.csv"):
        text = text.replace(f'"{name}"', f'"s3://streets/monday/{name}"')
    (tmp_path / "survey.toml").write_text(text)
    survey = read_survey(tmp_path)
    assert all(is_remote(file.path) for file in survey.inputs[1:] if file.what != "reference")
    assert digest(survey.trajectory) == digest(read_survey(street).trajectory)


def test_a_web_server_is_read_too(store, street):
    "Files of https:// have no patterns; named one by one they are the same as on a disk"
    address = f"{store.url}/streets/monday"
    for name in store.files.find("streets/monday"):
        store.files.chmod(name, acl="public-read")
    there = read_survey(f"{address}/survey.toml")
    assert digest(there.trajectory) == digest(read_survey(street).trajectory)
    assert FileIdentity.of(there.cloud_paths[0]).size == (street / "pass-1.laz").stat().st_size
    with pytest.raises(ValueError, match=r"pass-\*\.laz is a pattern on a web server"):
        files_like(there.path.parent, "pass-*.laz")


def test_a_survey_elsewhere_names_its_files_by_url(store, tmp_path):
    "A survey.toml written anew on a disk, as calibrate does, reads what that in a store did"
    path = as_path("s3://streets/monday/survey.toml")
    write_survey_copy(path, tmp_path / "survey.toml", tmp_path)
    there = read_survey(path)
    copy = read_survey(tmp_path)
    assert copy.cloud_paths == there.cloud_paths
    assert digest(copy.trajectory, copy.control) == digest(there.trajectory, there.control)


def test_clouds_of_other_formats_are_copied_first(store, street, tmp_path):
    "A PLY in a store has the points of the LAZ that it was made of"
    write_ply(tmp_path / "street.ply", points_of(street / "pass-1.laz"))
    store.files.put(str(tmp_path / "street.ply"), "streets/street.ply")
    layout = read_layout(as_path("s3://streets/street.ply"))
    assert layout.points == read_layout(street / "pass-1.laz").points
    assert str(layout.cloud) == "s3://streets/street.ply"


def test_a_header_and_a_window_are_read_by_ranges(store):
    "Of a LAZ of 15 MB the header takes 0.3 MB in six requests, and 0.2 s of 15 s less than 5 MB"
    path = as_path("s3://streets/long.laz")
    size = (store.clouds / "long.laz").stat().st_size
    store.requests.clear()
    layout = read_layout(path)
    header, count = store.read("long.laz")
    assert size > 15e6
    assert header < 0.3e6
    assert count <= 6
    store.requests.clear()
    file = CloudFile(path, layout.points, 0.0, "week")
    parts = list(read_chunks(file, first=700_000, end=720_000))
    assert sum(map(len, parts)) == 20_000
    assert parts[0].gps_time[0] == START + 700_000 / RATE
    assert store.read("long.laz")[0] < 5e6


@pytest.mark.long
def test_spans_of_time_are_those_of_a_disk(store):
    "Windows of a long cloud in a store hold the same points, and take a quarter of its bytes"
    spans = START + np.array([[1.0, 1.1], [9.0, 9.1]])
    path = store.clouds / "long.las"
    points = sample_gps_times(path)[0]
    there = CloudFile(as_path("s3://streets/long.las"), points, 0.0, "week")
    here = CloudFile(path, points, 0.0, "week")
    store.requests.clear()
    pairs = zip(
        read_intervals(there, spans, limit=100_000),
        read_intervals(here, spans, limit=100_000),
        strict=True,
    )
    assert all(np.array_equal(a.xyz, b.xyz) for a, b in pairs)
    assert store.read("long.las")[0] < 0.25 * path.stat().st_size


def test_a_file_in_a_store_is_told_by_its_content(store):
    "Its ETag changes with it, not with its name, and no byte of it is read for that"
    path = as_path("s3://streets/some.bin")
    store.files.pipe_file("streets/some.bin", b"a" * 9)
    first = FileIdentity.of(path)
    named = input_file("cloud", path)
    store.requests.clear()
    assert FileIdentity.of(path) == first
    assert store.read("some.bin") == (0, 0)
    store.files.pipe_file("streets/some.bin", b"b" * 9)
    assert FileIdentity.of(path) != first
    with pytest.raises(OSError, match=r"1 of 1 input files changed.*cloud s3://streets/some"):
        check_unchanged([named])
    store.files.rm("streets/some.bin")
    with pytest.raises(OSError, match="it was removed"):
        check_unchanged([named])


def test_paths_of_a_store_go_to_workers_and_into_results(store, tmp_path):
    "They pickle, they have digests, and a result that holds one is loaded again"
    path = as_path("s3://streets/long.laz")
    assert pickle.loads(pickle.dumps(path)) == path
    assert digest(path) != digest(as_path("s3://streets/monday/pass-1.laz"))
    results = TaskStore(tmp_path)
    results.put("tiles", "key", CloudFile(path, 5, 0.0, "week"))
    assert results.get("tiles", "key").path == path


def test_other_stores_have_the_same_interface():
    "A survey's files may lie wherever fsspec reads: here in the memory of this process"
    path = as_path("memory://street/a.txt")
    path.write_bytes(b"1\n2\n")
    assert is_there(path)
    assert not is_there(sibling(path, "b.txt"))
    assert files_like(path.parent, "*.txt") == [path]
    assert FileIdentity.of(path).size == 4
    with open_file(path, "utf-8") as file:
        assert [*map(int, file)] == [1, 2]
    assert as_path("file:///street/a.txt") == Path("/street/a.txt")


def test_a_lost_connection_is_no_damaged_file(store):
    "A network error is reported as such, without advice to copy the file again"
    layout = read_layout(as_path("s3://streets/long.laz"))
    store.lost = "long.laz"
    store.lost_after = 3
    try:
        with pytest.raises(
            OSError, match=r"long\.laz can't be reached, even after retries .* run again"
        ):
            list(read_chunks(CloudFile(layout.path, layout.points, 0.0, "week")))
    finally:
        store.lost = ""


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("s3://streets/tuesday", "streets/tuesday does not exist.*survey is a folder"),
        ("s3://avenues/monday", "there is no bucket avenues at this endpoint"),
    ],
)
def test_what_is_not_there_is_named(store, name, sentence):
    "A missing object is told from a missing bucket"
    with pytest.raises(FileNotFoundError, match=sentence):
        read_survey(name)


def test_a_pattern_needs_a_match(store, street, tmp_path):
    "A pattern that nothing is like is named with its store"
    text = (street / "survey.toml").read_text()
    target = shutil.copytree(street, tmp_path / "street") / "survey.toml"
    target.write_text(text.replace('"pass-1.laz"', '"s3://streets/tuesday/*.laz"'))
    with pytest.raises(FileNotFoundError, match=r"no file matches s3://streets/tuesday/\*\.laz"):
        read_survey(target)


def test_schemes_are_known_or_named():
    "An unknown scheme and a missing package are two sentences, with a way out"
    with pytest.raises(ValueError, match="unknown scheme s4://; known are s3://"):
        as_path("s4://streets/monday")
    code = (
        "import sys; sys.modules['fsspec'] = None\n"
        "from mlscorr.io.store.storage import as_path\n"
        "try: as_path('s3://streets/monday')\n"
        "except ImportError as error: print(error)"
    )
    said = subprocess.check_output([sys.executable, "-c", code], text=True)
    assert "requires fsspec and universal_pathlib: pip install 'mlscorr[remote]'" in said


def test_a_dead_endpoint_is_named(store, monkeypatch):
    "A dead endpoint is reported as such, not as a missing file"
    monkeypatch.setenv("AWS_ENDPOINT_URL", "http://127.0.0.1:1")
    s3fs.S3FileSystem.clear_instance_cache()
    try:
        for name in ("s3://streets/long.laz", "http://127.0.0.1:1/long.laz"):
            with pytest.raises(OSError, match=f"{name} can't be reached"):
                is_there(as_path(name))
    finally:
        s3fs.S3FileSystem.clear_instance_cache()


@pytest.mark.long
def test_a_command_without_credentials_ends_with_a_sentence(store, monkeypatch):
    "It says where they are looked for, and ends with code 5"
    monkeypatch.delenv("AWS_ACCESS_KEY_ID")
    command = [sys.executable, "-m", "mlscorr", "check", "s3://streets/monday"]
    process = subprocess.run(command, capture_output=True, text=True)
    assert process.returncode == 5
    assert (
        "Access to s3://streets/monday was denied (Unable to locate credentials)"
    ) in process.stderr
    assert "Traceback" not in process.stderr


def test_a_disk_needs_no_fsspec():
    "With all files on a disk neither fsspec nor its dependencies are imported"
    code = (
        "import sys, mlscorr, mlscorr.cli\n"
        "from mlscorr.io.store.storage import as_path, is_there\n"
        "assert is_there(as_path(sys.executable))\n"
        "print({'fsspec', 'upath', 's3fs'} & set(sys.modules))"
    )
    assert subprocess.check_output([sys.executable, "-c", code], text=True).strip() == "set()"


def test_endings_in_capitals_are_as_good(tmp_path):
    "A pattern of .laz means .LAZ too, and each file once"
    for name in ("a.laz", "b.LAZ", "c.las"):
        (tmp_path / name).touch()
    assert [path.name for path in files_like(tmp_path, "*.laz")] == ["a.laz", "b.LAZ"]


def test_a_folder_is_like_no_pattern(tmp_path):
    "Only files are clouds: a folder that is named like a file is left out"
    (tmp_path / "a.laz").touch()
    (tmp_path / "old.laz").mkdir()
    assert files_like(tmp_path, "*.laz") == [tmp_path / "a.laz"]


def test_folders_that_link_to_each_other_are_entered_once(tmp_path):
    "12 folders with links to all and to the one above: each of their 12 files once, within 2 s"
    folders = [tmp_path / "drive" / f"day-{number:02d}" for number in range(12)]
    for folder in folders:
        folder.mkdir(parents=True)
        (folder / f"{folder.name}.laz").touch()
        (folder / "up").symlink_to("..")
        for other in folders:
            (folder / f"to-{other.name}").symlink_to(other)
    (tmp_path / "drive" / "itself").symlink_to("itself")
    found = files_like(tmp_path, "drive/**/*.laz")
    assert found == [folder / f"{folder.name}.laz" for folder in folders]


def test_a_link_to_a_folder_elsewhere_is_followed(tmp_path):
    "** finds files in a folder of another place by the link to it, but none in a hidden folder"
    (tmp_path / "disk" / "deep").mkdir(parents=True)
    (tmp_path / "disk" / "deep" / "a.laz").touch()
    (tmp_path / "survey" / ".old").mkdir(parents=True)
    (tmp_path / "survey" / ".old" / "b.laz").touch()
    (tmp_path / "survey" / "c.LAZ").touch()
    (tmp_path / "survey" / "data").symlink_to("../disk")
    found = files_like(tmp_path / "survey", "**/*.laz")
    assert [path.relative_to(tmp_path / "survey").as_posix() for path in found] == [
        "c.LAZ",
        "data/deep/a.laz",
    ]
    everything = files_like(tmp_path / "survey", "**")
    assert [path.name for path in everything] == ["c.LAZ", "a.laz"]
    assert files_like(tmp_path, f"{tmp_path}/disk/**/*.laz") == [tmp_path / "disk/deep/a.laz"]
