"""Paths and URLs: which files are there, and their bytes, in a store as on a disk.

A URL is a UPath of universal_pathlib, which has pathlib's interface; neither it nor fsspec is
imported before there is a URL. Settings of a store (endpoint, credentials) are those of its own
tools and of fsspec, in the environment, so that workers have them too.
"""

import glob
import io
import math
import os
import posixpath
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, cast

import numpy as np

from mlscorr.io.settings import SETTINGS

ALL_FOLDERS = "**"
ETAG = "ETag"  # begins what a store tells contents apart by
URL = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+://")  # a drive of Windows has a single letter
BUCKETS = ("s3", "s3a", "gs", "gcs")  # schemes of stores that have them
WEB = ("http", "https")  # schemes of servers that list nothing and take nothing
EXTRA = "pip install 'mlscorr[remote]'"


def is_url(name: object) -> bool:
    """Whether a name is a URL, and not a path.

    Parameters
    ----------
    name : object

    Examples
    --------
    >>> is_url("s3://city/monday/*.laz"), is_url("C:/city/monday"), is_url("monday")
    (True, False, False)
    """
    return isinstance(name, str) and URL.match(name) is not None


def is_remote(path: object) -> bool:
    """Whether a path is that of a URL, as as_path gives it.

    Parameters
    ----------
    path : object
    """
    upath = sys.modules.get("upath")
    return upath is not None and isinstance(path, upath.UPath)


def as_path(name: str | Path) -> Path:
    """The path of a name; that of a URL has pathlib's interface, and is none of its classes.

    Parameters
    ----------
    name : str or Path

    Raises
    ------
    ValueError
        For a scheme that nothing knows.
    ImportError
        Where the package is missing that reads it.
    """
    if is_remote(name):
        return cast(Path, name)
    if not is_url(name):
        return Path(name)
    scheme = str(name).partition("://")[0]
    try:
        from fsspec import get_filesystem_class
        from upath import UPath
    except ImportError:
        raise ImportError(
            f"{name} is a URL, which requires fsspec and universal_pathlib: {EXTRA}"
        ) from None
    try:
        get_filesystem_class(scheme)
    except ImportError as error:
        raise ImportError(
            f"{name} can't be read: the package for {scheme}:// is missing ({error}). {EXTRA} "
            "installs s3:// and https://, pip install gcsfs or adlfs installs gs:// or az://"
        ) from None
    except ValueError:
        raise ValueError(
            f"{name} has the unknown scheme {scheme}://; known are s3://, gs://, az://, https:// "
            "and other fsspec packages."
        ) from None
    path = UPath(name)
    if scheme in ("file", "local"):
        return Path(path.path)
    return cast(Path, path)


def beside(path: Path, name: str) -> Path:
    """Path of a file that another one names: a URL, or a path from its folder.

    Parameters
    ----------
    path : Path
        Of the file that names it.
    name : str
    """
    if is_url(name):
        return as_path(name)
    there = path.parent / name
    if is_remote(there):
        return resolved(there)
    return there


def resolved(path: Path) -> Path:
    """A path that is the same for the same file: links followed on a disk, ``..`` in a URL.

    No store is asked: a redirection is none of its names.

    Parameters
    ----------
    path : Path
    """
    if not is_remote(path):
        return path.resolve()
    scheme, _, rest = str(path).partition("://")
    if not {".", ".."} & set(rest.split("/")):
        return path  # a name may hold // in a store
    return as_path(f"{scheme}://{posixpath.normpath(rest)}")


def is_there(path: Path) -> bool:
    """Whether a file is there.

    Parameters
    ----------
    path : Path

    Raises
    ------
    OSError
        Where a store doesn't tell: its bucket is missing, it refuses, or doesn't answer.
    """
    if not is_remote(path):
        return path.is_file()
    try:
        with asking(path):
            return _info(path)["type"] == "file"
    except FileNotFoundError:
        check_bucket(path)
        return False


def is_folder(path: Path) -> bool:
    """Whether a folder is there; in a store, whether anything is below a name.

    Parameters
    ----------
    path : Path

    Raises
    ------
    OSError
        As is_there.
    """
    if not is_remote(path):
        return path.is_dir()
    with asking(path):
        return cast(Any, path).fs.isdir(cast(Any, path).path)


