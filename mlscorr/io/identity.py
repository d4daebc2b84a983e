"""Which file this is: told by its size, time of change, and bytes of its head and tail."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

from mlscorr.io.opening import open_file
from mlscorr.io.settings import SETTINGS
from mlscorr.io.storage import ETAG, file_state


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


def find_copies(paths: Iterable[Path]) -> dict[Path, Path]:
    """Files that hold the same as one before them, each with that one.

    Only those of one size are opened, and told by their heads and tails.

    Parameters
    ----------
    paths : iterable of Path

    Raises
    ------
    OSError
        Where one can't be read.
    """
    sizes = {path: file_state(path)[0] for path in paths}
    count, firsts, copies = Counter(sizes.values()), {}, {}
    for path in (path for path, size in sizes.items() if size and count[size] > 1):
        identity = FileIdentity.of(path)
        is_tagged = str(identity.changed).startswith(ETAG)
        first = firsts.setdefault(identity if is_tagged else replace(identity, changed=0), path)
        copies |= {path: first} if first != path else {}
    return copies
