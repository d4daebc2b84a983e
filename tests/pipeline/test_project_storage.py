"""A project in an object store: read there, corrected, and written there, whole and resumable."""

from io import BytesIO

import laspy
import numpy as np
import pytest
from laspy import CopcReader

from mlscorr.pipeline.project import Options, correct_project, project_status
from tests.beds import project_street as bed
from tests.beds.copc_files import write_copc
from tests.beds.las_1_5 import as_las_1_5
from tests.beds.made_once import copied_once
from tests.beds.object_store import object_store

pytestmark = pytest.mark.long

PROJECT = "s3://city/project.toml"
OUT = "s3://city/out"


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    "An ObjectStore with a project of two drives of two tiles, corrected there by two processes"
    folder = copied_once(tmp_path_factory, "city", bed.write_tiled)
    with object_store("city") as (store, files):
        files.put(f"{folder}/", "city/", recursive=True)
        store.files = files
        store.result = correct_project(PROJECT, OUT, Options(page=False, workers=2))
        yield store


def resumed(store):
    "Result of another run, and the names of the clouds that it wrote, in order"
    before = len(store.files.cat_file("city/out/log.txt"))
    result = correct_project(PROJECT, OUT, Options(page=False, resume=True))
    new = store.files.cat_file("city/out/log.txt")[before:].decode().splitlines()
    words = [line.split() for line in new]
    return result, sorted(word[3] for word in words if word[2] == "clouds:")


def cloud(store, name):
    "Points (n, 3) of a cloud. Units: m"
    return laspy.read(BytesIO(store.files.cat_file(f"city/{name}"))).xyz


def test_a_project_is_corrected_where_it_lies(store):
    "A drive that is 43 cm off comes to within a fifth of that, from a store into it"
    assert store.result.document["faults"] == []
    for number in (1, 2):
        moved = cloud(store, f"out/second/tile-{number}.laz")
        moved -= cloud(store, f"second/tile-{number}.laz")
        assert np.linalg.norm(moved + bed.SHIFT, axis=1).max() < np.linalg.norm(bed.SHIFT) / 5


def test_status_is_told_from_a_store(store):
    "All that was planned is done, as status reads it there"
    rows = project_status(OUT)["all"]
    assert [row["share"] for row in rows] == [1.0] * 4


def test_only_what_is_missing_is_done_again(store):
    "A run on whole results writes no cloud; a lost and a damaged one are written anew"
    assert resumed(store)[1] == []
    path = "city/out/second/tile-2.laz"
    whole = store.files.cat_file(path)
    store.files.rm("city/out/first/tile-1.laz")
    store.files.pipe_file(path, whole[:-9])
    assert resumed(store)[1] == ["first/tile-1.laz", "second/tile-2.laz"]
    assert store.files.cat_file(path) == whole


@pytest.mark.parametrize("lost", ["city/second/tile-1.laz", "city/out/second/tile-1.laz"])
def test_a_connection_that_is_lost_fails_a_single_file(store, lost):
    "Read or written, one file is named with the reason, others are done, and --resume does it"
    store.files.rm("city/out/second/tile-1.laz")
    store.files.rm("city/out/first/tile-1.laz")
    store.lost = lost
    store.lost_after = 0
    try:
        result, written = resumed(store)
    finally:
        store.lost = ""
    fault = result.document["faults"][0]
    assert (fault["name"], written) == ("second/tile-1.laz", ["first/tile-1.laz"])
    assert f"s3://{lost} can't be reached" in fault["fault"]
    assert not result.is_whole
    assert not store.files.exists("city/out/second/tile-1.laz")
    assert resumed(store)[1] == ["second/tile-1.laz"]


def test_copc_and_las_1_5_in_a_store_are_corrected_as_on_a_disk(store, tmp_path, tmp_path_factory):
    "The same bytes from a store into it: an octree that is read by ranges, and LAS 1.5 with offset"
    folder = copied_once(tmp_path_factory, "city", bed.write_tiled)
    old, older = (folder / "second" / f"tile-{number}.laz" for number in (1, 2))
    write_copc(old, old.with_suffix(".copc.laz"))
    as_las_1_5(older, folder / "second" / "new.laz", laspy.read(older).gps_time, flags=0)
    old.unlink()
    older.unlink()
    store.files.put(f"{folder}/", "city/new/", recursive=True)
    options = Options(page=False)
    here = correct_project(folder / "project.toml", tmp_path / "out", options)
    there = correct_project("s3://city/new/project.toml", "s3://city/new/out", options)
    assert here.document["faults"] == there.document["faults"] == []
    names = ["first/tile-1.laz", "first/tile-2.laz", "second/new.laz", "second/tile-1.copc.laz"]
    for name in names:
        whole = (tmp_path / "out" / name).read_bytes()
        assert store.files.cat_file(f"city/new/out/{name}") == whole, name
    assert whole[25] == 4
    assert (tmp_path / "out" / "second" / "new.laz").read_bytes()[25] == 5
    with CopcReader(BytesIO(whole)) as reader:
        assert len(reader.query()) == reader.header.point_count
