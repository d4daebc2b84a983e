"""Where results go is tried before the work."""

import errno
import os
from pathlib import Path

import pytest

from mlscorr.io.output import check_output


def test_a_disk_that_can_only_be_read_is_named_with_the_way_out(tmp_path, monkeypatch):
    "No folder can be made or removed there; that is said of the folder asked for, not of our own"

    def refuse(path):
        raise OSError(errno.EROFS, os.strerror(errno.EROFS), str(path))

    monkeypatch.setattr(Path, "mkdir", refuse)
    monkeypatch.setattr(Path, "rmdir", refuse)
    with pytest.raises(OSError, match=r"out can't be used: .*Read-only.*Choose another place"):
        check_output(tmp_path / "out", [], overwrite=False)


def test_a_mounted_disk_that_can_only_be_read_is_named(tmp_path, monkeypatch):
    "A folder of another disk takes what isn't whole only where it can be written"

    def cross(path, target):
        raise OSError(errno.EXDEV, os.strerror(errno.EXDEV), str(path))

    monkeypatch.setattr(Path, "rename", cross)
    (tmp_path / "disk").mkdir()
    check_output(tmp_path / "disk", [], overwrite=False)
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    with pytest.raises(OSError, match=r"disk can't be used: .*disk takes no folder .not writable"):
        check_output(tmp_path / "disk", [], overwrite=False)
    assert not list(tmp_path.glob(".*"))