def file_state(path: str | Path) -> tuple[int, int | str]:
    """Size of a file (bytes), and time of its last change (ns); of one in a store, its ETag.

    Parameters
    ----------
    path : path

    Raises
    ------
    OSError
        Where it can't be read.
    """
    if not is_remote(path):
        state = os.stat(path)
        return state.st_size, state.st_mtime_ns
    with asking(path):
        info = _info(path)
    changed = str(info.get("LastModified") or info.get("created"))
    if tag := info.get("ETag") or info.get("etag"):
        changed = f"{ETAG} {tag}"
    return info.get("size") or 0, changed


def _info(path):
    """What a store says of a file now."""
    path.fs.invalidate_cache(path.path)
    return path.fs.info(path.path)


@contextmanager
def asking(path: Any) -> Iterator[None]:
    """Where a store is asked for a path: what its libraries raise becomes a sentence.

    Parameters
    ----------
    path : Path

    Raises
    ------
    OSError
    """
    try:
        yield
    except Exception as error:
        text = " ".join(str(error).split()) or type(error).__name__
        is_cut = isinstance(error.__cause__, OSError)  # which fsspec takes for a missing file
        if isinstance(error, FileExistsError):
            raise
        if isinstance(error, FileNotFoundError) and not is_cut:
            raise FileNotFoundError(f"{path} does not exist.") from error
        if isinstance(error, PermissionError) or "Credentials" in type(error).__name__:
            raise PermissionError(
                f"Access to {path} was denied ({text}). Check the credentials in the "
                "environment, also of the workers. Public data in S3 needs none: "
                "FSSPEC_S3_ANON=true."
            ) from error
        raise OSError(
            f"{path} can't be reached, even after retries ({text}). Check the network, the "
            "endpoint and the store, and run again; continue a project with --resume."
        ) from error


def check_bucket(path: Any) -> None:
    """Refuse a path whose bucket isn't there.

    Parameters
    ----------
    path : Path

    Raises
    ------
    FileNotFoundError
    """
    bucket = path.parts[0].rstrip("/")
    if path.protocol not in BUCKETS:
        return
    try:
        with suppress(PermissionError), asking(path):
            path.fs.info(bucket)
    except FileNotFoundError:
        raise FileNotFoundError(
            f"{path} can't be read: there is no bucket {bucket} at this endpoint."
        ) from None


def open_file(
    path: str | Path,
    encoding: str | None = None,
    newline: str | None = None,
    errors: str = "strict",
    is_scattered: bool = False,
) -> Any:
    """A file open for reading, of text where its encoding is given; of a store by ranges.

    Parameters
    ----------
    path : path
    encoding, newline, errors
        As of open.
    is_scattered : bool
        Whether bytes here and there are read, not all in a row: a store gives less at a time.

    Raises
    ------
    OSError
        Where it can't be read; in a ``with`` also where a library hid that behind its own error.
    """
    if not is_remote(path):
        if encoding is None:
            return open(path, "rb")
        return open(path, encoding=encoding, errors=errors, newline=newline)
    size = SETTINGS.identified_bytes if is_scattered else SETTINGS.copied_bytes
    reader = _Reader(_Ranges(path, size))
    if encoding:
        return io.TextIOWrapper(reader, encoding, errors, newline)
    return reader


class _Ranges(io.RawIOBase):
    """A file of a store, fetched by blocks, of which the last few are kept."""

    def __init__(self, path, block_size):
        super().__init__()
        self.name = str(path)
        self.interruption = None
        with asking(path):
            path.fs.invalidate_cache(path.path)
            how = {"block_size": block_size, "cache_type": "blockcache"}
            self._path, self._file = path, path.fs.open(path.path, "rb", **how)
        if not self._file.seekable():
            raise OSError(
                f"{path} can't be read in parts, because its server does not support "
                "byte ranges. Download it first."
            )

    def readable(self):
        return True

    def seekable(self):
        return True

    def seek(self, offset, whence=io.SEEK_SET):
        return self._file.seek(offset, whence)

    def readinto(self, buffer):
        try:
            with asking(self._path):
                data = self._file.read(len(buffer))
        except OSError as error:
            self.interruption = error
            raise
        buffer[: len(data)] = data
        return len(data)

    def close(self):
        if not self.closed:
            self._file.close()
        super().close()


class _Reader(io.BufferedReader):
    """Raises what the store did, and not what a decoder made of it."""

    def __exit__(self, kind, error, trace):
        interruption = self.raw.interruption
        super().__exit__(kind, error, trace)
        if error is not None and interruption is not None:
            raise interruption


