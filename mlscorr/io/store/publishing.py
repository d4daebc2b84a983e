"""What is written into a folder of a disk or of a store: whole files or none, and a lock."""

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

S3 = ("s3", "s3a")  # schemes of stores that take a file in parts, side by side


def names_in(folder: Any) -> list[str]:
    """Names in a folder, in order; none where there is no folder.

    Parameters
    ----------
    folder : Path

    Raises
    ------
    OSError
        Where a store doesn't tell, or its bucket is missing.
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
    """Make a folder; a store has none.

    Parameters
    ----------
    folder : Path
    """
    if not is_remote(folder):
        folder.mkdir(parents=True, exist_ok=True)


def remove_files(folder: Any, pattern: str) -> None:
    """Remove files in a folder by a pattern; all else stays.

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
    """Give a whole file its place; what is there is replaced.

    Parameters
    ----------
    source : Path
        On the disk of the target, or on any where that is in a store.
    target : Path

    Raises
    ------
    OSError
        When it can't be written: the target is then as it was.
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
    """Refuse an output folder in a store that holds an input, or anything that may not be replaced.

    Parameters
    ----------
    out, inputs, overwrite, folders
        As of check_output.

    Raises
    ------
    ValueError
        For a folder that can't be meant.
    OSError
        As names_in.
    """
    if cast(Any, out).protocol in WEB:
        raise ValueError(
            f"{out} is on a web server, which can't store results. Give a store or a disk."
        )
    present = names_in(out)
    own = {out: Path(), **{out / name: Path(name) for name in folders}}
    held = [str(own[p.parent] / p.name) for p in inputs if is_remote(p) and p.parent in own]
    check_contents(out, held, [] if overwrite else present)


def check_contents(out: Path, held: Sequence[str], present: Sequence[str]) -> None:
    """Refuse an output folder for what it holds.

    Parameters
    ----------
    out : Path
    held : sequence of str
        Names of the inputs in it, or in folders of it.
    present : sequence of str
        Names that may not be replaced.

    Raises
    ------
    ValueError
        Where there are any.
    """
    if held:
        raise ValueError(
            f"The output folder {out} contains the input {held[0]}, which must not be changed. "
            "Choose another folder."
        )
    if present:
        raise ValueError(
            f"The output folder {out} already contains {counted(len(present), 'entry')} (first: "
            f"{present[0]}). Choose another folder, or replace files of the same name with "
            "--overwrite."
        )


class _StoredText(io.StringIO):
    """Text that is put into a store beat by beat, and in the end."""

    def __init__(self, path):
        super().__init__()
        self.path = path
        self.due = 0.0
        if is_there(path):
            self.write(read_bytes(path).decode())

    def flush(self):
        if monotonic() >= self.due:
            self.due = monotonic() + SETTINGS.beat
            with suppress(OSError), asking(self.path):  # what it tells of matters more than the log
                self.path.fs.pipe_file(self.path.path, self.getvalue().encode())

    def close(self):
        self.due = 0.0
        self.flush()
        super().close()


def appended(path: Path) -> TextIO:
    """A text file to write on, behind what is there.

    Parameters
    ----------
    path : Path
    """
    if is_remote(path):
        return _StoredText(path)
    return open(path, "a", encoding="utf-8")


@contextmanager
def scratch_folder() -> Iterator[Path]:
    """A folder among those for temporary files (which TMPDIR names), gone in the end."""
    with tempfile.TemporaryDirectory(prefix="mlscorr-") as name:
        yield Path(name)


@contextmanager
def locked_in_store(lock: Any, beat: float = SETTINGS.beat) -> Iterator[None]:
    """Keep other runs out by an object, rewritten beat by beat, which goes in the end.

    One that stays the same for three beats is of a run that was killed, and is taken over: no clock
    of another machine is trusted.

    Parameters
    ----------
    lock : Path
        In a store.
    beat : float
        Units: s.

    Raises
    ------
    ValueError
        Where another run is at work.
    """
    owner = f"{socket.gethostname()}, process {os.getpid()}"
    ended = threading.Event()

    def sign():
        return f"{owner}\n{secrets.token_hex(8)}"

    def keep():
        while not ended.wait(beat):
            with suppress(OSError), asking(lock):  # the next beat may come through
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
    """Make a lock, or take over that of a run which was killed.

    Of two that take it over at once the first one's may be removed by the second: so it counts
    once it has stayed for a beat.
    """
    is_own = _is_new(lock, own := sign())
    while not is_own:
        _wait_for_end(lock, beat)
        _remove(lock)
        if _is_new(lock, own):
            sleep(beat)
        is_own = _content(lock) == own


def _remove(lock):
    """Remove a lock, if it is there."""
    with suppress(OSError), asking(lock):
        lock.fs.rm_file(lock.path)


def _is_new(lock, content):
    """Whether a lock could be made where none was."""
    try:
        with asking(lock):
            lock.fs.invalidate_cache()
            lock.fs.pipe_file(lock.path, content.encode(), mode="create")
    except FileExistsError:
        return False
    return True


def _wait_for_end(lock, beat):
    """Return once a lock has not changed for three beats, or is gone; refuse one that changes."""
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
    """Text of a lock, nothing where it is gone."""
    try:
        with asking(lock):
            return lock.fs.cat_file(lock.path).decode()
    except FileNotFoundError:
        return ""
