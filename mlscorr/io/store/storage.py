"""Paths and URLs: existence of files, and their bytes, in a store or on a disk.

A URL is a UPath of universal_pathlib, which has pathlib's interface; neither it nor fsspec is
imported unless there is a URL. Settings of a store (endpoint, credentials) come from the
environment, as for its own tools and fsspec, so that workers have them, too.
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
ETAG = "ETag"  # prefix of a store's identifier of contents
URL = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+://")  # a drive of Windows has a single letter
BUCKETS = ("s3", "s3a", "gs", "gcs")  # schemes of stores that have buckets
WEB = ("http", "https")  # schemes of servers without listing or upload
EXTRA = "pip install 'mlscorr[remote]'"


def is_url(name: object) -> bool:
    """True if a name is a URL, not a path.

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
    """True if a path, as from as_path, is that of a URL.

    Parameters
    ----------
    path : object
    """
    upath = sys.modules.get("upath")
    return upath is not None and isinstance(path, upath.UPath)


def as_path(name: str | Path) -> Path:
    """Return the path of a name; that of a URL has pathlib's interface, but not its classes.

    Parameters
    ----------
    name : str or Path

    Raises
    ------
    ValueError
        If the scheme is unknown.
    ImportError
        If the package for the scheme is missing.
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


def sibling(path: Path, name: str) -> Path:
    """Path of a file that another file names: a URL, or a path relative to its folder.

    Parameters
    ----------
    path : Path
        File that names it.
    name : str
    """
    if is_url(name):
        return as_path(name)
    there = path.parent / name
    if is_remote(there):
        return resolved(there)
    return there


def resolved(path: Path) -> Path:
    """Canonical path of a file: with links resolved on a disk, and ``..`` in a URL.

    No store is accessed, so redirections are not resolved.

    Parameters
    ----------
    path : Path
    """
    if not is_remote(path):
        return path.resolve()
    scheme, _, rest = str(path).partition("://")
    if not {".", ".."} & set(rest.split("/")):
        return path  # a name may contain // in a store
    return as_path(f"{scheme}://{posixpath.normpath(rest)}")


def is_there(path: Path) -> bool:
    """True if a file exists.

    Parameters
    ----------
    path : Path

    Raises
    ------
    OSError
        If a store does not respond, refuses access, or has no such bucket.
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
    """True if a folder exists; in a store, if there is anything below a name.

    Parameters
    ----------
    path : Path

    Raises
    ------
    OSError
        See ``is_there``.
    """
    if not is_remote(path):
        return path.is_dir()
    with asking(path):
        return cast(Any, path).fs.isdir(cast(Any, path).path)


def file_state(path: str | Path) -> tuple[int, int | str]:
    """Size of a file (bytes), and time of its last change (ns) or, in a store, its ETag.

    Parameters
    ----------
    path : path

    Raises
    ------
    OSError
        If it can't be read.
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
    """Current information of a store on a file."""
    path.fs.invalidate_cache(path.path)
    return path.fs.info(path.path)


@contextmanager
def asking(path: Any) -> Iterator[None]:
    """Context for access to a store: errors of its libraries become a message.

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
        is_cut = isinstance(error.__cause__, OSError)  # fsspec reports these as a missing file
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
    """Refuse a path whose bucket does not exist.

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
    """Open a file for reading, as text if an encoding is given; from a store by ranges.

    Parameters
    ----------
    path : path
    encoding, newline, errors
        See open.
    is_scattered : bool
        True if scattered bytes are read instead of all in sequence; blocks from a store are then
        smaller.

    Raises
    ------
    OSError
        If it cannot be read; in a ``with`` block also if a library replaced that error by its own.
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
    """File in a store, fetched in blocks, the last few of which are kept."""

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
    """Reader that raises the store's error instead of a decoder's."""

    def __exit__(self, kind, error, trace):
        interruption = self.raw.interruption
        super().__exit__(kind, error, trace)
        if error is not None and interruption is not None:
            raise interruption


def read_bytes(path: str | Path) -> bytes:
    """Read all of a file.

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
    """Read doubles (n,) of a binary file, little-endian.

    Parameters
    ----------
    path : path
    start : int
        Index of the first.
    count : int
        Number of doubles; all remaining ones if negative.
    """
    size = -1
    if count >= 0:
        size = 8 * count
    with open_file(path) as file:
        file.seek(8 * start)
        data = bytearray(file.read(size))
    return np.frombuffer(data, "<f8", len(data) // 8)


def files_like(folder: Path, pattern: str) -> list[Path]:
    """Find files by a pattern, sorted by name.

    Parameters
    ----------
    folder : Path
    pattern : str
        Relative to the folder, or a URL. On a disk ``**`` enters each folder once, regardless of
        links.

    Raises
    ------
    ValueError
        If it is a pattern on a web server.
    OSError
        See ``is_there``.
    """
    if not is_url(pattern) and not is_remote(folder):
        stem, end = posixpath.splitext(pattern)  # upper-case suffixes are equivalent
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
    """Names of files and folders in a folder by a pattern."""
    # Python's own ** follows every occurrence of a link: two folders that link to each other are
    # entered in every order, about 2^40 times before the system refuses
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
    """Yield a folder and its visible subfolders, each once, following links.

    Folders come before links to them. A link to a folder that contains the link, or to the first
    folder, is not followed.

    Parameters
    ----------
    folder : Path
    depth : float
        Number of levels below the folder.
    is_wanted : function of a Path
        True if a subfolder is entered.

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
    """Folders in a folder, including links to folders; empty if it is not readable."""
    try:
        names = sorted(os.listdir(folder), reverse=True)
    except OSError:
        return []
    return [folder / name for name in names if name[0] != "." and (folder / name).is_dir()]


def _holds(folder, inner):
    """True if a real path is that of a folder, or is below it."""
    return inner == folder or inner.startswith(os.path.join(folder, ""))