def read_bytes(path: str | Path) -> bytes:
    """All of a file.

    Parameters
    ----------
    path : path
    """
    if is_remote(path):
        store: Any = path
        with asking(store):
            return store.fs.cat_file(store.path)
    return Path(path).read_bytes()


def read_doubles(path: str | Path, start: int = 0, count: int = -1) -> np.ndarray:
    """Doubles (n,) of a binary file, little-endian.

    Parameters
    ----------
    path : path
    start : int
        Number of the first.
    count : int
        How many; all that are left if negative.
    """
    size = -1
    if count >= 0:
        size = 8 * count
    with open_file(path) as file:
        file.seek(8 * start)
        data = bytearray(file.read(size))
    return np.frombuffer(data, "<f8", len(data) // 8)


def files_like(folder: Path, pattern: str) -> list[Path]:
    """Files by a pattern, in order of their names.

    Parameters
    ----------
    folder : Path
    pattern : str
        From the folder, or a URL. On a disk ``**`` enters each folder once, whatever links to it.

    Raises
    ------
    ValueError
        For a pattern of a web server.
    OSError
        As is_there.
    """
    if not is_url(pattern) and not is_remote(folder):
        stem, end = posixpath.splitext(pattern)  # endings in capitals are as good
        names = {pattern, stem + end.lower(), stem + end.upper()}
        paths = {folder / match for name in names for match in _names_like(folder, name)}
        return sorted(path for path in paths if not path.is_dir())
    path: Any = as_path(pattern) if is_url(pattern) else resolved(folder / pattern)
    if path.protocol in WEB:
        raise ValueError(
            f"{path} is a pattern on a web server, which can't list files. Name each file."
        )
    with asking(path):
        path.fs.invalidate_cache()
        infos = path.fs.glob(path.path, detail=True)
        names = sorted(name for name, info in infos.items() if info["type"] != "directory")
    if not names:
        check_bucket(path)
    return [as_path(path.fs.unstrip_protocol(name)) for name in names]


def _names_like(folder: Path, pattern: str) -> set[str]:
    """Names of files and folders by a pattern, from a folder."""
    # Python's own ** follows a link each time that it meets it: two folders that link to each
    # other are entered in every order, some 2^40 times before the system refuses
    parts = re.split(r"[\\/]" if os.sep == "\\" else "/", pattern)
    if ALL_FOLDERS not in parts:
        return set(glob.glob(pattern, root_dir=folder))
    place = parts.index(ALL_FOLDERS)
    before = "/".join([*parts[:place], ""])
    behind = "/".join(parts[place + 1 :]) or "*"
    names = set()
    tops = [""]
    if before:
        tops = glob.glob(before, root_dir=folder)
    for top in tops:
        for below in folders_below(folder / top):
            name = Path(top) / below.relative_to(folder / top)
            names |= {str(name / file) for file in _names_like(below, behind)}
    return names


def folders_below(
    folder: Path, depth: float = math.inf, is_wanted: Callable[[Path], bool] = lambda _: True
) -> Iterator[Path]:
    """A folder and those within it that are not hidden; links are followed, each folder comes once.

    Folders themselves come before links to them. A link to a folder that holds the link, or the
    first folder, is not followed.

    Parameters
    ----------
    folder : Path
    depth : float
        Number of levels below the folder.
    is_wanted : function of a Path
        Whether one of the folders within it is entered.

    Yields
    ------
    Path
    """
    top = os.path.realpath(folder)
    entered = set()
    waiting = [(folder, 0)]
    links: list[tuple[Path, int]] = []
    while waiting or links:
        here, level = waiting.pop() if waiting else links.pop(0)
        real = os.path.realpath(here)
        if real in entered:
            continue
        entered.add(real)
        if level and not is_wanted(here):
            continue
        yield here
        if level >= depth:
            continue
        for path in _folders_in(here):
            if not path.is_symlink():
                waiting.append((path, level + 1))
            elif not any(_holds(os.path.realpath(path), inner) for inner in (real, top)):
                links.append((path, level + 1))


def _folders_in(folder):
    """Folders in a folder, links to folders among them; none in one that may not be read."""
    try:
        names = sorted(os.listdir(folder), reverse=True)
    except OSError:
        return []
    return [folder / name for name in names if name[0] != "." and (folder / name).is_dir()]


def _holds(folder, inner):
    """Return True if a real path is that of a folder, or lies below it."""
    return inner == folder or inner.startswith(os.path.join(folder, ""))
