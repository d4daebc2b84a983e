"""Text files: their encoding, their ends, and what of them a message can show."""

import os
import warnings
from collections.abc import Collection
from difflib import get_close_matches
from pathlib import Path

from mlscorr.io.store.opening import open_file

ENCODING = "utf-8-sig"  # UTF-8, with or without a byte order mark


def nearest(name: str, known: Collection[str]) -> str | None:
    """The known name that is spelt most like a name; None where none is spelt much like it.

    Parameters
    ----------
    name : str
    known : collection of str

    Returns
    -------
    str or None

    Examples
    --------
    >>> nearest("sigma_vert", ["sigma_horizontal", "sigma_vertical"])
    'sigma_vertical'
    >>> nearest("name", ["use", "easting"])
    """
    return next(iter(get_close_matches(name, list(known), n=1)), None)  # difflib's own likeness


def shown(text: str) -> str:
    r"""What stands in a file, as a message can show it: one short line without control characters.

    Parameters
    ----------
    text : str

    Examples
    --------
    >>> shown("T01"), shown(chr(27) + "[2J")
    ('T01', '\\x1b[2J')
    """
    short = text if len(text) <= 60 else f"{text[:57]}..."
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in short)


def warn_of_cut(path: str | Path) -> None:
    """Warn of a text file whose last line has no end.

    Parameters
    ----------
    path : path

    Warns
    -----
    UserWarning
    """
    with open_file(path) as file:
        size = file.seek(0, os.SEEK_END)
        file.seek(max(size - 1, 0))
        last = file.read()
    if last not in (b"", b"\n", b"\r"):
        warnings.warn(
            f"The last line of {path} has no end: the file of {size} bytes may have been cut off "
            "there, within a number too. Compare it with its source.",
            stacklevel=3,
        )
