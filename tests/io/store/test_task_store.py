"""Results of tasks: whole or not there, named by what they depend on, harmless to load."""

import os
import pickle
from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mlscorr.io.store import FileIdentity, TaskStore, digest
from mlscorr.survey import Mounting, PointCloud

MOUNTING = Mounting(np.array([0.1, -0.6, 0.4]), Rotation.from_euler("z", 0.3))


def test_a_digest_changes_with_every_value():
    "Numbers, texts, arrays, dtypes, shapes and fields; the same values give the same"
    values = [1, 1.0, "1", np.ones(2), np.ones((1, 2)), np.ones(2, np.float32), (1, 2), (12,)]
    values += [MOUNTING, replace(MOUNTING, lever_arm=np.zeros(3)), None, {"a": 1}, {"a": 2}]
    digests = [digest(value) for value in values]
    assert len(set(digests)) == len(digests)
    assert digest(MOUNTING) == digest(Mounting(MOUNTING.lever_arm, Rotation.from_euler("z", 0.3)))
    with pytest.raises(TypeError, match="has no digest"):
        digest(object())


def test_a_result_is_found_again_or_not_there(tmp_path):
    "A stored result is found again; a damaged, truncated or missing one is not"
    store = TaskStore(tmp_path)
    cloud = PointCloud(np.ones((2, 3)), np.zeros(2), np.zeros(2, np.uint16))
    store.put("findings", "k", (cloud, {"a": (1, None)}, MOUNTING))
    same, rest, mounting = store.get("findings", "k")
    assert np.array_equal(same.xyz, cloud.xyz) and rest == {"a": (1, None)}
    assert np.allclose(mounting.boresight.as_quat(), MOUNTING.boresight.as_quat())
    path = store.path("findings", "k")
    content = path.read_bytes()
    for damaged in (content[:-1], content[:40], b"", content[:50] + b"\0" + content[51:]):
        path.write_bytes(damaged)
        with pytest.raises(KeyError):
            store.get("findings", "k")
    with pytest.raises(KeyError):
        store.get("clouds", "k")


@dataclass
class Trap:
    "Runs a command where it is loaded without care"

    def __reduce__(self):
        return os.mkdir, ("trapped",)


def test_a_result_of_others_runs_no_code(tmp_path, monkeypatch):
    "A value that calls a function of the system, by its name or through a room, is not there"
    monkeypatch.chdir(tmp_path)
    store = TaskStore(tmp_path / "tasks")
    store.put("clouds", "k", Trap())
    with pytest.raises(KeyError):
        store.get("clouds", "k")
    assert b"mkdir" in pickle.dumps(Trap())
    assert not (tmp_path / "trapped").exists()


def test_a_second_run_is_kept_out(tmp_path):
    "Two at a time are refused; what a killed one left half made goes when the next begins"
    store = TaskStore(tmp_path / "tasks")
    with store.locked():
        with pytest.raises(ValueError, match="Another run is active"), store.locked():
            pass
        (store.folder / "part.0").mkdir()
        (store.folder / "part.0" / "part").mkdir()
        (store.folder / "part.0" / "part" / "tile.laz").write_bytes(b"half")
    with store.locked():
        assert not [*store.folder.glob("part.*")]


def test_a_file_is_told_by_head_tail_size_and_time(tmp_path):
    "The same until a byte at an end, the size or the time changes"
    path = tmp_path / "tile.laz"
    path.write_bytes(b"a" * 300_000)
    first = FileIdentity.of(path)
    assert FileIdentity.of(path) == first
    path.write_bytes(b"a" * 299_999 + b"b")
    os.utime(path, ns=(first.changed, first.changed))
    assert FileIdentity.of(path).digest != first.digest
