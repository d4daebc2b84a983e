"""The first lines of a CSV file: its header, and where the named columns stand in it."""

from difflib import get_close_matches
from pathlib import Path

ENCODING = "utf-8-sig"  # UTF-8, with or without a byte order mark


def nearest(name, known):
    """The known name that looks most like a name.

    >>> nearest("sigma_vert", ["sigma_horizontal", "sigma_vertical"])
    'sigma_vertical'
    """
    return get_close_matches(name, list(known), n=1, cutoff=0.0)[0]


def read_header(path):
    """Column names of a CSV file, and the number of lines up to and including the header.

    Raises ValueError when the file holds nothing but blank lines or is not text.
    """
    path = Path(path)
    try:
        with path.open(encoding=ENCODING) as file:
            for number, line in enumerate(file, start=1):
                if line.strip():
                    return [cell.strip().strip('"').casefold() for cell in line.split(",")], number
    except UnicodeDecodeError:
        raise ValueError(not_text(path)) from None
    raise ValueError(f"{path} is empty.")


def not_text(path):
    """The sentence on a file that can't be decoded."""
    return (
        f"{path} is not a text file in UTF-8. Save it anew as comma-separated values in UTF-8; "
        "letters such as umlauts are the likely cause."
    )


def find_columns(path, header, required, groups=()):
    """Position of every required column, and of the optional groups that are there: a dict.

    A group is a tuple of columns that only make sense together. Raises ValueError for columns
    that are missing, doubled, or a group that is there in part.
    """
    missing = [name for name in required if name not in header]
    if missing:
        raise ValueError(_missing(path, header, missing))
    found = list(required)
    for group in groups:
        present = [name for name in group if name in header]
        if present and len(present) < len(group):
            absent = [name for name in group if name not in header]
            raise ValueError(
                f"{path} has {_join(present)} but not {_join(absent)}: "
                f"give all of {_join(group)}, or none."
            )
        found += present
    doubled = [name for name in found if header.count(name) > 1]
    if doubled:
        raise ValueError(f"{path} has the column {doubled[0]} {header.count(doubled[0])} times.")
    return {name: header.index(name) for name in found}


def _missing(path, header, missing):
    if len(header) == 1 and any(mark in header[0] for mark in ";\t "):
        return (
            f"{path} seems to be separated by semicolons, tabs or blanks; "
            "columns must be separated by commas, decimals by points."
        )
    others = [name for name in header if name]
    hint = f" {missing[0]} may be meant by '{nearest(missing[0], others)}'." if others else ""
    return f"{path} has no column {_join(missing)}; it has {_join(header)}.{hint}"


def _join(names):
    return ", ".join(names)
