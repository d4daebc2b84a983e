"""Paths and URLs: which files are there, in a store as on a disk.

A URL is a UPath of universal_pathlib, which has pathlib's interface; neither it nor fsspec is
imported before there is a URL. Settings of a store (endpoint, credentials) are those of its own
tools and of fsspec, in the environment, so that workers have them too.
"""

import os
import posixpath
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, cast

from mlscorr.io.store.patterns import names_like

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
    if is_remote(name) or not is_url(name):
        if is_remote(name):
            return cast(Path, name)
        return Path(name)
    scheme = str(name).partition("://")[0]
    try:
        from fsspec import get_filesystem_class
        from upath import UPath
    except ImportError:
        raise ImportError(
            f"{name} is a URL, which needs fsspec and universal_pathlib: {EXTRA}"
        ) from None
    try:
        get_filesystem_class(scheme)
    except ImportError as error:
        raise ImportError(
            f"{name} can't be read, as the package for {scheme}:// is missing ({error}): {EXTRA} "
            "has those of s3:// and https://, pip install gcsfs or adlfs that of gs:// or az://"
        ) from None
    except ValueError:
        raise ValueError(
            f"{name} has the unknown scheme {scheme}://; known are s3://, gs://, az://, https:// "
            "and what else fsspec has a package for."
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
        paths = {folder / match for name in names for match in names_like(folder, name)}
        return sorted(path for path in paths if not path.is_dir())
    path: Any = as_path(pattern) if is_url(pattern) else resolved(folder / pattern)
    if path.protocol in WEB:
        raise ValueError(
            f"{path} is a pattern of a web server, which lists nothing: name each file."
        )
    with asking(path):
        path.fs.invalidate_cache()
        infos = path.fs.glob(path.path, detail=True)
        names = sorted(name for name, info in infos.items() if info["type"] != "directory")
    if not names:
        check_bucket(path)
    return [as_path(path.fs.unstrip_protocol(name)) for name in names]


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
    tag = info.get("ETag") or info.get("etag")
    if tag:
        changed = f"{ETAG} {tag}"
    else:
        changed = str(info.get("LastModified") or info.get("created"))
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
                f"{path} may not be reached ({text}). Are the credentials in the environment, as "
                "the store's own tools read them, and in that of the workers? A public one in S3 "
                "needs none: FSSPEC_S3_ANON=true."
            ) from error
        raise OSError(
            f"{path} can't be reached ({text}), also when tried again: the network, the endpoint "
            "or the store itself. Run again when it answers; of a project --resume goes on."
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
