"""Folders that are made once a session, by whichever worker of it comes first."""

import fcntl
import os
import shutil


def made_once(tmp_path_factory, name, make):
    """Folder of a name, filled by make(folder); all tests of all workers share it, none changes it.

    ``copied_once`` gives a copy that may be changed.
    """
    root = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        root = root.parent  # of all workers
    place = root / "made-once"
    place.mkdir(exist_ok=True)
    folder = place / name
    with (place / f"{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not folder.exists():
            unfinished = place / f"{name}-unfinished"
            shutil.rmtree(unfinished, ignore_errors=True)  # of a worker that failed
            make(unfinished)
            unfinished.rename(folder)
    return folder


def copied_once(tmp_path_factory, name, make):
    "A copy, of the caller's own, of the folder of a name, as of made_once"
    copy = tmp_path_factory.mktemp(name) / name
    return shutil.copytree(made_once(tmp_path_factory, name, make), copy)


def contents(folder):
    "Path, size and time of change of all that is in a folder, by which a change is seen"
    states = {path: path.stat() for path in sorted(folder.rglob("*"))}
    return [(str(path), state.st_size, state.st_mtime_ns) for path, state in states.items()]
