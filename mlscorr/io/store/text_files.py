"""Text files: encoding, endings, and excerpts for messages."""

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
RARE_LETTERS = b"\xd8"  # lead byte of the second level of GB 2312, which is sorted by radical


def encoding_of(path: str | Path) -> str | None:
    """Detect the encoding of a text file, one of ENCODINGS, from all of its bytes.

    UTF-16 has a byte order mark, and valid UTF-8 is UTF-8. Decoded as GB 18030, most non-ASCII
    letters of a Chinese file are common ones; those of a Windows-1252 file are rare or invalid.
    charset-normalizer fails for both in tables of numbers (tests/io/store/test_text_files.py).

    Parameters
    ----------
    path : path

    Returns
    -------
    str or None
        None for a file that is not text in any of them.
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
    """Code points of the non-ASCII letters of a file; None if it is not text in an encoding."""
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
    """True if most of the given letters are common in Chinese."""
    coded = {letter: letter.encode("gb2312", errors="ignore") for letter in letters}
    common = sum(letters[letter] for letter in letters if b"" < coded[letter] < RARE_LETTERS)
    return 2 * common > letters.total()


def nearest(name: str, known: Collection[str]) -> str | None:
    """Known name with the most similar spelling; None without a similar one.

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
    return next(iter(get_close_matches(name, list(known), n=1)), None)  # similarity by difflib


def shown(text: str) -> str:
    r"""Format the contents of a file for a message: one short line without control characters.

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
    """Format the first of some texts of a file for a message, and the number of the others.

    Parameters
    ----------
    texts : sequence of str
    limit : int
        Number of texts shown.

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
    """Warn of a text file whose last line is unterminated.

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
