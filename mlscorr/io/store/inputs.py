"""Identity of input files, and detection of changes after reading.

A file is identified by size, time of change, and bytes of its head and tail.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import astuple, dataclass, replace
from pathlib import Path

from mlscorr.io.settings import SETTINGS
from mlscorr.io.store.storage import ETAG, as_path, file_state, open_file
from mlscorr.survey import InputFile


@dataclass(frozen=True)
class FileIdentity:
    """Identity of a file without reading all of it.

    Parameters
    ----------
    size : int
        Units: bytes.
    changed : int or str
        Time of the last change (ns), or a store's ETag.
    digest : str
        SHA-256 of its first and last bytes; of no bytes if an ETag identifies the contents.
    """

    size: int
    changed: int | str
    digest: str

    @classmethod
    def of(cls, path: str | Path) -> FileIdentity:
        """Return the identity of a file as it is now.

        Parameters
        ----------
        path : path

        Raises
        ------
        OSError
            If it can't be read.
        """
        size, changed = file_state(path)
        hashed = hashlib.sha256()
        if not str(changed).startswith(ETAG):
            with open_file(path, is_scattered=True) as file:
                hashed.update(file.read(SETTINGS.identified_bytes))
                file.seek(max(0, size - SETTINGS.identified_bytes))
                hashed.update(file.read(SETTINGS.identified_bytes))
        return cls(size, changed, hashed.hexdigest())

    @property
    def content(self) -> FileIdentity:
        """Identity without the time of the last change, if the digest covers the contents."""
        if str(self.changed).startswith(ETAG):
            return self
        return replace(self, changed=0)


def input_file(what: str, path: str | Path) -> InputFile:
    """Make an InputFile of a file as it is now.

    Parameters
    ----------
    what : str
        Description of the file.
    path : path

    Returns
    -------
    InputFile
    """
    path = as_path(path)
    return InputFile(what, path, _state(path))


def check_unchanged(inputs: Sequence[InputFile]) -> None:
    """Refuse files that were replaced or modified since they were read.

    Results would otherwise mix the old and the new file.

    Parameters
    ----------
    inputs : sequence of InputFile

    Raises
    ------
    OSError
        Names the first such file.
    """
    changed = [file for file in inputs if _state(file.path) != file.state]
    if changed:
        file = changed[0]
        state = _state(changed[0].path)
        size = "it was removed"
        if any(state):
            size = f"{state[0]} bytes now, {file.state[0]} before"
        raise OSError(
            f"{len(changed)} of {len(inputs)} input files changed after they were read (first: "
            f"the {file.what} {file.path}, {size}); another program may still be writing. "
            "Nothing was written. Run again when the files are complete."
        )


def _state(path):
    """Size, time of change and digest of a file; zeros without one.

    The inode's time is not used, because hard links of backups and changed permissions change it.
    """
    try:
        return astuple(FileIdentity.of(path))
    except FileNotFoundError:
        return 0, 0, ""
