"""Files that are read, and whether they are still those that were read."""

from collections.abc import Sequence
from dataclasses import astuple
from pathlib import Path

from mlscorr.io.store.identity import FileIdentity
from mlscorr.io.store.storage import as_path
from mlscorr.survey import InputFile


def input_file(what: str, path: str | Path) -> InputFile:
    """An InputFile as it stands now.

    Parameters
    ----------
    what : str
        What it is, in words.
    path : path

    Returns
    -------
    InputFile
    """
    path = as_path(path)
    return InputFile(what, path, _state(path))


def check_unchanged(inputs: Sequence[InputFile]) -> None:
    """Refuse files that were replaced or written to since they were read.

    Results would be of no file: what was read first of the old one, the rest of the new one.

    Parameters
    ----------
    inputs : sequence of InputFile

    Raises
    ------
    OSError
        Names the first.
    """
    changed = [file for file in inputs if _state(file.path) != file.state]
    if changed:
        file = changed[0]
        state = _state(changed[0].path)
        if any(state):
            size = f"{state[0]} bytes now, {file.state[0]} then"
        else:
            size = "it is gone"
        raise OSError(
            f"{len(changed)} of {len(inputs)} input files were replaced or changed since they were "
            f"read (first: the {file.what} {file.path}, {size}): another program may still be "
            "writing. Nothing was written; run again when all files are whole."
        )


def _state(path):
    """Size, time of change and digest of a file; zeros without one.

    Not the time of its inode: a backup that links it changes that, and so do other rights.
    """
    try:
        return astuple(FileIdentity.of(path))
    except FileNotFoundError:
        return 0, 0, ""
