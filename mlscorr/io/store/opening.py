"""Files open for reading: those of a store by ranges through fsspec, those of a disk as ever."""

import io
from pathlib import Path
from typing import Any

import numpy as np

from mlscorr.io.settings import SETTINGS
from mlscorr.io.store.storage import asking, is_remote


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
        how: dict[str, Any] = {"newline": newline, "errors": errors} if encoding else {}
        return open(path, "r" if encoding else "rb", encoding=encoding, **how)
    if is_scattered:
        size = SETTINGS.identified_bytes
    else:
        size = SETTINGS.copied_bytes
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
            raise OSError(f"{path} can't be read by ranges: its server has none. Copy it first.")

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
    with open_file(path) as file:
        file.seek(8 * start)
        data = bytearray(file.read(8 * count if count >= 0 else -1))
    return np.frombuffer(data, "<f8", len(data) // 8)
