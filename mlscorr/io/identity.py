"""Which file this is: told by its size, time of change, and bytes of its head and tail."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from mlscorr.io.las_checks import read_layout
from mlscorr.io.opening import open_file
from mlscorr.io.settings import SETTINGS
from mlscorr.io.storage import ETAG, file_state, is_remote


@dataclass(frozen=True)
class FileIdentity:
    """What a file is told by without reading all of it.

    Parameters
    ----------
    size : int
        Units: bytes.
    changed : int or str
        Time of the last change (ns), or a store's ETag.
    digest : str
        SHA-256 of its first and last bytes; of none where an ETag tells contents apart.
    """

    size: int
    changed: int | str
    digest: str

    @classmethod
    def of(cls, path: str | Path) -> FileIdentity:
        """That of a file as it stands.

        Parameters
        ----------
        path : path

        Raises
        ------
        OSError
            Where it can't be read.
        """
        (size, changed), hashed = file_state(path), hashlib.sha256()
        if not str(changed).startswith(ETAG):
            with open_file(path, is_scattered=True) as file:
                hashed.update(file.read(SETTINGS.identified_bytes))
                file.seek(max(0, size - SETTINGS.identified_bytes))
                hashed.update(file.read(SETTINGS.identified_bytes))
        return cls(size, changed, hashed.hexdigest())

    @property
    def content(self) -> FileIdentity:
        """The same without the time of the last change, where the digest tells of the contents."""
        return self if str(self.changed).startswith(ETAG) else replace(self, changed=0)


def find_copies(paths: Iterable[Path]) -> dict[Path, Path]:
    """Files that hold the same as one before them, each with that one.

    Only those of one size are opened, and told by their heads and tails. Those without points that
    can be read count nothing twice, and are refused where they are read.

    Parameters
    ----------
    paths : iterable of Path
    """
    there = [path for path in paths if is_remote(path) or path.is_file()]
    sizes = {path: file_state(path)[0] for path in there}
    count, firsts, copies = Counter(sizes.values()), {}, {}
    for path in (path for path, size in sizes.items() if size and count[size] > 1):
        with suppress(OSError, ValueError):
            first = firsts.setdefault(FileIdentity.of(path).content, path)
            if first != path and read_layout(path).points:
                copies[path] = first
    return copies
