"""Writing into a store: whole objects or none, one run at a time."""

import subprocess
import sys
import threading
import time

import pytest

from mlscorr.io.store import (
    TaskStore,
    appended,
    as_path,
    check_store_output,
    digest,
    output_file,
    publish,
    write_json,
)
from mlscorr.io.store.publishing import locked_in_store, names_in
from tests.beds.object_store import object_store

BEAT = 0.5  # s, three of which a busy machine does not miss


@pytest.fixture(scope="module")
def store():
    "An ObjectStore with an empty bucket"
    with object_store("results") as (store, files):
        store.files = files
        yield store


def uploads(store):
    "Multipart uploads that are neither completed nor aborted"
    return store.files.call_s3("list_multipart_uploads", Bucket="results").get("Uploads", [])


def test_a_large_file_arrives_in_parts(store, tmp_path):
    "A file of three parts is the same in the store, and no upload is left open"
    content = bytes(range(256)) * (40 << 12)
    (tmp_path / "large.laz").write_bytes(content)
    store.requests.clear()
    publish(tmp_path / "large.laz", as_path("s3://results/large.laz"))
    assert sum(method == "PUT" for method, *_ in store.requests) == 3
    assert store.files.cat_file("results/large.laz") == content
    assert not uploads(store)


@pytest.mark.parametrize("megabytes", [1, 40])
def test_an_upload_that_is_cut_leaves_what_was_there(store, tmp_path, megabytes):
    "An object is the old one, in one part as in three, and the upload of parts is aborted"
    (tmp_path / "cut.laz").write_bytes(bytes(megabytes << 20))
    store.files.pipe_file("results/cut.laz", b"old")
    store.lost = "cut.laz"
    store.lost_after = megabytes // 40
    try:
        with pytest.raises(OSError, match=r"s3://results/cut\.laz can't be reached"):
            publish(tmp_path / "cut.laz", as_path("s3://results/cut.laz"))
    finally:
        store.lost = ""
    assert store.files.cat_file("results/cut.laz") == b"old"
    assert not uploads(store)


def test_an_exception_publishes_nothing(store):
    "A file that was begun does not appear where its writing raised; one that ends does"
    path = as_path("s3://results/page.html")
    with pytest.raises(RuntimeError), output_file(path) as part:
        part.write_text("half")
        raise RuntimeError
    assert names_in(path.parent).count("page.html") == 0
    with output_file(path) as part:
        part.write_text("whole")
    assert store.files.cat_file("results/page.html") == b"whole"


def test_results_of_tasks_are_kept_in_a_store(store):
    "A stored result is found by its key; a damaged or missing one counts as never stored"
    results = TaskStore(as_path("s3://results/tasks"))
    results.put("tiles", "key", {"points": 5})
    assert results.get("tiles", "key") == {"points": 5}
    assert (results.keys("tiles"), results.keys("clouds")) == ({"key"}, set())
    store.files.pipe_file("results/tasks/tiles/key.result", b"damaged" * 9)
    for key in ("key", "none"):
        with pytest.raises(KeyError):
            results.get("tiles", key)
    store.lost = "key.result"
    store.lost_after = 0
    try:
        with pytest.raises(OSError, match="can't be reached"):
            results.get("tiles", "key")
    finally:
        store.lost = ""


def test_results_are_removed_and_nothing_else(store):
    "Of a run's folder, begun with its lock; a text among the results stays, by any suffix"
    results = TaskStore(as_path("s3://results/again/tasks"))
    assert not results.is_begun() and results.is_locked() is False
    with results.locked():
        assert results.is_begun() and results.is_locked() is None
    results.put("tiles", digest("a"), 1)
    store.files.pipe_file("results/again/tasks/tiles/mine.result", b"precious")
    assert not results.is_begun()
    results.clear()
    assert results.keys("tiles") == {"mine"}


def test_a_log_goes_on_where_it_ended(store):
    "Lines are put behind those of an earlier run"
    path = as_path("s3://results/log.txt")
    for line in ("first", "second"):
        with appended(path) as log:
            print(line, file=log, flush=True)
    assert store.files.cat_file("results/log.txt") == b"first\nsecond\n"


def test_two_runs_do_not_share_a_folder(store):
    "A second run is refused with the name of the first one's machine, and the lock goes in the end"
    lock = as_path("s3://results/city/tasks/lock")
    with (
        locked_in_store(lock, BEAT),
        pytest.raises(ValueError, match=r"Another run is active in s3://results/city \(.*process"),
        locked_in_store(lock, BEAT),
    ):
        pass
    assert names_in(lock.parent) == []


def test_the_lock_of_a_killed_run_is_taken_over_by_a_single_one(store):
    "A lock that nobody renews gives way after three beats; of two that wait one is refused"
    lock = as_path("s3://results/city/tasks/lock")
    store.files.pipe_file("results/city/tasks/lock", b"elsewhere, process 1\n0")
    outcomes = []
    refused = threading.Event()

    def run():
        try:
            with locked_in_store(lock, BEAT):
                outcomes.append("at work")
                refused.wait(60)
        except ValueError as error:
            outcomes.append(str(error))
            refused.set()

    threads = [threading.Thread(target=run) for _ in range(2)]
    for thread in threads:
        thread.start()
        time.sleep(BEAT)
    for thread in threads:
        thread.join()
    assert sorted(outcome[:11] for outcome in outcomes) == ["Another run", "at work"]
    assert names_in(lock.parent) == []


def test_a_folder_with_other_things_is_refused(store):
    "Neither inputs nor what is there already are written over; a missing bucket is named"
    write_json("s3://results/other/project.json", {"name": "other"})
    out = as_path("s3://results/other")
    with pytest.raises(ValueError, match=r"1 entry.*\(first: project\.json\)"):
        check_store_output(out, [], overwrite=False)
    with pytest.raises(ValueError, match=r"the input a\.laz, which must"):
        check_store_output(out, [out / "a.laz"], overwrite=True)
    with pytest.raises(ValueError, match=r"contains the input first/a\.laz, which must not"):
        check_store_output(out, [out / "first" / "a.laz"], True, ["first"])
    with pytest.raises(ValueError, match="on a web server, which can't store results"):
        check_store_output(as_path("https://example.org/out"), [], overwrite=True)
    with pytest.raises(FileNotFoundError, match="there is no bucket nowhere"):
        check_store_output(as_path("s3://nowhere/out"), [], overwrite=False)


def test_results_of_a_survey_go_to_a_disk(street):
    "A URL for what only a folder can hold is refused, with the way out, before anything is done"
    command = [sys.executable, "-m", "mlscorr", "correct", street, "-o", "s3://results/out"]
    process = subprocess.run(command, capture_output=True, text=True)
    assert process.returncode == 2
    assert "Results of a project.toml can go to a store" in process.stderr
