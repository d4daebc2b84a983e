"""Atomic writing into a folder on a disk or in a store, and a lock."""

import io
import os
import secrets
import socket
import tempfile
import threading
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from time import monotonic, sleep
from typing import Any, TextIO, cast

from mlscorr.io.settings import SETTINGS
from mlscorr.io.store.storage import WEB, asking, check_bucket, is_remote, is_there, read_bytes
from mlscorr.wording import counted

S3 = ("s3", "s3a")  # schemes of stores that accept a file in parallel parts


def names_in(folder: Any) -> list[str]:
    """Sorted names in a folder; empty without a folder.

    Parameters
    ----------
    folder : Path

    Raises
    ------
    OSError
        If a store does not respond, or its bucket is missing.
    """
    if not is_remote(folder):
        if folder.is_dir():
            return sorted(path.name for path in folder.iterdir())
        return []
    try:
        with asking(folder):
            folder.fs.invalidate_cache()
            paths = folder.fs.ls(folder.path, detail=False)
    except FileNotFoundError:
        check_bucket(folder)
        return []
    return sorted(path.rstrip("/").rpartition("/")[2] for path in paths)


def make_folder(folder: Path) -> None:
    """Make a folder; stores do not need one.

    Parameters
    ----------
    folder : Path
    """
    if not is_remote(folder):
        folder.mkdir(parents=True, exist_ok=True)


def remove_files(folder: Any, pattern: str) -> None:
    """Remove files in a folder by a pattern; others are kept.

    Parameters
    ----------
    folder : Path
    pattern : str
    """
    if not is_remote(folder):
        for path in folder.glob(pattern):
            path.unlink()
        return
    with asking(folder):
        folder.fs.invalidate_cache()
        if paths := folder.fs.glob(f"{folder.path}/{pattern}"):
            folder.fs.rm(paths)


def publish(source: Path, target: Any) -> None:
    """Move a complete file to its destination, replacing an existing one.

    Parameters
    ----------
    source : Path
        On the disk of the target, or on any disk if the target is in a store.
    target : Path

    Raises
    ------
    OSError
        If it cannot be written; the target is then unchanged.
    """
    if not is_remote(target):
        os.replace(source, target)
        return
    parts = {}
    if target.protocol in S3:
        parts = {"chunksize": SETTINGS.uploaded_bytes, "max_concurrency": 2}
    with asking(target):
        target.fs.put_file(str(source), target.path, **parts)
        target.fs.invalidate_cache()


def check_store_output(
    out: Path, inputs: Iterable[Path], overwrite: bool, folders: Iterable[str] = ()
) -> None:
    """Refuse an output folder in a store with an input, or with anything not to be replaced.

    Parameters
    ----------
    out, inputs, overwrite, folders
        See ``check_output``.

    Raises
    ------
    ValueError
        If the folder is unsuitable.
    OSError
        See names_in.
    """
    if cast(Any, out).protocol in WEB:
        raise ValueError(
            f"{out} is on a web server, which can't store results. Give a store or a disk."
        )
    present = names_in(out)
    own = {out: Path(), **{out / name: Path(name) for name in folders}}
    inside = [str(own[p.parent] / p.name) for p in inputs if is_remote(p) and p.parent in own]
    check_contents(out, inside, [] if overwrite else present)


def check_contents(out: Path, inside: Sequence[str], present: Sequence[str]) -> None:
    """Refuse an output folder because of its contents.

    Parameters
    ----------
    out : Path
    inside : sequence of str
        Names of the inputs in it, or in its subfolders.
    present : sequence of str
        Names that may not be replaced.

    Raises
    ------
    ValueError
        If there are any.
    """
    if inside:
        raise ValueError(
            f"The output folder {out} contains the input {inside[0]}, which must not be changed. "
            "Choose another folder."
        )
    if present:
        raise ValueError(
            f"The output folder {out} already contains {counted(len(present), 'entry')} (first: "
            f"{present[0]}). Choose another folder, or replace files of the same name with "
            "--overwrite."
        )


class _StoredText(io.StringIO):
    """Text that is written to a store at every heartbeat and at the end."""

    def __init__(self, path):
        super().__init__()
        self.path = path
        self.due = 0.0
        if is_there(path):
            self.write(read_bytes(path).decode())

    def flush(self):
        if monotonic() >= self.due:
            self.due = monotonic() + SETTINGS.beat
            with suppress(OSError), asking(self.path):  # its events matter more than the log
                self.path.fs.pipe_file(self.path.path, self.getvalue().encode())

    def close(self):
        self.due = 0.0
        self.flush()
        super().close()


def appended(path: Path) -> TextIO:
    """Open a text file for appending.

    Parameters
    ----------
    path : Path
    """
    if is_remote(path):
        return _StoredText(path)
    return open(path, "a", encoding="utf-8")


@contextmanager
def scratch_folder() -> Iterator[Path]:
    """Temporary folder (see TMPDIR), removed at the end."""
    with tempfile.TemporaryDirectory(prefix="mlscorr-") as name:
        yield Path(name)


@contextmanager
def locked_in_store(lock: Any, beat: float = SETTINGS.beat) -> Iterator[None]:
    """Lock out other runs by an object that is rewritten at every heartbeat and finally removed.

    A lock that does not change for three heartbeats belongs to a killed run and is taken over.
    Clocks of other machines are not trusted.

    Parameters
    ----------
    lock : Path
        Path in a store.
    beat : float
        Units: s.

    Raises
    ------
    ValueError
        If another run is at work.
    """
    owner = f"{socket.gethostname()}, process {os.getpid()}"
    ended = threading.Event()

    def sign():
        return f"{owner}\n{secrets.token_hex(8)}"

    def keep():
        while not ended.wait(beat):
            with suppress(OSError), asking(lock):  # the next heartbeat may succeed
                lock.fs.pipe_file(lock.path, sign().encode())

    _take(lock, beat, sign)
    keeper = threading.Thread(target=keep, daemon=True)
    keeper.start()
    try:
        yield
    finally:
        ended.set()
        keeper.join()
        _remove(lock)


def _take(lock, beat, sign):
    """Create a lock, or take over that of a killed run.

    If two runs take it over at once, the second may remove the first one's lock, so a lock counts
    only after it has existed for one heartbeat.
    """
    is_own = _is_new(lock, own := sign())
    while not is_own:
        _wait_for_end(lock, beat)
        _remove(lock)
        if _is_new(lock, own):
            sleep(beat)
        is_own = _content(lock) == own


def _remove(lock):
    """Remove a lock, if it exists."""
    with suppress(OSError), asking(lock):
        lock.fs.rm_file(lock.path)


def _is_new(lock, content):
    """True if a lock could be created where none was."""
    try:
        with asking(lock):
            lock.fs.invalidate_cache()
            lock.fs.pipe_file(lock.path, content.encode(), mode="create")
    except FileExistsError:
        return False
    return True


def _wait_for_end(lock, beat):
    """Return if a lock has not changed for three heartbeats or is gone; refuse one that changes."""
    first = _content(lock)
    end = monotonic() + 3 * beat
    while monotonic() < end:
        sleep(beat / 4)
        if not (now := _content(lock)):
            return
        if now != first:
            raise ValueError(
                f"Another run is active in {lock.parent.parent} ({now.splitlines()[0]}). Wait "
                "until it ends, or stop it first; mlscorr status shows its progress."
            )


def _content(lock):
    """Text of a lock, empty if it is gone."""
    try:
        with asking(lock):
            return lock.fs.cat_file(lock.path).decode()
    except FileNotFoundError:
        return ""
