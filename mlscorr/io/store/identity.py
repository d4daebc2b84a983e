"""Which file this is: told by its size, time of change, and bytes of its head and tail."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from pathlib import Path

from mlscorr.io.settings import SETTINGS
from mlscorr.io.store.opening import open_file
from mlscorr.io.store.storage import ETAG, file_state


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
        if str(self.changed).startswith(ETAG):
            return self
        return replace(self, changed=0)
