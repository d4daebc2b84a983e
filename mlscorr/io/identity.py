"""Which file this is: told by its size, time of change, and bytes of its head and tail."""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass
from pathlib import Path

from mlscorr.io.settings import SETTINGS


@dataclass(frozen=True)
class FileIdentity:
    """What a file is told by without reading all of it.

    Parameters
    ----------
    size : int
        Units: bytes.
    changed : int
        Time of the last change. Units: ns.
    digest : str
        SHA-256 of its first and last bytes.
    """

    size: int
    changed: int
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
        state, hashed = os.stat(path), hashlib.sha256()
        with open(path, "rb") as file:
            hashed.update(file.read(SETTINGS.identified_bytes))
            file.seek(max(0, state.st_size - SETTINGS.identified_bytes))
            hashed.update(file.read(SETTINGS.identified_bytes))
        return cls(state.st_size, state.st_mtime_ns, hashed.hexdigest())
