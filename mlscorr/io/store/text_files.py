"""Text files: their encoding, their ends, and what of them a message can show."""

import codecs
import os
import warnings
from collections import Counter
from collections.abc import Collection, Sequence
from difflib import get_close_matches
from pathlib import Path

from mlscorr.io.settings import SETTINGS
from mlscorr.io.store.storage import open_file

ENCODING = "utf-8-sig"  # UTF-8, with or without a byte order mark
ENCODINGS = {ENCODING: "UTF-8", "utf-16": "UTF-16", "gb18030": "GB 18030", "cp1252": "Windows-1252"}
RARE_LETTERS = b"\xd8"  # lead byte from which on GB 2312 has its second level, by radical


def encoding_of(path: str | Path) -> str | None:
    """Return the encoding of a text file, one of ENCODINGS, by all of its bytes.

    UTF-16 has a byte order mark, and valid UTF-8 is UTF-8. Read as GB 18030, most letters beyond
    ASCII of a Chinese file are common ones, those of a file in Windows-1252 are rare ones or none.
    charset-normalizer mistakes both in tables of numbers (tests/io/store/test_text_files.py).

    Parameters
    ----------
    path : path

    Returns
    -------
    str or None
        None for a file that is no text in any of them.
    """
    with open_file(path) as file:
        has_mark = file.read(2) in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
    candidates = ("utf-16",) if has_mark else (ENCODING, "gb18030", "cp1252")
    for encoding in candidates:
        letters = _letters_beyond_ascii(path, encoding)
        if letters is None or (encoding == "gb18030" and not _are_chinese(letters)):
            continue
        return encoding
    return None


def _letters_beyond_ascii(path, encoding):
    """Numbers of the letters beyond ASCII of a file; None where it is no text in an encoding."""
    letters: Counter[str] = Counter()
    try:
        with open_file(path, encoding) as file:
            while block := file.read(SETTINGS.copied_bytes):
                if not block.isascii():
                    letters.update(letter for letter in block if not letter.isascii())
    except UnicodeError:
        return None
    return letters


def _are_chinese(letters):
    """Return True if most of some letters, given by their numbers, are common in Chinese."""
    coded = {letter: letter.encode("gb2312", errors="ignore") for letter in letters}
    common = sum(letters[letter] for letter in letters if b"" < coded[letter] < RARE_LETTERS)
    return 2 * common > letters.total()


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


def listed(texts: Sequence[str], limit: int) -> str:
    """The first of some texts of a file, as a message can show them, and the number of the others.

    Parameters
    ----------
    texts : sequence of str
    limit : int
        How many are shown.

    Examples
    --------
    >>> listed(["E", "N", "H"], 2)
    'E, N, and 1 more'
    """
    words = [shown(text) for text in texts[:limit]]
    if len(texts) > limit:
        words.append(f"and {len(texts) - limit} more")
    return ", ".join(words)


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
            f"The last line of {path} has no line end: the file of {size} bytes may be "
            "truncated, even within a number. Compare it with its source.",
            stacklevel=3,
        )
